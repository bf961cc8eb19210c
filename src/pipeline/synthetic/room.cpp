#include <cmath>

#include "scene_builder.hpp"

namespace gdfmap::synthetic {
namespace {

constexpr double kRoomHeight = 3.0;
constexpr double kCell = 2.5;     ///< every piece of furniture has a cell of this edge
constexpr double kWallGap = 0.5;  ///< between the walls and the outermost cells, at least
constexpr double kJitter = 0.15;  ///< of a piece's place in its cell

void add_shell(SceneBuilder& builder, double size) {
  const double half = 0.5 * size;
  const Vector3 x(half, 0, 0), y(0, half, 0), z(0, 0, 0.5 * kRoomHeight);
  builder.rectangle(Vector3::Zero(), x, y);
  builder.rectangle(2.0 * z, y, x);
  builder.rectangle(z + x, z, y);
  builder.rectangle(z - x, y, z);
  builder.rectangle(z + y, x, z);
  builder.rectangle(z - y, z, x);
}

void add_table(SceneBuilder& builder, const Pose& pose, HashStream& random) {
  constexpr double kHalfX = 0.7, kHalfY = 0.4, kTop = 0.76, kThickness = 0.04, kLeg = 0.03;
  builder.box(pose.at(0, 0, kTop - kThickness), kHalfX, kHalfY, kThickness, true);
  for (const double x : {-kHalfX + 0.08, kHalfX - 0.08}) {
    for (const double y : {-kHalfY + 0.08, kHalfY - 0.08}) {
      builder.box(pose.at(x, y, 0), kLeg, kLeg, kTop - kThickness);
    }
  }
  // Drawn one by one: compilers order the arguments of a call differently.
  const double thing_y = random.uniform(-0.15, 0.15);
  const Pose thing = pose.at(random.uniform(-0.4, 0.4), thing_y, kTop);
  if (random.chance(0.5)) {
    const double radius = random.uniform(0.08, 0.15);
    builder.sphere(thing.at(0, 0, radius).position, radius);
  } else {
    const double height = random.uniform(0.1, 0.35);
    builder.box(thing.turned(random.uniform(-1, 1)), 0.2, 0.12, height);
  }
}

void add_shelf(SceneBuilder& builder, const Pose& pose) {
  constexpr double kHalfX = 0.6, kHalfY = 0.2, kHeight = 1.9, kHalfPanel = 0.0125;
  constexpr int kNumBoards = 5;
  for (const double x : {-kHalfX, kHalfX}) {
    builder.box(pose.at(x, 0, 0), kHalfPanel, kHalfY, kHeight);
  }
  builder.box(pose.at(0, kHalfY, 0), kHalfX, kHalfPanel, kHeight);
  for (int i = 0; i < kNumBoards; ++i) {
    const double z = 0.1 + i * (kHeight - 0.15) / (kNumBoards - 1);
    builder.box(pose.at(0, 0, z), kHalfX, kHalfY, 2.0 * kHalfPanel, true);
  }
}

void add_floor_lamp(SceneBuilder& builder, const Pose& pose) {
  builder.post(pose.position, 0.18, 0.03);
  builder.frustum(pose.position, 0.02, 0.02, 1.5);
  builder.frustum(pose.at(0, 0, 1.4).position, 0.25, 0.14, 0.3);
}

void add_sofa(SceneBuilder& builder, const Pose& pose) {
  builder.box(pose, 0.8, 0.4, 0.42);
  builder.box(pose.at(0, 0.5, 0), 0.95, 0.1, 0.85);
  for (const double x : {-0.875, 0.875}) builder.box(pose.at(x, 0, 0), 0.075, 0.4, 0.6);
}

void add_ball(SceneBuilder& builder, const Pose& pose, HashStream& random) {
  const double radius = random.uniform(0.2, 0.45);
  builder.sphere(pose.at(0, 0, radius).position, radius);
}

void add_pendant(SceneBuilder& builder, const Vector3& centre) {
  constexpr double kDrop = 0.7, kRadius = 0.15;
  builder.frustum(centre + Vector3(0, 0, kRoomHeight - kDrop), 0.01, 0.01, kDrop);
  builder.sphere(centre + Vector3(0, 0, kRoomHeight - kDrop - kRadius), kRadius);
}

void furnish(SceneBuilder& builder, const Vector3& centre, HashStream& random) {
  const double y = random.uniform(-kJitter, kJitter);
  Pose pose{centre + Vector3(random.uniform(-kJitter, kJitter), y, 0.0)};
  if (random.chance(0.5)) pose = pose.quarter_turned();
  pose = pose.turned(random.chance(0.4) ? random.uniform(-0.4, 0.4) : 0.0);
  const double choice = random.uniform();
  if (choice < 0.35) {
    add_table(builder, pose, random);
  } else if (choice < 0.6) {
    add_shelf(builder, pose);
  } else if (choice < 0.75) {
    add_floor_lamp(builder, pose);
  } else if (choice < 0.9) {
    add_sofa(builder, pose);
  } else {
    add_ball(builder, pose, random);
  }
  if (random.chance(0.25)) add_pendant(builder, centre);
}

}  // namespace

std::vector<Patch> make_room(double size, std::uint64_t seed) {
  SceneBuilder builder;
  add_shell(builder, size);
  const auto num_cells = static_cast<int>(std::floor((size - 2.0 * kWallGap) / kCell));
  const double first = -0.5 * (num_cells - 1) * kCell;
  for (int j = 0; j < num_cells; ++j) {
    for (int i = 0; i < num_cells; ++i) {
      HashStream random(seed, static_cast<std::uint64_t>(j * num_cells + i));
      furnish(builder, {first + i * kCell, first + j * kCell, 0.0}, random);
    }
  }
  return builder.take();
}

}  // namespace gdfmap::synthetic
