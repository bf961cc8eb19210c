#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "file_reader.hpp"

namespace gdfmap::io {

/// What the next word, or words, of a row are.
struct AsciiColumn {
  int axis = -1;         ///< 0, 1, 2: a coordinate; -1: something else
  bool is_list = false;  ///< a count and as many values
};

/// ASCII PLY and PCD: a record a line, words between white space; blank lines count for nothing.
/// `info` declares the number of records.
class AsciiRecordReader final : public FileReader {
 public:
  /// @throws Error kCorrupt when the file is too short for the declared records.
  AsciiRecordReader(std::unique_ptr<InputFile> file, CloudInfo info, std::string record,
                    std::vector<AsciiColumn> columns);

  [[nodiscard]] std::size_t read(std::span<Vector3> points) override;

 private:
  [[nodiscard]] Vector3 parse(std::string_view line) const;
  [[nodiscard]] std::string_view word(std::string_view& rest) const;
  void skip_list(std::string_view count, std::string_view& rest) const;

  std::vector<AsciiColumn> columns_;
  std::uint64_t num_done_ = 0;
};

}  // namespace gdfmap::io
