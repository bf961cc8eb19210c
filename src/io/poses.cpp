#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>

#include <gdfmap/core/error.hpp>
#include <gdfmap/core/rigid_transform.hpp>
#include <gdfmap/io/poses.hpp>

#include "input_file.hpp"
#include "text.hpp"

namespace gdfmap {
namespace {

constexpr std::size_t kKittiColumns = 12;
constexpr std::size_t kTumColumns = 8;

class PoseParser {
 public:
  explicit PoseParser(const std::filesystem::path& path) : file_(path) {}

  std::vector<Eigen::Isometry3d> parse() {
    std::vector<Eigen::Isometry3d> poses;
    while (const auto line = io::next_line(file_)) {
      ++line_number_;
      std::string_view rest = *line;
      const std::string_view first = io::next_word(rest);
      if (first.empty() || first.front() == '#') continue;
      poses.push_back(parse_pose(*line));
    }
    if (poses.empty()) throw Error(ErrorCode::kUsage, file_.name() + ": it holds no poses");
    return poses;
  }

 private:
  Eigen::Isometry3d parse_pose(std::string_view line) {
    const std::size_t columns = parse_numbers(line);
    if (columns != kKittiColumns && columns != kTumColumns) {
      fail("it has " + std::to_string(columns) +
           " columns; 12 (a matrix of three rows, as KITTI has it) or 8 (time, x, y, z, qx, qy, "
           "qz, qw, as TUM has it) are expected");
    }
    if (num_columns_.value_or(columns) != columns) {
      fail("it has " + std::to_string(columns) + " columns, the lines before it have " +
           std::to_string(*num_columns_));
    }
    num_columns_ = columns;
    return columns == kKittiColumns ? kitti_pose() : tum_pose();
  }

  /// Fills numbers_ and returns how many columns the line has.
  std::size_t parse_numbers(std::string_view line) {
    std::size_t count = 0;
    for (auto word = io::next_word(line); !word.empty(); word = io::next_word(line)) {
      const auto number = io::parse_number(word);
      if (!number || !std::isfinite(*number)) {
        fail(io::in_quotes(word) + " is not a finite number");
      }
      if (count < numbers_.size()) numbers_[count] = *number;
      ++count;
    }
    return count;
  }

  [[nodiscard]] Eigen::Isometry3d kitti_pose() const {
    const Matrix34 matrix =
        Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(numbers_.data());
    const auto pose = rigid_transform(matrix);
    if (!pose) fail("the left 3 x 3 of its matrix is not a rotation");
    return *pose;
  }

  [[nodiscard]] Eigen::Isometry3d tum_pose() const {
    const auto& n = numbers_;
    const Eigen::Quaterniond rotation(n[7], n[4], n[5], n[6]);
    const auto pose = rigid_transform({n[1], n[2], n[3]}, rotation);
    if (!pose) fail("its quaternion has length " + std::to_string(rotation.norm()) + ", not 1");
    return *pose;
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(ErrorCode::kUsage,
                file_.name() + ": line " + std::to_string(line_number_) + ": " + what);
  }

  io::InputFile file_;
  std::uint64_t line_number_ = 0;
  std::optional<std::size_t> num_columns_;
  std::array<double, kKittiColumns> numbers_{};
};

}  // namespace

std::vector<Eigen::Isometry3d> read_poses(const std::filesystem::path& path) {
  return PoseParser(path).parse();
}

}  // namespace gdfmap
