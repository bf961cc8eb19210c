#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "file_reader.hpp"
#include "scalar_type.hpp"

namespace gdfmap::io {

/// Where a coordinate lies in a binary record.
struct ScalarField {
  std::size_t offset = 0;
  ScalarType type = ScalarType::kFloat32;
};

/// Binary records of one size. stride ≤ InputFile::kMaxPeekBytes.
struct RecordLayout {
  std::size_t stride = 0;
  std::array<ScalarField, 3> xyz;
  std::endian order = std::endian::little;
};

/// Binary PLY without lists in its vertices, and binary PCD: records of one size that begin where
/// the file stands. `info` declares their number.
class FixedRecordReader final : public FileReader {
 public:
  /// @throws Error kCorrupt when the file is too short for them.
  FixedRecordReader(std::unique_ptr<InputFile> file, CloudInfo info, std::string record,
                    const RecordLayout& layout);

  [[nodiscard]] std::size_t read(std::span<Vector3> points) override;

 private:
  RecordLayout layout_;
  std::uint64_t num_done_ = 0;
};

}  // namespace gdfmap::io
