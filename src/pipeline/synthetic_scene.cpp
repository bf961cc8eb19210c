#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/synthetic_scene.hpp>

#include "synthetic/hash_stream.hpp"
#include "synthetic/patch.hpp"
#include "synthetic/patch_tree.hpp"
#include "synthetic/scene_builder.hpp"

namespace gdfmap {
namespace {

using synthetic::HashStream;
using synthetic::Patch;
using synthetic::SceneBuilder;

std::vector<Patch> make_plane(double size, std::uint64_t) {
  SceneBuilder builder;
  builder.rectangle(Vector3::Zero(), {0.5 * size, 0, 0}, {0, 0.5 * size, 0});
  return builder.take();
}

std::vector<Patch> make_sphere(double size, std::uint64_t) {
  SceneBuilder builder;
  builder.sphere(Vector3::Zero(), 0.5 * size);
  return builder.take();
}

std::vector<Patch> make_box(double size, std::uint64_t) {
  SceneBuilder builder;
  builder.box({Vector3(0.0, 0.0, -0.5 * size)}, 0.5 * size, 0.5 * size, size, true);
  return builder.take();
}

struct Recipe {
  SceneInfo info;
  std::vector<Patch> (*make)(double size, std::uint64_t seed);
};

const std::vector<Recipe>& recipes() {
  static const std::vector<Recipe> list = {
      {{"plane", "a square at z = 0", 10.0, 0.1, 100000.0}, make_plane},
      {{"sphere", "a sphere around the origin", 4.0, 0.1, 100000.0}, make_sphere},
      {{"box", "the faces of a cube around the origin", 4.0, 0.1, 100000.0}, make_box},
      {{"room", "a furnished room, 3 m high: tables, shelves, sofas, lamps, balls", 10.0, 4.0,
        1000.0},
       synthetic::make_room},
      {{"city", "blocks of buildings, streets with lamps, trees and cars, parks", 100.0, 50.0,
        5000.0},
       synthetic::make_city}};
  return list;
}

const Recipe& recipe_of(std::string_view name) {
  std::string known;
  for (const Recipe& recipe : recipes()) {
    if (recipe.info.name == name) return recipe;
    known += (known.empty() ? "" : ", ") + recipe.info.name;
  }
  throw Error(ErrorCode::kUsage,
              "unknown scene '" + std::string(name) + "'; the scenes are " + known);
}

std::string metres(double value) {
  std::string text = std::to_string(value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.ends_with('.')) text.pop_back();
  return text + " m";
}

double checked_size(const SceneInfo& info, double size) {
  if (size == 0.0) return info.default_size;
  if (!(size >= info.min_size && size <= info.max_size)) {
    throw Error(ErrorCode::kUsage, "scene '" + info.name + "' can have sizes from " +
                                       metres(info.min_size) + " to " + metres(info.max_size) +
                                       ", not " + metres(size));
  }
  return size;
}

/// One number for a name and a size (FNV-1a, then the bits of the size).
std::uint64_t seed_of(std::string_view name, double size) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return HashStream::mix(hash) ^ std::bit_cast<std::uint64_t>(size);
}

/// Box–Muller.
double standard_normal(HashStream& random) {
  const double radius = std::sqrt(-2.0 * std::log(random.uniform()));
  return radius * std::cos(2.0 * std::numbers::pi * random.uniform());
}

}  // namespace

struct SyntheticScene::Impl {
  /// In the order in which they were built: the tree's own order is the standard library's affair,
  /// and samples must not depend on it.
  std::vector<Patch> patches;
  std::vector<double> cumulative_areas;
  Box3 bounds;
  synthetic::PatchTree tree;

  explicit Impl(std::vector<Patch> list) : patches(std::move(list)), tree(patches) {
    double total = 0.0;
    for (const Patch& patch : patches) {
      cumulative_areas.push_back(total += synthetic::area(patch));
      bounds.extend(synthetic::bounding_box(patch));
    }
  }

  [[nodiscard]] const Patch& patch_at(double fraction_of_area) const {
    const double target = fraction_of_area * cumulative_areas.back();
    const auto found = std::upper_bound(cumulative_areas.begin(), cumulative_areas.end(), target);
    const auto index = static_cast<std::size_t>(found - cumulative_areas.begin());
    return patches[std::min(index, patches.size() - 1)];
  }
};

SyntheticScene::SyntheticScene(std::string_view name, double size) {
  const Recipe& recipe = recipe_of(name);
  size = checked_size(recipe.info, size);
  impl_ = std::make_unique<const Impl>(recipe.make(size, seed_of(name, size)));
}

SyntheticScene::~SyntheticScene() = default;
SyntheticScene::SyntheticScene(SyntheticScene&&) noexcept = default;
SyntheticScene& SyntheticScene::operator=(SyntheticScene&&) noexcept = default;

double SyntheticScene::distance(const Vector3& p_world) const {
  if (!p_world.allFinite()) return std::numeric_limits<double>::quiet_NaN();
  return impl_->tree.distance(p_world);
}

const Box3& SyntheticScene::bounds() const { return impl_->bounds; }

double SyntheticScene::area() const { return impl_->cumulative_areas.back(); }

std::size_t SyntheticScene::num_patches() const { return impl_->patches.size(); }

Vector3 SyntheticScene::sample(std::uint64_t index, std::uint64_t seed, double noise) const {
  HashStream random(seed, index);
  const Patch& patch = impl_->patch_at(random.uniform());
  const double s = random.uniform();
  const auto [position, normal] = synthetic::point_on(patch, s, random.uniform());
  if (noise == 0.0) return position;
  return position + noise * standard_normal(random) * normal;
}

const std::vector<SceneInfo>& scenes() {
  static const std::vector<SceneInfo> list = [] {
    std::vector<SceneInfo> infos;
    for (const Recipe& recipe : recipes()) infos.push_back(recipe.info);
    return infos;
  }();
  return list;
}

}  // namespace gdfmap
