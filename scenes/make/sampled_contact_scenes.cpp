/// Sampled scenes of contacts: what stands, stands under a weight, rolls, slides.

#include <vector>

#include "sampling.h"
#include "scenes.h"
#include "sim/math/rotation.h"

namespace substep::make {
namespace {

void add_box(GltfBuilder& gltf, const std::string& name, const Vector3& size, const Pose& pose,
             const Motion& motion, double friction, const Finish& look) {
  const SampledBody body = add_body(gltf, name, size, pose, motion, look);
  gltf.collider(body.node, gltf.box_shape(size), gltf.physics_material(friction));
}

/// Of the ground and of what stands on it.
double add_rough_ground(GltfBuilder& gltf, Sampler& sample) {
  const double friction = sample.uniform(0.4, 0.9);
  add_ground(gltf, friction);
  return friction;
}

/// Boxes one on the other, a little out of line and turned.
void add_column(GltfBuilder& gltf, Sampler& sample, double friction) {
  const int count = sample.whole(2, 12);
  const double width = sample.mostly_small(0.2, 1.5);
  double height = 0;
  for (int i = 0; i < count; ++i) {
    const Vector3 size{width * sample.uniform(0.8, 1.2), width * sample.uniform(0.4, 1),
                       width * sample.uniform(0.8, 1.2)};
    const double x = width * sample.uniform(-0.05, 0.05);
    const double z = width * sample.uniform(-0.05, 0.05);
    const double angle = sample.uniform(-0.3, 0.3);
    const double mass = sample.uniform(0.5, 5);
    add_box(gltf, "box_" + std::to_string(i + 1), size,
            at(x, height + size.y() / 2, z) * turn(Vector3::UnitY(), angle), {.mass = mass}, friction,
            sampled_finish(i));
    height += size.y();
  }
  light_and_camera(gltf, {0, height / 2, 0}, height / 2 + width);
}

/// Two pillars and a beam, on which two pillars and a beam stand.
void add_portals(GltfBuilder& gltf, Sampler& sample, double friction) {
  const int count = sample.whole(1, 4);
  const double width = sample.mostly_small(0.2, 1);
  const double gap = width * sample.uniform(1.5, 4);
  double height = 0;
  for (int i = 0; i < count; ++i) {
    const std::string number = std::to_string(i + 1);
    const double pillar = width * sample.uniform(0.5, 2.5);
    const double mass = sample.uniform(0.5, 5);
    for (const int side : {-1, 1}) {
      add_box(gltf, (side < 0 ? "left_" : "right_") + number, {width, pillar, width},
              at(side * gap / 2, height + pillar / 2, 0), {.mass = mass}, friction, sampled_finish(3 * i));
    }
    const double beam = width * sample.uniform(0.2, 0.8);
    height += pillar + beam;
    add_box(gltf, "beam_" + number, {gap + width * 1.2, beam, width}, at(0, height - beam / 2, 0),
            {.mass = mass * sample.uniform(0.5, 3)}, friction, sampled_finish(3 * i + 1));
  }
  light_and_camera(gltf, {0, height / 2, 0}, height / 2 + gap);
}

/// Rows of boxes, each on two of the row below.
void add_pyramid(GltfBuilder& gltf, Sampler& sample, double friction) {
  const int rows = sample.whole(2, 6);
  const Vector3 size{sample.uniform(0.2, 1), sample.uniform(0.2, 0.6), sample.uniform(0.2, 1)};
  const double pitch = size.x() * sample.uniform(1.05, 1.5);
  for (int row = 0; row < rows; ++row) {
    for (int i = 0; i < rows - row; ++i) {
      const double mass = sample.uniform(0.5, 5);
      add_box(gltf, "box_" + std::to_string(row + 1) + "_" + std::to_string(i + 1), size,
              at(pitch * (i - (rows - row - 1) / 2.0), size.y() * (row + 0.5), 0), {.mass = mass}, friction,
              sampled_finish(row + i));
    }
  }
  light_and_camera(gltf, {0, size.y() * rows / 2, 0}, pitch * rows * 0.7);
}

/// A board whose upper face goes through the origin, leaning about Z and turned: its frame.
Pose add_slope(GltfBuilder& gltf, Sampler& sample, double steepest, double friction) {
  const Pose turned = turn(Vector3::UnitY(), sample.uniform(-1, 1));
  const Pose frame = turned * turn(Vector3::UnitZ(), -sample.uniform(0, steepest));
  const double length = 8;
  const double thickness = 0.2;
  const Pose middle = frame * at(length / 4, -thickness / 2, 0);
  add_fixed_box(gltf, "slope", {length, thickness, length / 2},
                {middle.position + Vector3(0, 3, 0), middle.orientation}, gltf.physics_material(friction),
                finish::maple);
  return {Vector3(0, 3, 0), frame.orientation};
}

}  // namespace

std::string stacked(int number) {
  SampledScene scene("stacked", number);
  auto& [sample, gltf] = scene;
  const double friction = add_rough_ground(gltf, sample);
  if (number % 3 == 1) {
    add_column(gltf, sample, friction);
  } else if (number % 3 == 2) {
    add_portals(gltf, sample, friction);
  } else {
    add_pyramid(gltf, sample, friction);
  }
  return gltf.text();
}

std::string loaded(int number) {
  SampledScene scene("loaded", number);
  auto& [sample, gltf] = scene;
  const double friction = add_rough_ground(gltf, sample);
  const int count = sample.whole(1, 5);
  const double width = sample.mostly_small(0.2, 1.5);
  const double mass = sample.uniform(0.5, 5);
  const double ratio = sample.uniform(100, 1000);
  double height = 0;
  for (int i = 0; i <= count; ++i) {
    const Vector3 size{width, width * sample.uniform(0.4, 1), width};
    add_box(gltf, i == count ? "load" : "box_" + std::to_string(i + 1), size,
            at(0, height + size.y() / 2, 0) * turn(Vector3::UnitY(), sample.uniform(-0.3, 0.3)),
            {.mass = i == count ? mass * ratio : mass}, friction, sampled_finish(i));
    height += size.y();
  }
  light_and_camera(gltf, {0, height / 2, 0}, height / 2 + width);
  return gltf.text();
}

std::string rolling(int number) {
  SampledScene scene("rolling", number);
  auto& [sample, gltf] = scene;
  const double friction = sample.uniform(0.2, 0.9);
  const Pose slope = add_slope(gltf, sample, 0.25, friction);
  const int count = sample.whole(1, 4);
  for (int i = 0; i < count; ++i) {
    const double radius = sample.mostly_small(0.08, 0.4);
    const double height = sample.uniform(0.05, 0.4);
    const double mass = sample.mostly_small(0.3, 5);
    const int kind = sample.whole(0, 2);
    // Along the slope and across, a lane each; cylinders and capsules lie across it.
    const Vector3 speed(sample.uniform(-1, 3), 0, 0);
    const double spin = sample.uniform(-5, 15);
    const Pose across = turn(Vector3::UnitX(), pi / 2);
    const Pose pose = slope * at(0, radius, i - (count - 1) / 2.0) * across;
    const std::string label = "roller_" + std::to_string(i + 1);
    const int node = gltf.node(label, pose);
    // Node space: its Y is across the slope, and −Y the axis of rolling forward.
    gltf.motion(node, {.mass = mass, .linear_velocity = speed, .angular_velocity = {0, -spin, 0}});
    const int shape = kind == 0   ? gltf.sphere_shape(radius)
                      : kind == 1 ? gltf.capsule_shape(radius, height)
                                  : gltf.cylinder_shape(radius, height);
    gltf.collider(node, shape, gltf.physics_material(friction));
    Mesh look;
    if (kind == 0) {
      look = ball(radius, 20);
    } else if (kind == 2) {
      look = rod(height, radius, radius / 10, 20);
    } else {
      look = rod(height, radius, radius / 10, 20);
      for (const int side : {-1, 1}) look.add(ball(radius, 20), at(0, side * height / 2, 0));
    }
    const int geometry = gltf.geometry(look);
    gltf.show(node, gltf.mesh(label, {{geometry, gltf.material(sampled_finish(i))}}));
  }
  light_and_camera(gltf, {0.5, 3, 0}, 3);
  return gltf.text();
}

std::string sliding(int number) {
  SampledScene scene("sliding", number);
  auto& [sample, gltf] = scene;
  const double friction = sample.uniform(0.1, 0.6);
  const Pose slope = add_slope(gltf, sample, 0.5, friction);
  const int count = sample.whole(1, 3);
  for (int i = 0; i < count; ++i) {
    const double width = sample.mostly_small(0.2, 0.6);
    const Vector3 size{width, width * sample.uniform(0.3, 1), width * sample.uniform(0.6, 1.2)};
    const double mass = sample.mostly_small(0.3, 10);
    const Pose pose = slope * at(0, size.y() / 2, 1.2 * (i - (count - 1) / 2.0)) *
                      turn(Vector3::UnitY(), sample.uniform(-0.5, 0.5));
    const Vector3 velocity{sample.uniform(-1, 3), 0, sample.uniform(-0.5, 0.5)};
    add_box(gltf, "block_" + std::to_string(i + 1), size, pose, {.mass = mass, .linear_velocity = velocity},
            friction, sampled_finish(i));
  }
  light_and_camera(gltf, {0.5, 3, 0}, 3);
  return gltf.text();
}

}  // namespace substep::make
