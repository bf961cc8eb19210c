#include <gdfmap/core/atomic_file.hpp>
#include <gdfmap/core/bytes.hpp>
#include <gdfmap/pipeline/npy.hpp>

namespace gdfmap {
namespace {

/// Magic, version 1.0, header length, a Python dictionary padded so that the data are aligned.
std::string header_of(const std::vector<std::size_t>& shape, const char* type) {
  constexpr std::size_t kAlignment = 64;
  std::string lengths;
  for (const std::size_t length : shape) lengths += std::to_string(length) + ",";
  std::string header = "{'descr': '" + std::string(type) + "', 'fortran_order': False, 'shape': (" +
                       lengths + "), }";
  const std::string magic("\x93NUMPY\x01\x00", 8);
  const std::size_t unpadded = magic.size() + 2 + header.size() + 1;
  header.append((kAlignment - unpadded % kAlignment) % kAlignment, ' ');
  header += '\n';
  const auto length = static_cast<std::uint16_t>(header.size());
  return magic + static_cast<char>(length & 0xff) + static_cast<char>(length >> 8) + header;
}

template <typename Number>
std::string bytes_of(std::span<const Number> values, const std::vector<std::size_t>& shape,
                     const char* type) {
  ByteWriter writer;
  for (const Number value : values) writer.put(value);
  const auto body = writer.bytes();
  return header_of(shape, type) +
         std::string(reinterpret_cast<const char*>(body.data()), body.size());
}

}  // namespace

std::string npy_bytes(std::span<const float> values, const std::vector<std::size_t>& shape) {
  return bytes_of(values, shape, "<f4");
}

std::string npy_bytes(std::span<const double> values, const std::vector<std::size_t>& shape) {
  return bytes_of(values, shape, "<f8");
}

std::string npy_header_float64(const std::vector<std::size_t>& shape) {
  return header_of(shape, "<f8");
}

void write_npy(const std::filesystem::path& path, std::span<const float> values,
               const std::vector<std::size_t>& shape) {
  AtomicFile file(path);
  file.write(std::string_view(npy_bytes(values, shape)));
  file.commit();
}

}  // namespace gdfmap
