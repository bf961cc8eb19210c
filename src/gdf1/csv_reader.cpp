#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <string>
#include <system_error>

#include <gdfmap/core/error.hpp>

#include "cube_builder.hpp"
#include "cube_size.hpp"
#include "format.hpp"
#include "input_file.hpp"
#include "sidecar.hpp"

namespace gdfmap::gdf1 {
namespace {

struct CsvRow {
  std::array<float, 3> origin{};
  float mae = 0.0f;
  float standard_deviation = 0.0f;
  float id = 0.0f;
  FileGaussian gaussian{};
};

std::string_view trimmed(std::string_view text) {
  while (text.starts_with(' ') || text.starts_with('\t')) text.remove_prefix(1);
  while (text.ends_with(' ') || text.ends_with('\t')) text.remove_suffix(1);
  return text;
}

/// Also takes what is beyond float's range, as infinity or zero.
std::optional<float> parse_float(std::string_view text) {
  text = trimmed(text);
  if (text.starts_with('+')) text.remove_prefix(1);
  const char* const end = text.data() + text.size();
  float value = 0.0f;
  auto result = std::from_chars(text.data(), end, value);
  if (result.ec == std::errc::result_out_of_range) {
    double wide = 0.0;
    result = std::from_chars(text.data(), end, wide);
    if (result.ec == std::errc::result_out_of_range) return std::nullopt;
    value = static_cast<float>(wide);
  }
  if (result.ec != std::errc{} || result.ptr != end) return std::nullopt;
  return value;
}

/// The rows of a CSV model, one after the other; blank lines are passed over.
class CsvRows {
 public:
  explicit CsvRows(const std::filesystem::path& path) : file_(path) {
    std::string_view line;
    const bool has_line = file_.read_line(line);
    if (line.starts_with("\xef\xbb\xbf")) line.remove_prefix(3);
    if (!has_line || trimmed(line) != kCsvHeader) {
      throw Error(ErrorCode::kCorrupt, file_.path().string() +
                                           ": not a CSV model: the first line is not " +
                                           std::string(kCsvHeader));
    }
  }

  [[nodiscard]] bool next(CsvRow& row) {
    std::string_view line;
    do {
      if (!file_.read_line(line)) return false;
    } while (trimmed(line).empty());
    const auto f = split(line);
    row.origin = {f[0], f[1], f[2]};
    row.mae = f[3];
    row.standard_deviation = f[4];
    row.id = f[5];
    for (std::size_t r = 0; r < kNumGaussianRows; ++r) row.gaussian[r] = f[6 + r];
    return true;
  }

 private:
  std::array<float, kCsvColumns> split(std::string_view line) const {
    std::array<float, kCsvColumns> fields{};
    for (std::size_t column = 0; column < kCsvColumns; ++column) {
      const bool is_last = column + 1 == kCsvColumns;
      const std::size_t comma = line.find(',');
      if ((comma == std::string_view::npos) != is_last) fail("13 columns are expected");
      const auto value = parse_float(line.substr(0, comma));
      if (!value) fail("column " + std::to_string(column + 1) + " is not a number");
      fields[column] = *value;
      line.remove_prefix(is_last ? line.size() : comma + 1);
    }
    return fields;
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(ErrorCode::kCorrupt, file_.path().string() + ": line " +
                                         std::to_string(file_.line_number()) + ": " + what);
  }

  InputFile file_;
};

/// A cube is a run of rows of one origin whose Gaussians count from 0.
class CubeBoundary {
 public:
  [[nodiscard]] bool starts_cube(const CsvRow& row) {
    // As bits, so that not-a-number equals itself.
    const auto origin = std::bit_cast<std::array<std::uint32_t, 3>>(row.origin);
    const bool starts = is_first_ || row.id == 0.0f || origin != origin_;
    is_first_ = false;
    origin_ = origin;
    return starts;
  }

 private:
  bool is_first_ = true;
  std::array<std::uint32_t, 3> origin_{};
};

std::array<std::vector<float>, 3> read_origins(const std::filesystem::path& path) {
  std::array<std::vector<float>, 3> origins;
  CsvRows rows(path);
  CubeBoundary boundary;
  for (CsvRow row; rows.next(row);) {
    if (!boundary.starts_cube(row)) continue;
    for (std::size_t a = 0; a < 3; ++a) origins[a].push_back(row.origin[a]);
  }
  return origins;
}

double cube_size_of(const std::filesystem::path& path, std::optional<double> stated,
                    const std::optional<Sidecar>& sidecar) {
  if (stated) return *stated;
  if (sidecar && sidecar->cube_size) return *sidecar->cube_size;
  const auto deduced = deduce_cube_size(read_origins(path));
  if (!deduced) {
    throw Error(ErrorCode::kUsage,
                path.string() + ": the origins do not tell the cube size: state it (--cube-size)");
  }
  return *deduced;
}

Placement place(const std::filesystem::path& path, std::optional<double> stated) {
  const auto sidecar = read_sidecar(path, ModelFormat::kCsv);
  const double cube_size = cube_size_of(path, stated, sidecar);
  const auto placement =
      Placement::make(cube_size, sidecar ? sidecar->shift : Vector3(Vector3::Zero()));
  if (!placement) {
    throw Error(ErrorCode::kUsage, path.string() + ": cube size " + std::to_string(cube_size) +
                                       " m is not positive, or does not divide the shift in " +
                                       sidecar_path(path).filename().string());
  }
  return *placement;
}

/// What a CSV does not state, from its cubes.
class HeaderSummary {
 public:
  explicit HeaderSummary(double cube_size) : lattice_(cube_size) {}

  void add(const Gdf1Cube& cube) {
    bounds_.extend(lattice_.cube_box(cube.key));
    add(mae_, cube.mae);
    add(standard_deviation_, cube.standard_deviation);
  }

  [[nodiscard]] Gdf1Header header(std::uint32_t num_cubes) const {
    Gdf1Header header;
    header.num_cubes = num_cubes;
    header.average_mae = mae_.average();
    header.average_standard_deviation = standard_deviation_.average();
    header.bounds = bounds_;
    header.cube_size = lattice_.cube_size();
    header.margin = kMarginRatio * lattice_.cube_size();
    return header;
  }

 private:
  struct Mean {
    double sum = 0.0;
    std::uint64_t count = 0;
    [[nodiscard]] float average() const {
      return count == 0 ? 0.0f : static_cast<float>(sum / static_cast<double>(count));
    }
  };

  static void add(Mean& mean, float value) {
    if (std::isnan(value)) return;
    mean.sum += static_cast<double>(value);
    ++mean.count;
  }

  Lattice lattice_;
  Box3 bounds_;
  Mean mae_, standard_deviation_;
};

}  // namespace

ModelSummary visit_csv(const std::filesystem::path& path, const CubeVisitor& visit,
                       std::optional<double> cube_size) {
  const Placement placement = place(path, cube_size);
  HeaderSummary summary(placement.cube_size());
  const CubeVisitor counted = [&](Gdf1Cube&& cube) {
    summary.add(cube);
    visit(std::move(cube));
  };
  CubeBuilder builder(placement, counted);
  CsvRows rows(path);
  CubeBoundary boundary;
  std::uint32_t num_cubes = 0;
  for (CsvRow row; rows.next(row);) {
    if (boundary.starts_cube(row)) {
      if (num_cubes++ > 0) builder.end();
      builder.begin(row.origin, row.mae, row.standard_deviation);
    }
    builder.add(row.gaussian);
  }
  if (num_cubes > 0) builder.end();
  return {summary.header(num_cubes), builder.counts()};
}

}  // namespace gdfmap::gdf1
