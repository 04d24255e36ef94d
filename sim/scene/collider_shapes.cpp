#include "sim/scene/collider_shapes.h"

#include <fmt/format.h>

#include <cmath>

#include "sim/geometry/convex_hull.h"

namespace substep {
namespace {

// Scales that passed through single precision differ in their seventh digit.
bool is_equal_scale(double a, double b) {
  return std::fabs(a - b) <= 1e-5 * std::max(a, b);
}

double uniform_scale(const Vector3& scale, const char* shape, const JsonValue& place) {
  if (!is_equal_scale(scale.x(), scale.y()) || !is_equal_scale(scale.y(), scale.z())) {
    place.fail(fmt::format("a {} cannot be scaled by {} {} {}: use one factor, or a convex hull of a mesh",
                           shape, scale.x(), scale.y(), scale.z()));
  }
  return scale.x();
}

Shape capsule(const ImplicitShape& shape, double scale, const JsonValue& place) {
  if (shape.radius_bottom != shape.radius_top) {
    place.fail(
        "a tapered capsule is not modelled: give both ends one radius, or use a convex hull of a mesh");
  }
  const double half_length = shape.height / 2 * scale;
  const double radius = shape.radius_bottom * scale;
  if (half_length == 0) return Sphere{radius};
  return Capsule{half_length, radius};
}

void gather(const GltfDocument& document, const std::vector<GltfMesh>& meshes, int index,
            const NodeTransform& placement, const JsonValue& place, std::vector<Vector3>& points) {
  const GltfNode& node = document.nodes[index];
  if (node.skinned) {
    place.fail(
        fmt::format("its geometry, node {} ('{}'), is skinned, which is not modelled", index, node.name));
  }
  if (node.mesh >= 0) {
    for (const GltfPrimitive& primitive : meshes[node.mesh].primitives) {
      for (const Vector3& position : primitive.positions) {
        points.push_back(placement.linear * position + placement.translation);
      }
    }
  }
  for (const int child : node.children) {
    gather(document, meshes, child, compose(placement, document.nodes[child].local), place, points);
  }
}

}  // namespace

Shape implicit_shape(const ImplicitShape& shape, const Vector3& signed_scale, const JsonValue& place,
                     std::vector<std::string>& warnings) {
  const Vector3 scale = signed_scale.cwiseAbs();
  if (!(scale.minCoeff() > 0)) place.fail("its node's scale is 0 along an axis");
  switch (shape.kind) {
    case ImplicitShape::Kind::sphere:
      return Sphere{shape.radius_bottom * uniform_scale(scale, "sphere", place)};
    case ImplicitShape::Kind::box:
      return box(shape.size.cwiseProduct(scale));
    case ImplicitShape::Kind::capsule:
      return capsule(shape, uniform_scale(scale, "capsule", place), place);
    case ImplicitShape::Kind::cylinder: {
      const Polytope prism = cylinder(shape.height, shape.radius_bottom, shape.radius_top);
      return scale == Vector3::Ones() ? prism : scaled(prism, scale);
    }
    case ImplicitShape::Kind::plane:
      break;
  }
  if (shape.bounded) warnings.push_back(place.path() + ": the plane's size is ignored: it is infinite");
  if (shape.double_sided) {
    warnings.push_back(place.path() + ": the plane's second side is ignored: all below it is solid");
  }
  return Plane{};
}

Shape hull_of_node(const GltfDocument& document, const std::vector<GltfMesh>& meshes, int node,
                   const Vector3& scale, const JsonValue& place) {
  // The mesh is that of the node in its own frame: where the node itself stands does not matter.
  std::vector<Vector3> points;
  gather(document, meshes, node, make_transform(Vector3::Zero(), Quaternion::Identity(), scale), place,
         points);
  if (points.empty()) {
    place.fail(fmt::format("its geometry, node {} ('{}'), has no mesh of triangles", node,
                           document.nodes[node].name));
  }
  return convex_hull(points, fmt::format("{}: {}", document.file_name, place.path()));
}

}  // namespace substep
