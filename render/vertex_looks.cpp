
#include <algorithm>
#include <cmath>

#include "render/body_mesh.h"

namespace substep::render {
namespace {

using Pair = std::array<float, 2>;

/// Returns any unit vector perpendicular to a unit vector.
Vector3 beside(const Vector3& normal) {
  const Vector3 other = std::abs(normal.x()) < 0.7 ? Vector3::UnitX() : Vector3::UnitY();
  return (other - normal * normal.dot(other)).normalized();
}

std::array<float, 4> tangent_of(const Vector3& along, double handedness) {
  return {static_cast<float>(along.x()), static_cast<float>(along.y()), static_cast<float>(along.z()),
          static_cast<float>(handedness)};
}

/// Sums over the triangles at each vertex, by their areas.
struct Sums {
  Vector3 along = Vector3::Zero();   ///< directions in which the first coordinate grows
  Vector3 across = Vector3::Zero();  ///< and the second
  std::array<double, 2> area{};      ///< of the triangles with each set of coordinates, m²
  std::array<double, 2> in_units{};  ///< area in coordinates
};

std::vector<Sums> sums_of(const Mesh& mesh, const std::vector<Vector3>& positions, int set_of_normals) {
  std::vector<Sums> sums(positions.size());
  for (std::size_t set = 0; set < 2; ++set) {
    const std::vector<Pair>& places = mesh.attributes.texture_coordinates[set];
    if (places.empty()) continue;
    for (const Triangle& t : mesh.triangles) {
      const Vector3 ab = positions[t[1]] - positions[t[0]];
      const Vector3 ac = positions[t[2]] - positions[t[0]];
      const auto difference = [&](std::size_t corner, std::size_t coordinate) {
        return static_cast<double>(places[t[corner]][coordinate]) - places[t[0]][coordinate];
      };
      const double u1 = difference(1, 0);
      const double v1 = difference(1, 1);
      const double u2 = difference(2, 0);
      const double v2 = difference(2, 1);
      const double turn = u1 * v2 - u2 * v1;
      const double area = ab.cross(ac).norm() / 2;
      const bool has_slopes = turn != 0 && static_cast<int>(set) == set_of_normals;
      const Vector3 along = has_slopes ? Vector3((v2 * ab - v1 * ac) / turn) : Vector3::Zero();
      const Vector3 across = has_slopes ? Vector3((u1 * ac - u2 * ab) / turn) : Vector3::Zero();
      for (const std::uint32_t corner : t) {
        sums[corner].area[set] += area;
        sums[corner].in_units[set] += std::abs(turn) / 2;
        sums[corner].along += area * along.stableNormalized();
        sums[corner].across += area * across.stableNormalized();
      }
    }
  }
  return sums;
}

}  // namespace

std::vector<LookVertex> look_vertices(const Mesh& mesh, const Matrix3& linear,
                                      const std::vector<Vector3>& positions,
                                      const std::vector<Vector3>& normals, int set_of_normals) {
  std::vector<LookVertex> result(positions.size());
  const std::vector<Sums> sums = sums_of(mesh, positions, set_of_normals);
  const VertexAttributes& attributes = mesh.attributes;
  const double mirror = linear.determinant() < 0 ? -1 : 1;
  for (std::size_t i = 0; i < result.size(); ++i) {
    LookVertex& vertex = result[i];
    for (std::size_t set = 0; set < 2; ++set) {
      if (attributes.texture_coordinates[set].empty()) continue;
      std::copy_n(attributes.texture_coordinates[set][i].begin(), 2, vertex.coordinates.begin() + 2 * set);
      const double area = sums[i].area[set];
      vertex.density[set] = static_cast<float>(area > 0 ? std::sqrt(sums[i].in_units[set] / area) : 0);
    }
    if (!attributes.colors.empty()) vertex.color = attributes.colors[i];
    const Vector3& normal = normals[i];
    if (!attributes.tangents.empty()) {
      const auto& given = attributes.tangents[i];
      const Vector3 turned = (linear * Vector3(given[0], given[1], given[2])).stableNormalized();
      vertex.tangent = tangent_of(turned, given[3] * mirror);
    } else {
      const Vector3 along = (sums[i].along - normal * normal.dot(sums[i].along)).stableNormalized();
      if (!(along.squaredNorm() > 0.5)) {
        vertex.tangent = tangent_of(beside(normal), 1);
        continue;
      }
      // Up on a normal texture is against its second coordinate.
      const bool is_right_handed = normal.cross(along).dot(sums[i].across) <= 0;
      vertex.tangent = tangent_of(along, is_right_handed ? 1 : -1);
    }
  }
  return result;
}

bool needs_looks(const Scene& scene) {
  const auto is_more = [](const Surface& surface) {
    return surface.opacity != Surface::Opacity::opaque || surface.is_unlit ||
           std::ranges::any_of(surface.emission, [](double level) { return level > 0; }) ||
           std::ranges::any_of(surface.textures, [](const Texture& texture) { return texture.image >= 0; });
  };
  return !scene.lights.empty() || std::ranges::any_of(scene.surfaces, is_more) ||
         std::ranges::any_of(scene.meshes, [](const Mesh& mesh) { return !mesh.attributes.colors.empty(); });
}

}  // namespace substep::render
