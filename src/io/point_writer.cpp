#include <string>

#include <gdfmap/core/error.hpp>
#include <gdfmap/io/point_writer.hpp>

#include "formats.hpp"
#include "text.hpp"

namespace gdfmap {

std::unique_ptr<PointWriter> create_point_cloud(const std::filesystem::path& path,
                                                const WriterOptions& options) {
  const std::string extension = path.extension().string();
  const auto is = [&](const char* known) { return io::equal_ignoring_case(extension, known); };
  if (is(".ply")) return io::create_ply(path, options);
  if (is(".pcd")) return io::create_pcd(path, options);
  if (is(".las")) return io::create_las(path, options);
  if (is(".csv")) return io::create_xyz(path, ',');
  if (is(".xyz") || is(".txt")) return io::create_xyz(path, ' ');
  throw Error(ErrorCode::kUsage, "cannot write a point cloud to " + path.string() +
                                     ": its name must end in .ply, .pcd, .las, .xyz, .csv or .txt");
}

}  // namespace gdfmap
