#include "input_file.hpp"

#include <algorithm>
#include <cerrno>
#include <system_error>

#include <gdfmap/core/error.hpp>

namespace gdfmap::gdf1 {
namespace {

/// Thirteen numbers fit many times over.
constexpr std::size_t kMaxLineBytes = 4096;

}  // namespace

InputFile::InputFile(std::filesystem::path path) : path_(std::move(path)) {
  std::error_code error;
  const auto status = std::filesystem::status(path_, error);
  if (error) throw Error(ErrorCode::kIo, "cannot open " + path_.string() + ": " + error.message());
  if (!std::filesystem::is_regular_file(status)) {
    throw Error(ErrorCode::kIo, "cannot open " + path_.string() + ": not a regular file");
  }
  remaining_ = std::filesystem::file_size(path_, error);
  file_.reset(std::fopen(path_.c_str(), "rb"));
  if (error || file_ == nullptr) {
    throw Error(ErrorCode::kIo,
                "cannot open " + path_.string() + ": " + std::generic_category().message(errno));
  }
}

void InputFile::read(std::span<std::byte> bytes, const std::string& place) {
  if (bytes.size() > remaining_) {
    throw Error(ErrorCode::kCorrupt, path_.string() + ": " + place + ": file ends");
  }
  if (std::fread(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size()) fail_reading();
  remaining_ -= bytes.size();
}

void InputFile::skip(std::uint64_t num_bytes) {
  num_bytes = std::min(num_bytes, remaining_);
  if (::fseeko(file_.get(), static_cast<off_t>(num_bytes), SEEK_CUR) != 0) fail_reading();
  remaining_ -= num_bytes;
}

bool InputFile::read_line(std::string_view& line) {
  line_.clear();
  int c = ::getc_unlocked(file_.get());
  if (c == EOF && std::ferror(file_.get()) != 0) fail_reading();
  if (c == EOF) return false;
  ++line_number_;
  for (; c != EOF && c != '\n'; c = ::getc_unlocked(file_.get())) {
    if (line_.size() == kMaxLineBytes) {
      throw Error(ErrorCode::kCorrupt, path_.string() + ": line " + std::to_string(line_number_) +
                                           ": too long for a row of a model");
    }
    line_.push_back(static_cast<char>(c));
  }
  if (std::ferror(file_.get()) != 0) fail_reading();
  line = line_;
  if (line.ends_with('\r')) line.remove_suffix(1);
  return true;
}

void InputFile::fail_reading() const {
  const std::string reason = std::feof(file_.get()) != 0 ? "it became shorter while it was read"
                                                         : std::generic_category().message(errno);
  throw Error(ErrorCode::kIo, "cannot read " + path_.string() + ": " + reason);
}

}  // namespace gdfmap::gdf1
