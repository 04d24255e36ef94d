#pragma once
/// What the sampled scenes share: values from a seed, links of mechanisms, the light.

#include <cmath>
#include <string>
#include <string_view>

#include "finishes.h"
#include "gltf_builder.h"
#include "mesh.h"
#include "sim/math/fnv1a.h"
#include "stage.h"

namespace substep::make {

inline constexpr double sampled_duration = 2;  ///< s

/// Values of one scene, the same on every machine: each call gives the next. What is continuous has three
/// decimals. C++ leaves the order of a call's arguments open, so no two of them may sample: braces keep it.
class Sampler {
 public:
  explicit Sampler(std::string_view scene) : index_(fnv1a(scene) + sampling_seed) {}

  double uniform(double low, double high) { return rounded_value(low + (high - low) * next()); }
  /// Half of the values lie in the lowest quarter.
  double mostly_small(double low, double high) {
    const double u = next();
    return rounded_value(low + (high - low) * u * u);
  }
  int whole(int low, int high) { return low + static_cast<int>(next() * (high - low + 1)); }
  /// A point of the unit sphere.
  Vector3 direction() {
    for (;;) {
      Vector3 point;
      for (double& coordinate : point) coordinate = uniform(-1, 1);
      const double length = point.norm();
      if (length > 0.1 && length <= 1) return point / length;
    }
  }

 private:
  static constexpr std::uint64_t sampling_seed = 20261124;

  static double rounded_value(double value) { return std::round(value * 1000) / 1000; }
  double next() { return noise(index_++); }

  std::uint64_t index_;
};

inline constexpr std::array sampled_finishes{finish::terracotta, finish::mustard, finish::teal,
                                             finish::blue,       finish::ivory,   finish::cherry,
                                             finish::walnut,     finish::oak};

inline const Finish& sampled_finish(int index) {
  return sampled_finishes[static_cast<std::size_t>(index) % sampled_finishes.size()];
}

/// A scene that is being made: "rolling_3", its values and its file.
struct SampledScene {
  SampledScene(std::string_view family, int number, const Vector3& gravity = {0, -9.81, 0})
      : SampledScene(std::string(family) + "_" + std::to_string(number), gravity) {}

  Sampler sample;
  GltfBuilder gltf;

 private:
  SampledScene(const std::string& name, const Vector3& gravity)
      : sample(name), gltf(name, sampled_duration, gravity) {}
};

/// Sees a ball of `radius` about `centre` whole, soon after the start.
inline void light_and_camera(GltfBuilder& gltf, const Vector3& centre, double radius) {
  gltf.poster(0.3);
  gltf.camera(centre + radius * Vector3(1.6, 1.2, 3.2), centre, 0.60);
  gltf.sun(afternoon, warm_white, daylight);
}

/// A frame at a point whose Z points along `axis`.
inline Pose frame_at(const Vector3& point, const Vector3& axis) {
  return {point, Quaternion::FromTwoVectors(Vector3::UnitZ(), axis)};
}

/// A box that moves, and where it is.
struct SampledBody {
  int node = -1;
  Pose pose;
};

inline SampledBody add_body(GltfBuilder& gltf, const std::string& name, const Vector3& size, const Pose& pose,
                            const Motion& motion, const Finish& look) {
  SampledBody body{gltf.node(name, pose), pose};
  gltf.motion(body.node, motion);
  const int geometry = gltf.geometry(faceted(box(size)));
  gltf.show(body.node, gltf.mesh(name, {{geometry, gltf.material(look)}}));
  return body;
}

/// Joins the body to another, or to the world, at a frame of the world.
inline void join(GltfBuilder& gltf, const std::string& name, const SampledBody& body,
                 const SampledBody* other, const Pose& frame, int description) {
  const int connected = other ? gltf.node(name + "_end", other->pose.inverse() * frame, other->node)
                              : gltf.node(name + "_end", frame);
  gltf.joint(gltf.node(name, body.pose.inverse() * frame, body.node), connected, description);
}

}  // namespace substep::make
