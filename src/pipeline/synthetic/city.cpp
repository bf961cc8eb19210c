#include <cmath>

#include "scene_builder.hpp"

namespace gdfmap::synthetic {
namespace {

constexpr double kPitch = 50.0;      ///< from one block's centre to the next
constexpr double kHalfBlock = 18.0;  ///< what is built on; streets take the rest
constexpr double kStorey = 3.0;

void add_balconies(SceneBuilder& builder, const Pose& pose, double half_y, double height) {
  for (double z = kStorey; z + kStorey <= height; z += kStorey) {
    const Pose slab = pose.at(0, -half_y - 0.6, z);
    builder.box(slab, 1.5, 0.6, 0.15, true);
    builder.box(slab.at(0, -0.57, 0.15), 1.5, 0.03, 1.0);
  }
}

void add_slab_building(SceneBuilder& builder, const Pose& pose, HashStream& random) {
  const double half_x = random.uniform(5.0, 7.5), half_y = random.uniform(4.5, 6.5);
  const double height = kStorey * std::floor(random.uniform(2.0, 9.0));
  builder.box(pose, half_x, half_y, height);
  // Drawn one by one: compilers order the arguments of a call differently.
  const double roof_y = random.uniform(-1.5, 1.5);
  const Pose roof = pose.at(random.uniform(-2.0, 2.0), roof_y, height);
  builder.box(roof, 1.5, 1.2, random.uniform(1.5, 2.8));
  if (random.chance(0.35)) add_balconies(builder, pose, half_y, height);
}

void add_l_building(SceneBuilder& builder, const Pose& pose, HashStream& random) {
  const double height = kStorey * std::floor(random.uniform(2.0, 5.0));
  builder.box(pose.at(0, 4.0, 0), 7.5, 3.0, height);
  builder.box(pose.at(-4.5, -3.25, 0), 3.0, 4.25, height - random.uniform(0.5, 2.5));
}

void add_setback_tower(SceneBuilder& builder, const Pose& pose, HashStream& random) {
  double half = random.uniform(6.0, 7.5), base = 0.0;
  const double step_height = kStorey * std::floor(random.uniform(2.0, 5.0));
  for (int step = 0; step < 3; ++step) {
    builder.box(pose.at(0, 0, base), half, half, step_height);
    base += step_height;
    half *= 0.7;
  }
  builder.post(pose.at(0, 0, base).position, 0.1, 5.0);
}

void add_round_tower(SceneBuilder& builder, const Pose& pose, HashStream& random) {
  const double radius = random.uniform(4.0, 6.5), height = random.uniform(9.0, 27.0);
  builder.frustum(pose.position, radius, radius, height);
  const Vector3 top = pose.at(0, 0, height).position;
  if (random.chance(0.5)) {
    builder.frustum(top, radius + 0.4, 0.0, 0.7 * radius);
  } else {
    builder.disc(top, radius);
  }
}

void add_building(SceneBuilder& builder, const Vector3& centre, HashStream& random) {
  Pose pose{centre};
  if (random.chance(0.5)) pose = pose.quarter_turned();
  pose = pose.turned(random.chance(0.3) ? random.uniform(-0.09, 0.09) : 0.0);
  const double choice = random.uniform();
  if (choice < 0.5) {
    add_slab_building(builder, pose, random);
  } else if (choice < 0.7) {
    add_l_building(builder, pose, random);
  } else if (choice < 0.85) {
    add_setback_tower(builder, pose, random);
  } else {
    add_round_tower(builder, pose, random);
  }
}

void add_tree(SceneBuilder& builder, const Vector3& base, HashStream& random) {
  const double crown = random.uniform(1.2, 2.2), trunk = random.uniform(2.0, 3.2);
  builder.frustum(base, 0.22, 0.14, trunk);
  builder.sphere(base + Vector3(0, 0, trunk + 0.9 * crown), crown);
}

void add_street_lamp(SceneBuilder& builder, const Vector3& base) {
  constexpr double kHeight = 6.0;
  builder.frustum(base, 0.09, 0.06, kHeight);
  builder.sphere(base + Vector3(0, 0, kHeight + 0.2), 0.22);
}

void add_car(SceneBuilder& builder, const Pose& pose, HashStream& random) {
  const double half_length = random.uniform(1.9, 2.4);
  builder.box(pose.at(0, 0, 0.25), half_length, 0.9, 0.65, true);
  builder.box(pose.at(-0.2, 0, 0.9), 0.55 * half_length, 0.8, random.uniform(0.5, 0.65));
}

void add_park(SceneBuilder& builder, const Vector3& centre, HashStream& random) {
  constexpr int kTreesPerSide = 4;
  constexpr double kSpacing = 2.0 * kHalfBlock / kTreesPerSide;
  for (int j = 0; j < kTreesPerSide; ++j) {
    for (int i = 0; i < kTreesPerSide; ++i) {
      const double x = (i + 0.5) * kSpacing - kHalfBlock + random.uniform(-2.0, 2.0);
      const double y = (j + 0.5) * kSpacing - kHalfBlock + random.uniform(-2.0, 2.0);
      add_tree(builder, centre + Vector3(x, y, 0), random);
    }
  }
  constexpr double kRoof = 2.8;
  for (const double x : {-1.6, 1.6}) {
    for (const double y : {-1.6, 1.6}) {
      builder.frustum(centre + Vector3(x, y, 0), 0.12, 0.12, kRoof);
    }
  }
  builder.frustum(centre + Vector3(0, 0, kRoof), 3.0, 0.0, 1.6);
}

/// Lamps, trees and parked cars along one side of a block; the pose looks along the street.
void add_kerb(SceneBuilder& builder, const Pose& side, HashStream& random) {
  for (const double x : {-12.0, 12.0}) {
    add_street_lamp(builder, side.at(x, 0, 0).position);
    if (random.chance(0.7)) add_tree(builder, side.at(x - 5.0, 0, 0).position, random);
    if (random.chance(0.6)) {
      const Pose place = side.at(x + random.uniform(-3.0, 3.0), -2.2, 0);
      add_car(builder, place.turned(random.uniform(-0.03, 0.03)), random);
    }
  }
}

void add_block(SceneBuilder& builder, const Vector3& centre, HashStream& random) {
  if (random.chance(0.15)) {
    add_park(builder, centre, random);
  } else {
    constexpr double kHalfLot = 0.5 * kHalfBlock;
    for (const double x : {-kHalfLot, kHalfLot}) {
      for (const double y : {-kHalfLot, kHalfLot}) {
        add_building(builder, centre + Vector3(x, y, 0), random);
      }
    }
  }
  Pose pose{centre};
  for (int side = 0; side < 4; ++side) {
    add_kerb(builder, pose.at(0, -kHalfBlock - 2.0, 0), random);
    pose = pose.quarter_turned();
  }
}

}  // namespace

std::vector<Patch> make_city(double size, std::uint64_t seed) {
  SceneBuilder builder;
  builder.rectangle(Vector3::Zero(), {0.5 * size, 0, 0}, {0, 0.5 * size, 0});
  const auto num_blocks = static_cast<int>(std::floor(size / kPitch));
  const double first = -0.5 * (num_blocks - 1) * kPitch;
  for (int j = 0; j < num_blocks; ++j) {
    for (int i = 0; i < num_blocks; ++i) {
      HashStream random(seed, static_cast<std::uint64_t>(j * num_blocks + i));
      add_block(builder, {first + i * kPitch, first + j * kPitch, 0.0}, random);
    }
  }
  return builder.take();
}

}  // namespace gdfmap::synthetic
