#include "mesh.h"

#include <map>
#include <numbers>
#include <utility>

#include "sim/geometry/convex_hull.h"
#include "sim/math/rotation.h"

namespace substep::scenes {
namespace {

/// Returns 2^halvings + 1 unit directions from a to b along the shorter arc, at equal angles.
std::vector<Vector3> arc(const Vector3& a, const Vector3& b, int halvings) {
  std::vector<Vector3> directions{a, b};
  for (int i = 0; i < halvings; ++i) {
    std::vector<Vector3> finer;
    for (std::size_t j = 0; j + 1 < directions.size(); ++j) {
      finer.push_back(directions[j]);
      finer.push_back((directions[j] + directions[j + 1]).normalized());
    }
    finer.push_back(directions.back());
    directions = std::move(finer);
  }
  return directions;
}

Vector3 face_normal(const Polyhedron& solid, const std::vector<int>& face) {
  const Vector3& a = solid.vertices[face[0]];
  return (solid.vertices[face[1]] - a).cross(solid.vertices[face[2]] - a).normalized();
}

/// A point of a profile in the plane (radius, y, 0) with its outward normal.
struct ProfileVertex {
  Vector3 point;
  Vector3 normal;
};

/// Appends the arc of a fillet at `corner`, between the outward normals of the segments before and after it.
void add_fillet(std::vector<ProfileVertex>& run, const Vector3& corner, const Vector3& before,
                const Vector3& after, double fillet) {
  // The arc touches both segments; its centre lies inside the solid at a convex corner, outside at a concave
  // one.
  const double side = before.cross(after).z() > 0 ? 1 : -1;
  const Vector3 centre = corner - side * fillet * (before + after) / (1 + before.dot(after));
  // Give sharp turns and large fillets more vertices.
  const int halvings = (before.dot(after) > 0.75 ? 1 : 2) + (fillet > 0.04 ? 1 : 0);
  for (const Vector3& normal : arc(before, after, halvings)) {
    const Vector3 position = centre + side * fillet * normal;
    // Two fillets that meet would give two vertices one position.
    if (!run.empty() && (run.back().point - position).norm() < 1e-9) continue;
    run.push_back({position, normal});
  }
}

/// Returns smooth runs of vertices. Runs are not joined, so that a sharp corner keeps its two normals.
std::vector<std::vector<ProfileVertex>> smooth_runs(const Profile& profile, bool closed) {
  const int count = static_cast<int>(profile.size());
  const int segments = closed ? count : count - 1;
  const auto point = [&](int i) {
    const ProfilePoint& p = profile[(i + count) % count];
    return Vector3(p.radius, p.y, 0);
  };
  const auto outward = [&](int segment) {
    const Vector3 along = (point(segment + 1) - point(segment)).normalized();
    return Vector3(along.y(), -along.x(), 0);
  };

  std::vector<std::vector<ProfileVertex>> runs(1);
  const int first = closed ? 0 : 1;
  if (!closed) runs.back().push_back({point(0), outward(0)});
  for (int i = first; i < (closed ? count : segments); ++i) {
    const Vector3 before = outward(i - 1);
    const Vector3 after = outward(i);
    if (profile[i].fillet == 0) {
      runs.back().push_back({point(i), before});
      runs.push_back({{point(i), after}});
    } else {
      add_fillet(runs.back(), point(i), before, after, profile[i].fillet);
    }
  }
  if (!closed) {
    const Vector3 end = point(count - 1);
    if ((runs.back().back().point - end).norm() > 1e-9) runs.back().push_back({end, outward(segments - 1)});
  } else {
    runs.back().push_back(runs.front().front());
    // The last run ends with the first corner, which the first run has alone.
    if (profile[0].fillet == 0) runs.erase(runs.begin());
  }
  return runs;
}

}  // namespace

Mesh& Mesh::operator+=(const Mesh& other) {
  const auto base = static_cast<std::uint32_t>(positions.size());
  positions.insert(positions.end(), other.positions.begin(), other.positions.end());
  normals.insert(normals.end(), other.normals.begin(), other.normals.end());
  for (const auto& t : other.triangles) triangles.push_back({base + t[0], base + t[1], base + t[2]});
  return *this;
}

Mesh operator*(const Pose& pose, Mesh mesh) {
  for (Vector3& p : mesh.positions) p = pose * p;
  for (Vector3& n : mesh.normals) n = pose.orientation * n;
  return mesh;
}

Polyhedron box(const Vector3& size) {
  const double u = size.x() / 2;
  const double v = size.z() / 2;
  return prism({{-u, -v}, {u, -v}, {u, v}, {-u, v}}, size.y());
}

Polyhedron prism(const Outline& outline, double height, double top_scale) {
  const int n = static_cast<int>(outline.size());
  Polyhedron solid;
  for (const PlanePoint& p : outline) solid.vertices.emplace_back(p.u, -height / 2, -p.v);
  for (const PlanePoint& p : outline)
    solid.vertices.emplace_back(top_scale * p.u, height / 2, -top_scale * p.v);
  std::vector<int> bottom;
  std::vector<int> top;
  for (int i = 0; i < n; ++i) {
    bottom.push_back(n - 1 - i);
    top.push_back(n + i);
  }
  solid.faces = {bottom, top};
  for (int i = 0; i < n; ++i) solid.faces.push_back({i, (i + 1) % n, n + (i + 1) % n, n + i});
  return solid;
}

namespace {

/// Vertices of a rounded corner by their distances i, j, k from the sides of the patch.
using Patch = std::map<std::array<int, 3>, std::uint32_t>;

/// Adds a patch of a ball that touches a corner's three faces: directions i n0 + j n1 + k n2, i + j + k =
/// segments, so that edge strips and faces find their vertices on the patch's rims.
Patch add_patch(Mesh& mesh, const Vector3& corner, const Matrix3& planes, double radius, int segments) {
  Patch patch;
  const Vector3 centre = corner - planes.inverse() * Vector3::Constant(radius);
  for (int i = 0; i <= segments; ++i) {
    for (int j = 0; i + j <= segments; ++j) {
      const int k = segments - i - j;
      const Vector3 direction = (planes.transpose() * Vector3(i, j, k)).normalized();
      patch[{i, j, k}] = static_cast<std::uint32_t>(mesh.positions.size());
      mesh.positions.emplace_back(centre + radius * direction);
      mesh.normals.push_back(direction);
    }
  }
  for (int i = 0; i < segments; ++i) {
    for (int j = 0; i + j < segments; ++j) {
      const int k = segments - i - j;
      const auto a = patch[{i, j, k}];
      const auto b = patch[{i + 1, j, k - 1}];
      const auto c = patch[{i, j + 1, k - 1}];
      mesh.triangles.push_back({a, b, c});
      if (k > 1) mesh.triangles.push_back({b, patch[{i + 1, j + 1, k - 2}], c});
    }
  }
  return patch;
}

}  // namespace

Mesh rounded(const Polyhedron& solid, double radius, int segments) {
  const int vertex_count = static_cast<int>(solid.vertices.size());
  std::vector<Vector3> face_normals;
  std::vector<std::vector<int>> faces_at(vertex_count);
  std::map<std::pair<int, int>, int> face_left_of;  // directed edge → the face that has it
  for (int f = 0; f < static_cast<int>(solid.faces.size()); ++f) {
    const std::vector<int>& face = solid.faces[f];
    face_normals.push_back(face_normal(solid, face));
    for (std::size_t i = 0; i < face.size(); ++i) {
      faces_at[face[i]].push_back(f);
      face_left_of[{face[i], face[(i + 1) % face.size()]}] = f;
    }
  }

  Mesh mesh;
  std::vector<Patch> patches;
  for (int v = 0; v < vertex_count; ++v) {
    std::vector<int>& f = faces_at[v];
    Matrix3 planes;
    for (int i = 0; i < 3; ++i) planes.row(i) = face_normals[f[i]];
    if (planes.determinant() < 0) {
      std::swap(f[1], f[2]);
      planes.row(1).swap(planes.row(2));
    }
    patches.push_back(add_patch(mesh, solid.vertices[v], planes, radius, segments));
  }
  // Returns the vertex of v's patch `step` steps from face f towards face g.
  const auto rim = [&](int v, int f, int g, int step) {
    std::array<int, 3> index{};
    for (int i = 0; i < 3; ++i) {
      if (faces_at[v][i] == f) index[i] = segments - step;
      if (faces_at[v][i] == g && g != f) index[i] = step;
    }
    return patches[v].at(index);
  };

  for (const auto& [edge, f] : face_left_of) {
    const auto [u, v] = edge;
    if (u > v) continue;
    const int g = face_left_of.at({v, u});
    for (int s = 0; s < segments; ++s) {
      const auto a = rim(u, f, g, s);
      const auto b = rim(u, f, g, s + 1);
      const auto c = rim(v, f, g, s + 1);
      const auto d = rim(v, f, g, s);
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    }
  }
  for (int f = 0; f < static_cast<int>(solid.faces.size()); ++f) {
    const std::vector<int>& face = solid.faces[f];
    for (std::size_t i = 1; i + 1 < face.size(); ++i)
      mesh.triangles.push_back({rim(face[0], f, f, 0), rim(face[i], f, f, 0), rim(face[i + 1], f, f, 0)});
  }
  return mesh;
}

Mesh faceted(const Polyhedron& solid) {
  Mesh mesh;
  for (const std::vector<int>& face : solid.faces) {
    const auto base = static_cast<std::uint32_t>(mesh.positions.size());
    for (const int v : face) {
      mesh.positions.push_back(solid.vertices[v]);
      mesh.normals.push_back(face_normal(solid, face));
    }
    for (std::uint32_t i = 1; i + 1 < face.size(); ++i)
      mesh.triangles.push_back({base, base + i, base + i + 1});
  }
  return mesh;
}

Mesh turned(const Profile& profile, int sides, bool closed) {
  Mesh mesh;
  for (const std::vector<ProfileVertex>& run : smooth_runs(profile, closed)) {
    const auto base = static_cast<std::uint32_t>(mesh.positions.size());
    const auto n = static_cast<std::uint32_t>(sides);
    for (const ProfileVertex& v : run) {
      for (int i = 0; i < sides; ++i) {
        // Counter-clockwise seen from above: +X towards −Z.
        const auto [s, c] = sine_cosine(2 * std::numbers::pi * i / sides);
        mesh.positions.emplace_back(c * v.point.x(), v.point.y(), -s * v.point.x());
        mesh.normals.emplace_back(c * v.normal.x(), v.normal.y(), -s * v.normal.x());
      }
    }
    for (std::uint32_t ring = 0; ring + 1 < run.size(); ++ring) {
      for (std::uint32_t i = 0; i < n; ++i) {
        const std::uint32_t a = base + ring * n + i;
        const std::uint32_t b = base + ring * n + (i + 1) % n;
        // At the axis a quad has only one triangle.
        if (run[ring].point.x() > 1e-9) mesh.triangles.push_back({a, b, b + n});
        if (run[ring + 1].point.x() > 1e-9) mesh.triangles.push_back({a, b + n, a + n});
      }
    }
  }
  return mesh;
}

Mesh ball(double radius, int sides) {
  return turned({{0, -radius}, {radius, -radius, radius}, {radius, radius, radius}, {0, radius}}, sides);
}

Mesh rod(double length, double radius, double fillet, int sides) {
  return turned(
      {{0, -length / 2}, {radius, -length / 2, fillet}, {radius, length / 2, fillet}, {0, length / 2}},
      sides);
}

Mesh ring(double inner, double outer, double half_height, double fillet, int sides) {
  return turned({corner(inner, -half_height, fillet), corner(outer, -half_height, fillet),
                 corner(outer, half_height, fillet), corner(inner, half_height, fillet)},
                sides, true);
}

Mesh hull(std::span<const Vector3> points) {
  const Polytope solid = convex_hull(points, "a modelled hull");
  Mesh mesh;
  mesh.positions = solid.vertices;
  for (std::size_t face = 0; face < solid.face_count(); ++face) {
    const std::uint32_t first = solid.face_begin[face];
    for (std::uint32_t i = first + 1; i + 1 < solid.face_begin[face + 1]; ++i)
      mesh.triangles.push_back(
          {solid.face_vertices[first], solid.face_vertices[i], solid.face_vertices[i + 1]});
  }
  return mesh;
}

double noise(std::uint64_t index) {
  // The finaliser of splitmix64 (Steele, Lea, Flood 2014).
  std::uint64_t z = (index + 1) * 0x9e3779b97f4a7c15U;
  z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9U;
  z = (z ^ z >> 27) * 0x94d049bb133111ebU;
  z = z ^ z >> 31;
  return static_cast<double>(z >> 11) / 9007199254740992.0;
}

Pose turn(const Vector3& axis, double angle) {
  return {Vector3::Zero(), rotation_quaternion(axis.normalized() * angle)};
}

Pose at(double x, double y, double z) {
  return {Vector3(x, y, z), Quaternion::Identity()};
}

Pose at(const Vector3& point) {
  return {point, Quaternion::Identity()};
}

}  // namespace substep::scenes
