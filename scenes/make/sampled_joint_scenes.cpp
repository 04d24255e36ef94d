/// Sampled scenes of joints: trees, springs, tops, heavy ends, closed loops.

#include <algorithm>
#include <vector>

#include "sampling.h"
#include "scenes.h"
#include "sim/math/rotation.h"

namespace substep::make {
namespace {

/// A bar from a point along a direction.
struct Bar {
  Vector3 from;
  Vector3 along;  ///< of length 1
  double length;
  double width;
  double mass;

  Vector3 end() const { return from + along * length; }
  Vector3 size() const { return {width, length, width}; }
};

/// Its node's −Y is along the bar.
SampledBody add_bar(GltfBuilder& gltf, const std::string& name, const Bar& bar, const Finish& look) {
  const Pose pose{bar.from + bar.along * (bar.length / 2),
                  Quaternion::FromTwoVectors(-Vector3::UnitY(), bar.along)};
  return add_body(gltf, name, bar.size(), pose,
                  {.mass = bar.mass, .inertia = box_inertia(bar.mass, bar.size())}, look);
}

Bar sampled_bar(Sampler& sample, const Vector3& from, double size) {
  const double length = size * sample.uniform(0.3, 1);
  const double width = length * sample.uniform(0.05, 0.2);
  const double mass = sample.mostly_small(0.3, 5);
  return {from, sample.direction(), length, width, mass};
}

/// Bars round a polygon whose last side is the world, on parallel hinges.
void add_polygon(GltfBuilder& gltf, Sampler& sample) {
  const int count = sample.whole(4, 6);
  const double width = sample.mostly_small(0.3, 1.5);
  const double height = width * sample.uniform(0.5, 1);
  const double start = sample.uniform(0, 2 * pi);
  std::vector<Vector3> corners;
  for (int i = 0; i < count; ++i) {
    const auto [sine, cosine] = sine_cosine(start + 2 * pi * (i + sample.uniform(-0.25, 0.25)) / count);
    corners.emplace_back(width * cosine, 2 + height * sine, 0);
  }
  const int hinge = gltf.hinge();
  std::vector<SampledBody> bars;
  for (int i = 0; i + 1 < count; ++i) {
    const Vector3 side = corners[i + 1] - corners[i];
    const double mass = sample.mostly_small(0.3, 5);
    const std::string number = std::to_string(i + 1);
    const Bar bar{corners[i], side.normalized(), side.norm(), 0.05 * width, mass};
    bars.push_back(add_bar(gltf, "bar_" + number, bar, sampled_finish(i)));
    join(gltf, "hinge_" + number, bars[i], i > 0 ? &bars[i - 1] : nullptr,
         frame_at(corners[i], Vector3::UnitZ()), hinge);
  }
  join(gltf, "hinge_" + std::to_string(count), bars.back(), nullptr,
       frame_at(corners.back(), Vector3::UnitZ()), hinge);
  light_and_camera(gltf, {0, 2, 0}, 1.6 * width);
}

/// A slab that hangs on parallel rods, pulled aside.
void add_platform(GltfBuilder& gltf, Sampler& sample) {
  const int rods = sample.whole(3, 4);
  const Vector3 size{sample.uniform(0.4, 2), sample.uniform(0.05, 0.2), sample.uniform(0.4, 2)};
  const double length = sample.mostly_small(0.4, 2);
  const Vector3 down = Vector3{sample.uniform(-0.8, 0.8), -1, sample.uniform(-0.8, 0.8)}.normalized();
  const double mass = sample.mostly_small(1, 20);
  const double rod_mass = mass * sample.uniform(0.05, 0.3);
  const Vector3 centre = Vector3(0, 3, 0) + down * length - Vector3(0, size.y() / 2, 0);
  const SampledBody slab = add_body(gltf, "slab", size, {centre, Quaternion::Identity()},
                                    {.mass = mass, .inertia = box_inertia(mass, size)}, sampled_finish(0));
  const int joint = gltf.ball_joint();
  for (int i = 0; i < rods; ++i) {
    // Three rods: two at corners, one at the middle of the side opposite.
    const double x = rods == 3 && i == 2 ? 0 : (i % 2 == 0 ? -0.5 : 0.5);
    const Vector3 top(x * size.x(), 3, (i < 2 ? -0.5 : 0.5) * size.z());
    const std::string number = std::to_string(i + 1);
    const Bar bar{top, down, length, 0.03 * length, rod_mass};
    const SampledBody rod = add_bar(gltf, "rod_" + number, bar, sampled_finish(i + 1));
    join(gltf, "top_" + number, rod, nullptr, {top, Quaternion::Identity()}, joint);
    join(gltf, "bottom_" + number, rod, &slab, {bar.end(), Quaternion::Identity()}, joint);
  }
  light_and_camera(gltf, {0, 3 - length / 2, 0}, size.maxCoeff() + length);
}

/// A leaf on more hinges than hold it, about an axis that leans.
void add_gate(GltfBuilder& gltf, Sampler& sample) {
  const int count = sample.whole(2, 4);
  const Vector3 leaf{sample.uniform(0.4, 2), sample.uniform(0.4, 2), sample.uniform(0.03, 0.1)};
  const Pose lean = turn(Vector3::UnitZ(), sample.uniform(-0.6, 0.6));
  const Pose open = turn(Vector3::UnitY(), sample.uniform(-1.5, 1.5));
  const double mass = sample.mostly_small(1, 40);
  const Pose pose = at(0, 1.5, 0) * lean * open * at(leaf.x() / 2, 0, 0);
  const SampledBody body = add_body(gltf, "leaf", leaf, pose,
                                    {.mass = mass, .inertia = box_inertia(mass, leaf)}, sampled_finish(0));
  const int hinge = gltf.hinge();
  for (int i = 0; i < count; ++i) {
    const double height = leaf.y() * (sample.uniform(0.05, 0.95) - 0.5);
    const Pose frame = pose * at(-leaf.x() / 2, height, 0) * turn(Vector3::UnitX(), -pi / 2);
    join(gltf, "hinge_" + std::to_string(i + 1), body, nullptr, frame, hinge);
  }
  light_and_camera(gltf, {0, 1.5, 0}, leaf.x() + leaf.y());
}

}  // namespace

std::string hanging(int number) {
  SampledScene scene("hanging", number);
  auto& [sample, gltf] = scene;
  const Vector3 root(0, 2, 0);
  const double size = sample.mostly_small(0.3, 2);
  const int count = sample.whole(2, 5);
  std::vector<Bar> bars;
  std::vector<SampledBody> bodies;
  for (int i = 0; i < count; ++i) {
    const int parent = i == 0 ? -1 : sample.whole(std::max(0, i - 2), i - 1);
    bars.push_back(sampled_bar(sample, parent < 0 ? root : bars[parent].end(), size));
    const std::string label = std::to_string(i + 1);
    bodies.push_back(add_bar(gltf, "bar_" + label, bars[i], sampled_finish(i)));
    const bool is_hinge = sample.whole(0, 1) == 1;
    const Vector3 axis = sample.direction();
    join(gltf, "joint_" + label, bodies[i], parent < 0 ? nullptr : &bodies[parent],
         frame_at(bars[i].from, axis), is_hinge ? gltf.hinge() : gltf.ball_joint());
  }
  light_and_camera(gltf, root, size * count * 0.6);
  return gltf.text();
}

std::string sprung(int number) {
  SampledScene scene("sprung", number);
  auto& [sample, gltf] = scene;
  const Vector3 root(0, 2, 0);
  const double size = sample.mostly_small(0.3, 2);
  const int count = sample.whole(1, 3);
  std::vector<Bar> bars;
  std::vector<SampledBody> bodies;
  for (int i = 0; i < count; ++i) {
    bars.push_back(sampled_bar(sample, i == 0 ? root : bars[i - 1].end(), size));
    const Bar& bar = bars[i];
    const std::string label = std::to_string(i + 1);
    bodies.push_back(add_bar(gltf, "bar_" + label, bar, sampled_finish(i)));
    const bool turns = sample.whole(0, 1) == 1;
    const double rate = 2 * pi * sample.mostly_small(0.3, 30);
    const double damping = sample.uniform(0, 0.2);  // of the critical one
    const double moved = turns ? bar.mass * bar.length * bar.length / 3 : bar.mass;
    const AxesLimit spring{.kind = turns ? angular : linear,
                           .axes = {2},
                           .min = 0,
                           .max = 0,
                           .stiffness = moved * rate * rate,
                           .damping = 2 * damping * rate * moved};
    const std::vector<AxesLimit> limits =
        turns ? std::vector{locked(linear, {0, 1, 2}), locked(angular, {0, 1}), spring}
              : std::vector{locked(linear, {0, 1}), locked(angular, {0, 1, 2}), spring};
    join(gltf, "joint_" + label, bodies[i], i == 0 ? nullptr : &bodies[i - 1],
         frame_at(bar.from, sample.direction()), gltf.joint_description(limits));
  }
  light_and_camera(gltf, root, size * count * 0.8);
  gltf.poster(0);  // soft springs let bars sink below the floor that pictures add
  return gltf.text();
}

std::string spinning(int number) {
  const bool is_free = number % 2 == 0;
  SampledScene scene("spinning", number, is_free ? Vector3::Zero() : Vector3(0, -9.81, 0));
  auto& [sample, gltf] = scene;
  const Vector3 size{sample.uniform(0.1, 1), sample.uniform(0.1, 1), sample.uniform(0.1, 1)};
  const double mass = sample.mostly_small(0.3, 5);
  const Pose pose{{0, 1.5, 0}, Quaternion::FromTwoVectors(Vector3::UnitY(), sample.direction())};
  const Vector3 axis = sample.direction();
  const Vector3 spin = axis * sample.mostly_small(2, 20);  // in the body
  const Vector3 pivot = is_free ? Vector3::Zero() : Vector3(0, -size.y() / 2, 0);
  const SampledBody body = add_body(gltf, "block", size, pose,
                                    {.mass = mass,
                                     .inertia = box_inertia(mass, size),
                                     .linear_velocity = -spin.cross(pivot),
                                     .angular_velocity = spin},
                                    sampled_finish(number));
  if (!is_free)
    join(gltf, "pivot", body, nullptr, pose * Pose{pivot, Quaternion::Identity()}, gltf.ball_joint());
  light_and_camera(gltf, pose.position, 1.5);
  return gltf.text();
}

std::string weighted(int number) {
  SampledScene scene("weighted", number);
  auto& [sample, gltf] = scene;
  const int count = sample.whole(3, 8);
  const double length = sample.uniform(0.1, 0.6);
  const double mass = sample.uniform(0.2, 2);
  const double ratio = sample.uniform(100, 1000);
  Vector3 along = sample.direction();
  along.y() = -std::abs(along.y());
  const Vector3 root(0, 2, 0);
  const int joint = gltf.ball_joint();
  std::vector<SampledBody> bodies;
  for (int i = 0; i <= count; ++i) {
    const Vector3 from = root + along * (length * i);
    const std::string label = std::to_string(i + 1);
    // The last one is as thick as it is long.
    const Bar bar{from, along, length, i == count ? length : 0.08 * length, i == count ? mass * ratio : mass};
    bodies.push_back(
        add_bar(gltf, i == count ? "weight" : "bar_" + label, bar, sampled_finish(i == count ? 5 : i)));
    join(gltf, "joint_" + label, bodies[i], i == 0 ? nullptr : &bodies[i - 1], {from, Quaternion::Identity()},
         joint);
  }
  light_and_camera(gltf, root, length * (count + 2));
  return gltf.text();
}

std::string linkage(int number) {
  SampledScene scene("linkage", number);
  auto& [sample, gltf] = scene;
  if (number % 3 == 1) {
    add_polygon(gltf, sample);
  } else if (number % 3 == 2) {
    add_platform(gltf, sample);
  } else {
    add_gate(gltf, sample);
  }
  return gltf.text();
}

}  // namespace substep::make
