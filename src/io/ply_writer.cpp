#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <limits>
#include <system_error>

#include <unistd.h>

#include <gdfmap/core/atomic_file.hpp>
#include <gdfmap/core/bytes.hpp>
#include <gdfmap/core/error.hpp>
#include <gdfmap/io/ply_writer.hpp>

#include "header_count.hpp"

namespace gdfmap {
namespace {

constexpr std::size_t kCopiedBytes = std::size_t{1} << 18;

std::string header_of(const PlyFormat& format) {
  std::string header = "ply\nformat binary_little_endian 1.0\n";
  if (!format.comment.empty()) header += "comment " + format.comment + "\n";
  header += "element vertex " + std::string(io::kCountPlaceholder) + "\n";
  for (const std::string& property : format.properties) header += "property " + property + "\n";
  if (format.has_triangles) {
    header += "element face " + std::string(io::kCountPlaceholder) +
              "\nproperty list uchar int vertex_indices\n";
  }
  return header + "end_header\n";
}

/// Bytes that nobody else sees: the file has no name once it is open, so that nothing of it is left
/// whatever ends the program.
class NamelessFile {
 public:
  /// @param beside  whose disk it uses
  explicit NamelessFile(const std::filesystem::path& beside)
      : path_(beside.string() + ".triangles"), file_(std::fopen(path_.c_str(), "w+b")) {
    if (file_ == nullptr) fail("cannot create");
    ::unlink(path_.c_str());
  }
  ~NamelessFile() { std::fclose(file_); }
  NamelessFile(const NamelessFile&) = delete;
  NamelessFile& operator=(const NamelessFile&) = delete;

  void write(std::span<const std::byte> bytes) {
    if (bytes.empty()) return;  // fwrite wants a place to read from all the same
    if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) fail("cannot write");
  }
  void append_to(AtomicFile& out) {
    if (std::fflush(file_) != 0) fail("cannot write");
    std::rewind(file_);
    Bytes part(kCopiedBytes);
    while (const std::size_t count = std::fread(part.data(), 1, part.size(), file_)) {
      out.write(std::span<const std::byte>(part.data(), count));
    }
    if (std::ferror(file_) != 0) fail("cannot read");
  }

 private:
  [[noreturn]] void fail(const char* action) const {
    throw Error(ErrorCode::kIo,
                std::string(action) + " " + path_ + ": " + std::generic_category().message(errno));
  }

  std::string path_;
  std::FILE* file_;
};

}  // namespace

struct PlyWriter::Impl {
  AtomicFile file;
  std::vector<std::uint64_t> count_offsets;
  std::unique_ptr<NamelessFile> triangles;
  std::uint64_t num_vertices = 0, num_triangles = 0;

  Impl(const std::filesystem::path& path, const PlyFormat& format) : file(path) {
    const std::string header = header_of(format);
    count_offsets = io::find_placeholders(header);
    file.write(std::string_view(header));
    if (format.has_triangles) triangles = std::make_unique<NamelessFile>(file.temporary_path());
  }
};

PlyWriter::PlyWriter(const std::filesystem::path& path, const PlyFormat& format)
    : impl_(std::make_unique<Impl>(path, format)) {}
PlyWriter::~PlyWriter() = default;
PlyWriter::PlyWriter(PlyWriter&&) noexcept = default;
PlyWriter& PlyWriter::operator=(PlyWriter&&) noexcept = default;

void PlyWriter::write_vertices(std::span<const std::byte> records, std::uint64_t count) {
  impl_->file.write(records);
  impl_->num_vertices += count;
}

void PlyWriter::write_triangles(std::span<const std::array<std::uint64_t, 3>> triangles) {
  constexpr auto kMaxIndex = std::numeric_limits<std::int32_t>::max();
  ByteWriter writer;
  for (const auto& triangle : triangles) {
    writer.put(std::uint8_t{3});
    for (const std::uint64_t index : triangle) {
      if (index > static_cast<std::uint64_t>(kMaxIndex)) {
        throw Error(ErrorCode::kUsage,
                    "more than 2^31 vertices do not fit a PLY file of triangles");
      }
      writer.put(static_cast<std::int32_t>(index));
    }
  }
  impl_->triangles->write(writer.bytes());
  impl_->num_triangles += triangles.size();
}

void PlyWriter::finish() {
  if (impl_->triangles) {
    impl_->triangles->append_to(impl_->file);
    io::write_count(impl_->file, impl_->count_offsets[1], impl_->num_triangles);
  }
  io::write_count(impl_->file, impl_->count_offsets[0], impl_->num_vertices);
  impl_->file.commit();
}

}  // namespace gdfmap
