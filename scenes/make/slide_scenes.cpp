/// Scenes on triangle meshes: what slides, rolls and falls over ground that is not flat.

#include <algorithm>
#include <cmath>
#include <vector>

#include "finishes.h"
#include "gltf_builder.h"
#include "mesh.h"
#include "scenes.h"
#include "sim/geometry/convex_hull.h"
#include "sim/geometry/mass_properties.h"
#include "sim/math/rotation.h"
#include "stage.h"

namespace substep::scenes {
namespace {

/// Smooth noise in [−1, 1] with one value for each unit square's corner.
double smooth_noise(double u, double v, std::uint64_t seed) {
  const double u0 = std::floor(u);
  const double v0 = std::floor(v);
  const auto corner = [&](double i, double j) {
    const auto column = static_cast<std::uint64_t>(static_cast<std::int64_t>(u0 + i) + 4096);
    const auto row = static_cast<std::uint64_t>(static_cast<std::int64_t>(v0 + j) + 4096);
    return 2 * noise((seed * 8192 + row) * 8192 + column) - 1;
  };
  const auto ease = [](double t) { return t * t * (3 - 2 * t); };
  const double s = ease(u - u0);
  const double t = ease(v - v0);
  return (1 - t) * ((1 - s) * corner(0, 0) + s * corner(1, 0)) +
         t * ((1 - s) * corner(0, 1) + s * corner(1, 1));
}

/// A valley that falls along +X, flattens and ends at a bank; a stream bed winds down its middle.
class Valley {
 public:
  static constexpr double half_length = 21;
  static constexpr double half_width = 11.4;
  static constexpr double cell = 0.6;

  static double middle(double x) { return 1.7 * sine_cosine(0.28 * x).sine; }

  static double height(double x, double z) {
    constexpr double steepness = 0.68;
    // Straight to x = 2, then ever flatter to x = 14, then a bank.
    double fall = steepness * std::min(x, 2.0);
    if (x > 2) {
      const double run = std::min(x, 14.0) - 2;
      fall += steepness * run * (1 - run / 24);
    }
    const double bank = x > 14 ? 0.055 * (x - 14) * (x - 14) : 0;
    const double across = z - middle(x);
    const double walls = 0.030 * across * across;
    // Ribs of rock across the slope, and small bumps everywhere.
    const double rib = 1 - std::fabs(smooth_noise(x / 4.2, z / 6.5, 1));
    const double bumps = 0.55 * rib * rib + 0.22 * smooth_noise(x / 1.7, z / 1.7, 2);
    return 6.6 - fall + bank + walls + bumps;
  }
};

/// What planes at random distances leave of space: a solid with few, large, uneven faces.
std::vector<Vector3> cut_stone(std::uint64_t seed, int planes, const Vector3& half_size) {
  constexpr double golden_angle = 2.399963229728653;
  // The corners of the solid are the faces of the hull of the planes' poles.
  std::vector<Vector3> poles;
  for (int i = 0; i < planes; ++i) {
    const auto random = [&](std::uint64_t what) {
      return noise((seed * 64 + static_cast<std::uint64_t>(i)) * 4 + what);
    };
    const double y = 1 - (2 * i + 0.4 + 1.2 * random(0)) / planes;
    const auto [sine, cosine] = sine_cosine(golden_angle * i + 0.7 * (random(1) - 0.5));
    const double across = std::sqrt(1 - y * y);
    poles.emplace_back(Vector3(across * cosine, y, across * sine) / (0.80 + 0.2 * random(2)));
  }
  const Polytope dual = convex_hull(poles, "the planes of a stone");
  std::vector<Vector3> corners;
  for (std::size_t face = 0; face < dual.face_count(); ++face)
    corners.emplace_back(half_size.cwiseProduct(dual.face_normals[face] / dual.face_offsets[face]));
  return corners;
}

}  // namespace

std::string rock_slide() {
  constexpr double rock_density = 2600;
  constexpr double wood_density = 650;

  GltfBuilder gltf("rock_slide", 12);
  gltf.poster(4);
  gltf.camera({42.0, 22.5, 23.0}, {0.0, 7.6, 0.2}, 0.56);
  gltf.sun({-0.35, -1, -0.75}, warm_white, daylight);
  add_ground(gltf, 0.6);

  // The terrain: what is steep is rock, the bed and the run-out are scree, the rest is grass.
  const auto columns = static_cast<std::uint32_t>(std::lround(2 * Valley::half_length / Valley::cell));
  const auto rows = static_cast<std::uint32_t>(std::lround(2 * Valley::half_width / Valley::cell));
  const auto x_of = [](std::uint32_t i) { return -Valley::half_length + Valley::cell * i; };
  const auto z_of = [](std::uint32_t j) { return -Valley::half_width + Valley::cell * j; };
  const auto point = [&](std::uint32_t i, std::uint32_t j) {
    return Vector3(x_of(i), Valley::height(x_of(i), z_of(j)), z_of(j));
  };
  const std::array<Finish, 4> covers{finish::grass, finish::meadow, finish::scree, finish::cliff};
  std::array<Mesh, covers.size()> ground;
  const auto cover_of = [&](const Vector3& a, const Vector3& b, const Vector3& c) -> std::size_t {
    const Vector3 normal = (b - a).cross(c - a).normalized();
    const Vector3 centre = (a + b + c) / 3;
    const double patch = smooth_noise(centre.x() / 3, centre.z() / 3, 3);
    if (normal.y() < 0.70) return 3;
    if (std::fabs(centre.z() - Valley::middle(centre.x())) < 2.4 + 0.9 * patch) return 2;
    return patch > 0.1 ? 1 : 0;
  };
  const auto add_triangle = [](Mesh& mesh, const Vector3& a, const Vector3& b, const Vector3& c) {
    const auto base = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {a, b, c});
    mesh.triangles.push_back({base, base + 1, base + 2});
  };
  for (std::uint32_t j = 0; j < rows; ++j) {
    for (std::uint32_t i = 0; i < columns; ++i) {
      const Vector3 a = point(i, j);
      const Vector3 b = point(i, j + 1);
      const Vector3 c = point(i + 1, j + 1);
      const Vector3 d = point(i + 1, j);
      // Diagonals to and fro, so that the grid does not show a grain.
      const bool falling = (i + j) % 2 == 0;
      const std::array<std::array<Vector3, 3>, 2> halves{{{a, b, falling ? c : d}, {falling ? a : b, c, d}}};
      for (const auto& [p, q, r] : halves) add_triangle(ground[cover_of(p, q, r)], p, q, r);
    }
  }
  std::vector<GltfBuilder::Part> parts;
  for (std::size_t i = 0; i < covers.size(); ++i) {
    const int geometry = gltf.geometry(ground[i]);
    parts.push_back({geometry, gltf.material(covers[i])});
  }
  const int valley = gltf.node("valley");
  gltf.show(valley, gltf.mesh("valley", parts));
  gltf.mesh_collider(valley, valley, gltf.physics_material(0.5));

  // The block of earth that it was cut from: drawn only.
  Mesh earth;
  const auto add_wall = [&](const Vector3& a, const Vector3& b) {
    const Vector3 foot_a(a.x(), 0, a.z());
    const Vector3 foot_b(b.x(), 0, b.z());
    add_triangle(earth, a, foot_a, foot_b);
    add_triangle(earth, a, foot_b, b);
  };
  for (std::uint32_t i = 0; i < columns; ++i) {
    add_wall(point(i, rows), point(i + 1, rows));
    add_wall(point(i + 1, 0), point(i, 0));
  }
  for (std::uint32_t j = 0; j < rows; ++j) {
    add_wall(point(0, j), point(0, j + 1));
    add_wall(point(columns, j + 1), point(columns, j));
  }
  add_scenery(gltf, "earth", earth, finish::soil);

  const int grip = gltf.physics_material(0.5);

  // Logs across the slope, in the way of the rocks.
  constexpr double log_bottom = 0.26;
  constexpr double log_top = 0.18;
  constexpr double log_length = 2.4;
  const int log_shape = gltf.tapered_capsule_shape(log_bottom, log_top, log_length);
  const double log_mass =
      std::round(wood_density * mass_properties(TaperedCapsule{log_length / 2, log_bottom, log_top}).mass);
  const std::array<ProfilePoint, 4> trunk{{{0, -log_length / 2 - log_bottom},
                                           {log_bottom, -log_length / 2 - log_bottom, 0.2},
                                           {log_top, log_length / 2 + log_top, 0.14},
                                           {0, log_length / 2 + log_top}}};
  const int trunk_geometry = gltf.geometry(turned(trunk, 14));
  const int log_look = gltf.mesh("log", {{trunk_geometry, gltf.material(finish::walnut)}});
  for (int i = 0; i < 6; ++i) {
    const double x = -7.6 + 1.5 * (i / 2);
    const double z = Valley::middle(x) + (i % 2 == 0 ? -1.75 : 1.75);
    const int body =
        gltf.node("log_" + std::to_string(i + 1), at(x, Valley::height(x, z) + 0.75, z) *
                                                      turn(Vector3::UnitX(), i % 2 == 0 ? pi / 2 : -pi / 2));
    gltf.motion(body, {.mass = log_mass});
    gltf.collider(body, log_shape, grip);
    gltf.show(body, log_look);
  }

  // Six cuts of rock, in three sizes; they lie loosely over the top of the slope.
  constexpr int cuts = 6;
  constexpr std::array stones{finish::granite, finish::limestone, finish::basalt, finish::sandstone};
  constexpr std::size_t kinds_of_stone = stones.size();
  struct Rock {
    int collider_node;
    std::array<int, kinds_of_stone> looks;
    double mass;
  };
  std::vector<Rock> rocks;
  for (int cut = 0; cut < cuts; ++cut) {
    const double size = 0.38 + 0.07 * cut;
    const Vector3 half_size = size * Vector3(1.15, 0.78 + 0.05 * (cut % 3), 0.95);
    const std::vector<Vector3> corners = cut_stone(static_cast<std::uint64_t>(cut) + 1, 11 + cut, half_size);
    const int geometry = gltf.geometry(hull(corners));
    Rock rock{};
    for (std::size_t i = 0; i < stones.size(); ++i) {
      rock.looks[i] = gltf.mesh("cut_" + std::to_string(cut + 1) + "_" + std::string(stones[i].name),
                                {{geometry, gltf.material(stones[i])}});
    }
    rock.collider_node = gltf.detached_node("cut_" + std::to_string(cut + 1), rock.looks[0]);
    rock.mass = std::round(rock_density * mass_properties(convex_hull(corners, "a rock")).mass);
    rocks.push_back(rock);
  }
  int number = 0;
  for (int layer = 0; layer < 2; ++layer) {
    for (int row = 0; row < 5; ++row) {
      for (int column = 0; column < 5; ++column, ++number) {
        const auto random = [&](std::uint64_t what) {
          return noise(9000 + static_cast<std::uint64_t>(number) * 8 + what);
        };
        const Rock& rock = rocks[static_cast<std::size_t>(cuts * random(0))];
        const double x = -18.4 + 1.75 * column + 0.3 * random(1);
        const double z = Valley::middle(x) + 1.75 * (row - 2) + 0.3 * random(2);
        const Vector3 axis(random(3) - 0.5, random(4) - 0.5, random(5) - 0.5);
        const int body =
            gltf.node("rock_" + std::to_string(number + 1),
                      at(x, Valley::height(x, z) + 1.05 + 1.7 * layer, z) * turn(axis, 2 * pi * random(6)));
        gltf.motion(body, {.mass = rock.mass});
        gltf.hull_collider(body, rock.collider_node, grip);
        gltf.show(body, rock.looks[static_cast<std::size_t>(stones.size() * random(7))]);
      }
    }
  }

  gltf.expect_no_gain(10000, "nothing drives it; the rocks' fall is worth megajoules");
  return gltf.text();
}

}  // namespace substep::scenes
