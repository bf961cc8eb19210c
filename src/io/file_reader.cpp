#include "file_reader.hpp"

#include <utility>

namespace gdfmap::io {

FileReader::FileReader(std::unique_ptr<InputFile> file, CloudInfo info, std::string record)
    : file_(std::move(file)), info_(std::move(info)), record_(std::move(record)) {}

std::optional<double> FileReader::fraction_read() const {
  const auto left = file_->bytes_left();
  if (!left) return std::nullopt;
  const auto done = static_cast<double>(file_->position());
  const double all = done + static_cast<double>(*left);
  return all > 0.0 ? done / all : 1.0;
}

void FileReader::fail_at(std::uint64_t index, const std::string& what) const {
  const std::string total =
      info_.num_points ? " of " + std::to_string(*info_.num_points) : std::string();
  file_->fail(record_ + " " + std::to_string(index + 1) + total + ": " + what);
}

}  // namespace gdfmap::io
