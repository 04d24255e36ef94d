#pragma once
/// Makes the scenes of the library, by kind; the page beside each file explains its scene. All scenes use the
/// axes, finishes and shorthands below.

#include <numbers>
#include <string>
#include <vector>

#include "gltf_builder.h"

namespace substep::scenes {

inline constexpr double pi = std::numbers::pi;
inline constexpr double gravity = 9.81;  ///< m/s²
inline const Vector3 X = Vector3::UnitX();
inline const Vector3 Y = Vector3::UnitY();
inline const Vector3 Z = Vector3::UnitZ();

inline constexpr auto linear = AxesLimit::Kind::linear;
inline constexpr auto angular = AxesLimit::Kind::angular;

/// Returns the principal moments of a uniform box.
inline Vector3 box_inertia(double mass, const Vector3& size) {
  const Vector3 squares = size.cwiseProduct(size);
  return Vector3(squares.y() + squares.z(), squares.x() + squares.z(), squares.x() + squares.y()) *
         (mass / 12);
}

/// Returns "name_3".
inline std::string numbered(const std::string& name, int number) {
  return name + "_" + std::to_string(number);
}

inline std::vector<std::string> numbered(const std::string& name, int first, int last) {
  std::vector<std::string> names;
  for (int i = first; i <= last; ++i) names.push_back(numbered(name, i));
  return names;
}

/// One of several bodies side by side that differ in friction.
struct Lane {
  std::string name;
  double friction;
  Finish paint;
};

/// Woods, stones, metals and a few enamels.
namespace finish {

inline constexpr Finish walnut{"walnut", {0.195, 0.070, 0.023}, 0, 0.50};
inline constexpr Finish oak{"oak", {0.527, 0.254, 0.076}, 0, 0.55};
inline constexpr Finish maple{"maple", {0.745, 0.503, 0.238}, 0, 0.50};
inline constexpr Finish cherry{"cherry", {0.332, 0.089, 0.034}, 0, 0.45};

inline constexpr Finish limestone{"limestone", {0.624, 0.565, 0.456}, 0, 0.85};
inline constexpr Finish sandstone{"sandstone", {0.584, 0.381, 0.191}, 0, 0.85};
inline constexpr Finish granite{"granite", {0.366, 0.323, 0.287}, 0, 0.70};
inline constexpr Finish basalt{"basalt", {0.147, 0.144, 0.138}, 0, 0.65};
inline constexpr Finish brick{"brick", {0.350, 0.165, 0.110}, 0, 0.85};

inline constexpr Finish grass{"grass", {0.125, 0.185, 0.052}, 0, 0.95};
inline constexpr Finish meadow{"meadow", {0.205, 0.225, 0.070}, 0, 0.95};
inline constexpr Finish scree{"scree", {0.345, 0.290, 0.215}, 0, 0.95};
inline constexpr Finish cliff{"cliff", {0.250, 0.225, 0.200}, 0, 0.90};
inline constexpr Finish soil{"soil", {0.145, 0.085, 0.045}, 0, 0.95};

inline constexpr Finish steel{"steel", {0.456, 0.497, 0.539}, 1, 0.32};
inline constexpr Finish brass{"brass", {0.631, 0.381, 0.080}, 1, 0.30};
inline constexpr Finish iron{"iron", {0.068, 0.084, 0.107}, 0.6, 0.45};
inline constexpr Finish rubber{"rubber", {0.014, 0.014, 0.016}, 0, 0.80};

inline constexpr Finish terracotta{"terracotta", {0.515, 0.089, 0.037}, 0, 0.35};
inline constexpr Finish mustard{"mustard", {0.694, 0.352, 0.037}, 0, 0.35};
inline constexpr Finish teal{"teal", {0.025, 0.195, 0.198}, 0, 0.35};
inline constexpr Finish ivory{"ivory", {0.847, 0.776, 0.631}, 0, 0.40};
inline constexpr Finish blue{"blue", {0.028, 0.109, 0.254}, 0, 0.35};

}  // namespace finish

using SceneFunction = GltfBuilder (*)();

/// Makes a scene whose constructor builds it.
template <class Scene>
GltfBuilder made() {
  return Scene();
}

std::vector<SceneFunction> stack_scenes();
std::vector<SceneFunction> impact_scenes();
std::vector<SceneFunction> joint_scenes();
std::vector<SceneFunction> mechanism_scenes();
std::vector<SceneFunction> friction_scenes();
std::vector<SceneFunction> slide_scenes();
std::vector<SceneFunction> rolling_scenes();
std::vector<SceneFunction> spin_scenes();
std::vector<SceneFunction> driven_scenes();
std::vector<SceneFunction> meeting_scenes();
std::vector<SceneFunction> published_scenes();

}  // namespace substep::scenes
