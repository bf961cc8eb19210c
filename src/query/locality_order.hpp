#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <gdfmap/core/geometry.hpp>
#include <gdfmap/field/blending.hpp>

namespace gdfmap {

/// Most points that are ordered at a time.
inline constexpr std::size_t kMaxOrdered = std::size_t{1} << 20;

/// Whether a point shares the zone of level 0 of the point before it.
enum class ZoneChange : std::uint8_t { kUnknown, kNone, kOther };

/// A point in an order.
struct OrderedPoint {
  std::uint32_t index;
  ZoneChange zone;
};

/// At most kMaxOrdered points, neighbours in space near each other: in Morton order of their zones
/// of level 0, so that points that share all their cubes come in a row. Points beyond the lattice
/// come anywhere. The order changes no answer, only the time that they take.
[[nodiscard]] std::vector<OrderedPoint> locality_order(std::span<const Vector3> points_world,
                                                       const BlendZones& zones);

}  // namespace gdfmap
