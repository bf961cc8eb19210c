#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "file_reader.hpp"
#include "lzf_stream.hpp"
#include "pcd_header.hpp"
#include "scalar_type.hpp"

namespace gdfmap::io {

/// One column of a compressed PCD: field after field, each with the values of all points.
struct CompressedColumn {
  std::uint64_t begin = 0;  ///< where it starts in the decompressed data
  std::size_t stride = 0;   ///< from one point's value to the next
  ScalarType type = ScalarType::kFloat32;
};

/// PCD binary_compressed. The columns of x, y and z lie far apart in one compressed stream, so a
/// first pass, at the first read(), decompresses all of it and remembers the decoder where each of
/// them starts; then three decoders advance side by side. Memory does not depend on the cloud.
class PcdCompressedReader final : public FileReader {
 public:
  /// The file stands behind the line DATA. `axes`: what find_pcd_coordinates() found.
  /// @throws Error kCorrupt when the sizes that precede the data do not fit, or for a stream.
  PcdCompressedReader(std::unique_ptr<InputFile> file, CloudInfo info, const PcdHeader& header,
                      const std::array<std::size_t, 3>& axes);

  [[nodiscard]] std::size_t read(std::span<Vector3> points) override;

 private:
  /// A decoder with its place in the compressed data and what it has produced ahead.
  struct Cursor {
    LzfDecoder decoder;
    std::uint64_t input_offset = 0;  ///< of the file, where `input` is to be continued
    Bytes input;                     ///< read and not yet decoded from input_used on
    std::size_t input_used = 0;
    Bytes ready;  ///< decoded and not yet used from ready_used on
    std::size_t ready_used = 0;
  };

  void read_sizes();
  void locate_columns(const PcdHeader& header, const std::array<std::size_t, 3>& axes);
  void first_pass();
  void remember_columns(const LzfDecoder& decoder);
  [[nodiscard]] const std::byte* advance(Cursor& cursor, std::size_t bytes);
  void decode_more(Cursor& cursor);
  void refill_input(Cursor& cursor);
  [[noreturn]] void fail_damaged() const;

  std::array<CompressedColumn, 3> columns_;
  std::array<Cursor, 3> cursors_;
  std::uint64_t compressed_begin_ = 0, compressed_end_ = 0;  ///< offsets in the file
  std::uint64_t decompressed_bytes_ = 0;
  bool first_pass_done_ = false;
  std::uint64_t num_done_ = 0;
};

}  // namespace gdfmap::io
