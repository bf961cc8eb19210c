// Writes the seeds of the fuzzers: small files of every format, made by the project's own writers
// and those of its tests. The corpus in the repository is what this program writes, and beside it
// inputs that once found a defect.
//
//   gdfmap_make_fuzz_corpus tests/fuzz/corpus

#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include <gdfmap/store/surroundings.hpp>
#include <gdfmap/store/tile_codec.hpp>
#include <gdfmap/tiling/block_codec.hpp>

#include "gdf1/model_files.hpp"
#include "io/small_clouds.hpp"
#include "store/sample_tiles.hpp"

namespace gdfmap {
namespace {

namespace fs = std::filesystem;

/// A seed that its reader accepts.
fs::path seed_path(const fs::path& corpus, const std::string& target, std::string name) {
  for (char& c : name) c = c == ' ' || c == '.' ? '_' : c;
  fs::create_directories(corpus / target);
  return corpus / target / ("valid_" + name);
}

void write_seed(const fs::path& path, std::string_view bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!file.flush()) throw Error(ErrorCode::kIo, "cannot write " + path.string());
}

void write_seed(const fs::path& path, const Bytes& bytes) {
  write_seed(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

void write_clouds(const fs::path& corpus) {
  for (const io_test::SmallCloud& cloud : io_test::small_clouds()) {
    const std::string name = cloud.name;
    const std::string format = name.substr(0, name.find(' '));
    write_seed(seed_path(corpus, format == "csv" ? "xyz" : format, name), cloud.bytes);
  }
}

void write_poses(const fs::path& corpus) {
  write_seed(seed_path(corpus, "poses", "kitti"),
             "1 0 0 0 0 1 0 0 0 0 1 0\n0 -1 0 1.5 1 0 0 -2.5 0 0 1 4.5e2\n");
  write_seed(seed_path(corpus, "poses", "tum"),
             "# time x y z qx qy qz qw\n\n1305031102.1758 1.3 .6 -1.6 0 0 0.7071 0.7071\n");
}

/// One point, a line, and a cloud that fills every byte plane.
void write_blocks(const fs::path& corpus) {
  std::vector<TileOffset> line, cloud;
  for (std::uint16_t i = 0; i < 200; ++i) line.push_back({i, 7, 7});
  for (std::uint32_t i = 0; i < 100; ++i) {
    const auto step = [&](std::uint32_t factor) { return static_cast<std::uint16_t>(i * factor); };
    cloud.push_back({step(40503), step(30029), step(20011)});
  }
  sort_unique(line);
  sort_unique(cloud);
  write_seed(seed_path(corpus, "block", "one"), encode_block(std::vector{TileOffset{1, 2, 3}}));
  write_seed(seed_path(corpus, "block", "line"), encode_block(line));
  write_seed(seed_path(corpus, "block", "cloud"), encode_block(cloud));
}

void write_tiles(const fs::path& corpus) {
  write_seed(seed_path(corpus, "tile", "none"), encode_tile({}));
  TileRecord small;
  small.cubes = {test::sample_cube(3, 1, 1), test::failed_cube(9)};
  write_seed(seed_path(corpus, "tile", "two"), encode_tile(small));
  write_seed(seed_path(corpus, "tile", "four"), encode_tile(test::sample_tile({0, 1, 2, 3}, 1)));
  write_seed(seed_path(corpus, "tile", "quantized"), encode_tile(test::quantized_tile(1.0)));
  const TileRecord tile = test::sample_tile({0, 1, 2, 3}, 1);
  write_seed(seed_path(corpus, "surroundings", "two"),
             encode_surroundings(tile.key, tile.surroundings));
}

void write_models(const fs::path& corpus) {
  const std::vector<Gdf1Cube> cubes = {make_cube(-1, 0, 2, {kFirst}),
                                       make_cube(0, 0, 2, {kFirst, kSecond})};
  for (const auto& [target, extension] : {std::pair{"gdf1", ".bin"}, std::pair{"csv", ".csv"}}) {
    const fs::path seed = seed_path(corpus, target, "two");
    const fs::path model = seed.string() + extension;
    write_model(model, cubes);
    fs::rename(model, seed);
  }
}

void write_configurations(const fs::path& corpus) {
  write_seed(seed_path(corpus, "yaml", "empty"), "");
  const std::vector<std::pair<const char*, const char*>> sections = {
      {"io", "io: {input_file: a.ply, output_base: out, export_csv: false, export_bin: true}\n"},
      {"processing", "processing: {num_threads: 2, cube_size: 0.5}\n"},
      {"trainer", "trainer:\n  mae_threshold_max: 0.3\n  edt_mode: pure\n  sample_points: 9\n"},
      {"solver", "solver:\n  max_iterations: 20\nfit:\n  solver: tensor\n"},
      {"steps", "adaptive:\n  populated_steps: [8, 16, 32]\n  empty_steps: [4]\n"},
      {"adaptive", "adaptive:\n  mae_threshold: 0.01\n  empty_distance_threshold: 2.0\n"}};
  for (const auto& [name, text] : sections) write_seed(seed_path(corpus, "yaml", name), text);
}

}  // namespace
}  // namespace gdfmap

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: gdfmap_make_fuzz_corpus DIRECTORY\n", stderr);
    return 2;
  }
  try {
    for (const auto& write :
         {gdfmap::write_clouds, gdfmap::write_poses, gdfmap::write_blocks, gdfmap::write_tiles,
          gdfmap::write_models, gdfmap::write_configurations}) {
      write(argv[1]);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "gdfmap_make_fuzz_corpus: %s\n", error.what());
    return 1;
  }
  return 0;
}
