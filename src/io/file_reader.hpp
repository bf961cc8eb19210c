#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <gdfmap/io/point_reader.hpp>

#include "input_file.hpp"

namespace gdfmap::io {

/// What all readers share: the file, its hash, and how to name a place in it.
class FileReader : public PointReader {
 public:
  /// `record` is what messages call a point: "vertex", "point".
  FileReader(std::unique_ptr<InputFile> file, CloudInfo info, std::string record);

  [[nodiscard]] const CloudInfo& info() const final { return info_; }
  [[nodiscard]] std::optional<double> fraction_read() const final;
  [[nodiscard]] Digest identity() final { return file_->finish(); }
  [[nodiscard]] std::uint64_t num_bytes() const final { return file_->num_read(); }

 protected:
  [[nodiscard]] InputFile& file() { return *file_; }
  [[nodiscard]] const InputFile& file() const { return *file_; }

  /// @throws Error kCorrupt "<name>: vertex 17 of 20: <what>"; `index` counts from 0.
  [[noreturn]] void fail_at(std::uint64_t index, const std::string& what) const;

 private:
  std::unique_ptr<InputFile> file_;
  CloudInfo info_;
  std::string record_;
};

}  // namespace gdfmap::io
