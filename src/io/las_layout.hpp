#pragma once

#include <cstddef>
#include <cstdint>

/// Where the fields of a LAS file are (ASPRS LAS specification 1.0 to 1.4), in bytes.
namespace gdfmap::io::las {

// The public header block.
inline constexpr std::size_t kGlobalEncodingAt = 6;
inline constexpr std::size_t kVersionMajorAt = 24;
inline constexpr std::size_t kVersionMinorAt = 25;
inline constexpr std::size_t kSystemAt = 26;
inline constexpr std::size_t kSoftwareAt = 58;
inline constexpr std::size_t kHeaderBytesAt = 94;
inline constexpr std::size_t kPointsOffsetAt = 96;
inline constexpr std::size_t kFormatAt = 104;
inline constexpr std::size_t kRecordBytesAt = 105;
inline constexpr std::size_t kLegacyCountAt = 107;
inline constexpr std::size_t kScaleAt = 131;
inline constexpr std::size_t kOffsetAt = 155;
inline constexpr std::size_t kBoundsAt = 179;         ///< max x, min x, max y, min y, max z, min z
inline constexpr std::size_t kCountAt = 247;          ///< from 1.4 on
inline constexpr std::size_t kCountByReturnAt = 255;  ///< from 1.4 on
inline constexpr std::size_t kHeaderBytes = 227;      ///< of 1.0 to 1.2, the least of any version
inline constexpr std::size_t kHeaderBytesV14 = 375;

// A point record. Byte 15 holds the withheld flag of every format, in different places: bit 7 of
// the classification up to format 5, bit 2 of the classification flags from format 6 on.
inline constexpr std::size_t kReturnsAt = 14;
inline constexpr std::size_t kFlagsAt = 15;
inline constexpr std::uint8_t kWithheld = 1 << 7;
inline constexpr std::uint8_t kWithheldExtended = 1 << 2;
inline constexpr int kFirstExtendedFormat = 6;

}  // namespace gdfmap::io::las
