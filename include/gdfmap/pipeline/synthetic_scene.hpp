#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <gdfmap/core/geometry.hpp>

namespace gdfmap {

/// An analytic scene: a union of surface patches (rectangles, cylinders, cones, discs, spheres)
/// whose geometry depends on its name and size alone, on every machine. It is centred on the origin
/// along x and y; larger means more objects, not larger ones. Patches under or inside others are
/// sampled and measured like all. Immutable and thread-safe.
class SyntheticScene {
 public:
  /// @param name  one of scenes()
  /// @param size  extent along x and y in metres; 0: the scene's default
  /// @throws Error kUsage for an unknown name (naming the known ones) or a size it cannot have.
  explicit SyntheticScene(std::string_view name, double size = 0.0);
  ~SyntheticScene();
  SyntheticScene(SyntheticScene&&) noexcept;
  SyntheticScene& operator=(SyntheticScene&&) noexcept;

  /// Exact unsigned distance (metres) from a world point to the nearest surface patch; not-a-number
  /// for a point that is not finite.
  [[nodiscard]] double distance(const Vector3& p_world) const;

  [[nodiscard]] const Box3& bounds() const;
  [[nodiscard]] double area() const;  ///< m², of all patches
  [[nodiscard]] std::size_t num_patches() const;

  /// Point `index` of `seed`'s endless sequence of surface points, uniform by area, displaced along
  /// the surface normal by `noise` (standard deviation, metres). A pure function: any part of the
  /// sequence can be made on its own.
  [[nodiscard]] Vector3 sample(std::uint64_t index, std::uint64_t seed, double noise) const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

struct SceneInfo {
  std::string name;
  std::string description;    ///< one line
  double default_size;        ///< metres
  double min_size, max_size;  ///< metres
};
[[nodiscard]] const std::vector<SceneInfo>& scenes();

}  // namespace gdfmap
