/// Scenes of sliding and rolling down: blocks on an incline, rocks in a valley.

#include <algorithm>
#include <cmath>

#include "scenes.h"
#include "sim/geometry/convex_hull.h"
#include "sim/geometry/mass_properties.h"
#include "sim/math/rotation.h"

namespace substep::scenes {
namespace {

GltfBuilder incline() {
  constexpr double length = 6.4;
  constexpr double width = 2.8;
  constexpr double thickness = 0.2;
  const Vector3 size(0.6, 0.4, 0.6);
  GltfBuilder gltf("incline", {.duration = 2},
                   {.eye = {4.4, 4.2, 7.9},
                    .target = {0.05, 1.40, 0},
                    .yfov = 0.56,
                    .friction = 0.6,
                    .light = {-0.25, -1, -0.6}});

  // The slope's frame: X downhill, Y off the surface, which is y = 0.
  const double sine = 0.5;
  const double cosine = std::sqrt(0.75);
  const double foot = thickness * cosine;  // the slab's lower edge stands on the ground
  const int slope = gltf.node("slope", at(0, length / 2 * sine + foot, 0) * turn(Z, -pi / 6));
  const Vector3 slab_size(length, thickness, width);
  gltf.fixed_body("slab", at(0, -thickness / 2, 0), {gltf.box_shape(slab_size), gltf.physics_material(1)},
                  {{cuboid(slab_size, 0.03), finish::maple}}, slope);
  // Draw the slab's supports, without colliders.
  const double half = length / 2 * cosine - 0.25;
  const Polyhedron support =
      prism({point(-half, 0), point(half, 0), point(-half, 2 * half * sine / cosine)}, width - 0.5);
  gltf.scenery("support", {{turn(X, pi / 2) * rounded(support, 0.03), finish::granite}});

  const int shape = gltf.box_shape(size);
  const int block = gltf.geometry(cuboid(size, 0.035));
  const Vector3 downhill(cosine, -sine, 0);
  double z = -0.9;
  for (const auto& [name, friction, paint] :
       {Lane{"rubber_block", 0.8, finish::terracotta}, Lane{"wooden_block", 0.5, finish::mustard},
        Lane{"waxed_block", 0.3, finish::teal}}) {
    gltf.body(name, at(-2.6, size.y() / 2, z), {.mass = 10}, {shape, gltf.physics_material(friction)},
              {{block, paint}}, slope);
    z += 0.9;
    const double gain = gravity * (sine - friction * cosine);
    if (gain < 0) {
      gltf.expect({name + ": largest displacement", "displacement", {name}}, any_time, 0, 0.001,
                  "Coulomb: it stays, since tan 30° < μ");
      continue;
    }
    const double way = gain * 2 * 2 / 2;
    gltf.expect({name + ": way down the slope at 2 s", "way", {name}, downhill}, at_time(2), way, 0.02 * way,
                "Coulomb: a t²/2 with a = g (sin 30° − μ cos 30°)");
  }
  return gltf;
}

/// Returns smooth noise in [−1, 1], interpolated from random values at whole u and v.
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

/// Returns the corners of the intersection of half-spaces at random distances: few, large, uneven faces.
std::vector<Vector3> cut_stone(std::uint64_t seed, int planes, const Vector3& half_size) {
  constexpr double golden_angle = 2.399963229728653;
  // The corners of the solid are the faces of the hull of the planes' poles.
  std::vector<Vector3> poles;
  for (int i = 0; i < planes; ++i) {
    const auto random = [&](std::uint64_t draw) {
      return noise((seed * 64 + static_cast<std::uint64_t>(i)) * 4 + draw);
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

/// Rocks and logs in a valley, a triangle mesh that is cut into a block of earth.
struct RockSlide : GltfBuilder {
  RockSlide()
      : GltfBuilder("rock_slide", {.duration = 12, .poster = 4},
                    {.eye = {42.0, 22.5, 23.0},
                     .target = {0.0, 7.6, 0.2},
                     .yfov = 0.56,
                     .friction = 0.6,
                     .light = {-0.35, -1, -0.75}}) {
    add_valley();
    add_earth();
    grip_ = physics_material(0.5);
    add_logs();
    add_rocks();
    expect_no_gain(10000, "nothing drives it; the rocks' fall is worth megajoules");
  }

  const std::uint32_t columns =
      static_cast<std::uint32_t>(std::lround(2 * Valley::half_length / Valley::cell));
  const std::uint32_t rows = static_cast<std::uint32_t>(std::lround(2 * Valley::half_width / Valley::cell));

  /// Returns a corner of the terrain's grid.
  static Vector3 grid_point(std::uint32_t i, std::uint32_t j) {
    const double x = -Valley::half_length + Valley::cell * i;
    const double z = -Valley::half_width + Valley::cell * j;
    return {x, Valley::height(x, z), z};
  }

  static void add_triangle(Mesh& mesh, const Vector3& a, const Vector3& b, const Vector3& c) {
    const auto base = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {a, b, c});
    mesh.triangles.push_back({base, base + 1, base + 2});
  }

  /// Returns the index of a triangle's cover in add_valley(): 0 grass, 1 meadow, 2 scree near the stream's
  /// bed, 3 cliff where steep.
  static std::size_t cover_of(const Vector3& a, const Vector3& b, const Vector3& c) {
    const Vector3 normal = (b - a).cross(c - a).normalized();
    const Vector3 centre = (a + b + c) / 3;
    const double patch = smooth_noise(centre.x() / 3, centre.z() / 3, 3);
    if (normal.y() < 0.70) return 3;
    if (std::fabs(centre.z() - Valley::middle(centre.x())) < 2.4 + 0.9 * patch) return 2;
    return patch > 0.1 ? 1 : 0;
  }

  void add_valley() {
    std::array<Mesh, 4> ground;
    for (std::uint32_t j = 0; j < rows; ++j) {
      for (std::uint32_t i = 0; i < columns; ++i) {
        const Vector3 a = grid_point(i, j);
        const Vector3 b = grid_point(i, j + 1);
        const Vector3 c = grid_point(i + 1, j + 1);
        const Vector3 d = grid_point(i + 1, j);
        // Alternate the diagonals, so that the grid shows no grain.
        const bool falling = (i + j) % 2 == 0;
        const std::array<std::array<Vector3, 3>, 2> halves{
            {{a, b, falling ? c : d}, {falling ? a : b, c, d}}};
        for (const auto& [p, q, r] : halves) add_triangle(ground[cover_of(p, q, r)], p, q, r);
      }
    }
    const int valley = scenery("valley", {{ground[0], finish::grass},
                                          {ground[1], finish::meadow},
                                          {ground[2], finish::scree},
                                          {ground[3], finish::cliff}});
    collider(valley, {valley, physics_material(0.5), Collider::Kind::mesh});
  }

  /// Draws the block of earth that the valley was cut from.
  void add_earth() {
    Mesh earth;
    const auto add_wall = [&](const Vector3& a, const Vector3& b) {
      const Vector3 foot_a(a.x(), 0, a.z());
      const Vector3 foot_b(b.x(), 0, b.z());
      add_triangle(earth, a, foot_a, foot_b);
      add_triangle(earth, a, foot_b, b);
    };
    for (std::uint32_t i = 0; i < columns; ++i) {
      add_wall(grid_point(i, rows), grid_point(i + 1, rows));
      add_wall(grid_point(i + 1, 0), grid_point(i, 0));
    }
    for (std::uint32_t j = 0; j < rows; ++j) {
      add_wall(grid_point(0, j), grid_point(0, j + 1));
      add_wall(grid_point(columns, j + 1), grid_point(columns, j));
    }
    scenery("earth", {{earth, finish::soil}});
  }

  /// Adds logs across the rocks' path.
  void add_logs() {
    constexpr double density = 650;
    constexpr double bottom = 0.26;
    constexpr double top = 0.18;
    constexpr double half = 1.2;  // of the straight length
    const int shape = capsule_shape(bottom, top, 2 * half);
    const double mass = std::round(density * mass_properties(TaperedCapsule{half, bottom, top}).mass);
    const Mesh trunk = turned({corner(0, -half - bottom), corner(bottom, -half - bottom, 0.2),
                               corner(top, half + top, 0.14), corner(0, half + top)},
                              14);
    const int look = mesh("log", {{trunk, finish::walnut}});
    for (int i = 0; i < 6; ++i) {
      const double x = -7.6 + 1.5 * (i / 2);
      const double z = Valley::middle(x) + (i % 2 == 0 ? -1.75 : 1.75);
      body(numbered("log", i + 1),
           at(x, Valley::height(x, z) + 0.75, z) * turn(X, i % 2 == 0 ? pi / 2 : -pi / 2), {.mass = mass},
           {shape, grip_}, look);
    }
  }

  static constexpr std::array stones{finish::granite, finish::limestone, finish::basalt, finish::sandstone};

  struct Rock {
    int collider_node;
    std::array<int, stones.size()> looks;
    double mass;
  };

  /// Adds one of six cuts of rock, each larger than the one before, in every stone.
  Rock add_cut(int number) {
    constexpr double density = 2600;
    const double size = 0.38 + 0.07 * number;
    const Vector3 half_size = size * Vector3(1.15, 0.78 + 0.05 * (number % 3), 0.95);
    const std::vector<Vector3> corners =
        cut_stone(static_cast<std::uint64_t>(number) + 1, 11 + number, half_size);
    const int faces = geometry(hull(corners));
    const std::string name = numbered("cut", number + 1);
    Rock rock{};
    for (std::size_t i = 0; i < stones.size(); ++i)
      rock.looks[i] = mesh(name + "_" + std::string(stones[i].name), {{faces, stones[i]}});
    rock.collider_node = detached_node(name, rock.looks[0]);
    rock.mass = std::round(density * mass_properties(convex_hull(corners, "a rock")).mass);
    return rock;
  }

  /// Adds rocks that lie loosely over the top of the slope.
  void add_rocks() {
    std::vector<Rock> rocks;
    for (int i = 0; i < 6; ++i) rocks.push_back(add_cut(i));
    for (int number = 0; number < 50; ++number) {
      const int layer = number / 25;
      const int row = number / 5 % 5;
      const int column = number % 5;
      const auto random = [&](std::uint64_t draw) {
        return noise(9000 + static_cast<std::uint64_t>(number) * 8 + draw);
      };
      const Rock& rock = rocks[static_cast<std::size_t>(6 * random(0))];
      const double x = -18.4 + 1.75 * column + 0.3 * random(1);
      const double z = Valley::middle(x) + 1.75 * (row - 2) + 0.3 * random(2);
      const Vector3 axis(random(3) - 0.5, random(4) - 0.5, random(5) - 0.5);
      body(numbered("rock", number + 1),
           at(x, Valley::height(x, z) + 1.05 + 1.7 * layer, z) * turn(axis, 2 * pi * random(6)),
           {.mass = rock.mass}, {rock.collider_node, grip_, Collider::Kind::hull},
           rock.looks[static_cast<std::size_t>(4 * random(7))]);
    }
  }

  int grip_ = 0;
};

}  // namespace

std::vector<SceneFunction> slide_scenes() {
  return {incline, made<RockSlide>};
}

}  // namespace substep::scenes
