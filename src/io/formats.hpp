#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>

#include <gdfmap/io/point_reader.hpp>
#include <gdfmap/io/point_writer.hpp>

#include "input_file.hpp"

namespace gdfmap::io {

/// One per format; the file stands at its first byte.
/// @throws Error kCorrupt when the header is damaged or the counts do not fit the file.
[[nodiscard]] std::unique_ptr<PointReader> open_ply(std::unique_ptr<InputFile> file);
[[nodiscard]] std::unique_ptr<PointReader> open_pcd(std::unique_ptr<InputFile> file);
[[nodiscard]] std::unique_ptr<PointReader> open_las(std::unique_ptr<InputFile> file);
/// For everything that is none of the others: also says that it is no point cloud.
[[nodiscard]] std::unique_ptr<PointReader> open_xyz(std::unique_ptr<InputFile> file);

/// Points that writers encode at a time.
inline constexpr std::size_t kWriterBlockPoints = 4096;

/// @throws Error kIo when the file cannot be created, kUsage for options that cannot be used.
[[nodiscard]] std::unique_ptr<PointWriter> create_ply(const std::filesystem::path& path,
                                                      const WriterOptions& options);
[[nodiscard]] std::unique_ptr<PointWriter> create_pcd(const std::filesystem::path& path,
                                                      const WriterOptions& options);
[[nodiscard]] std::unique_ptr<PointWriter> create_las(const std::filesystem::path& path,
                                                      const WriterOptions& options);
/// `separator` between the numbers; a header line where it is a comma.
[[nodiscard]] std::unique_ptr<PointWriter> create_xyz(const std::filesystem::path& path,
                                                      char separator);

}  // namespace gdfmap::io
