#include "sim/loading/gltf_nodes.h"

#include <algorithm>
#include <cmath>

#include "sim/loading/file_bytes.h"
#include "sim/loading/gltf_document.h"

namespace substep {
namespace {

constexpr int deepest_node = 256;

// Two mirrored axes are half a turn about the third, and one is that plus all three. A half turn about an
// axis only permutes and negates the quaternion's components, so nothing is rounded.
void make_signs_equal(Quaternion& rotation, Vector3& scale) {
  const int negative = static_cast<int>((scale.array() < 0).count());
  if (negative != 1 && negative != 2) return;
  int odd = 0;  // the axis whose sign differs from the two others'
  while ((scale[odd] < 0) != (negative == 1)) ++odd;
  Quaternion half_turn(0, 0, 0, 0);
  half_turn.vec()[odd] = 1;
  rotation = rotation * half_turn;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis != odd) scale[axis] = -scale[axis];
  }
}

NodeTransform read_transform(const JsonValue& node) {
  if (const auto matrix = node.find("matrix")) {
    for (const char* key : {"translation", "rotation", "scale"}) {
      if (node.find(key)) node.fail("has both 'matrix' and '{}'", key);
    }
    const Eigen::Matrix4d m(matrix->numbers(16).data());
    if (m.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) matrix->fail("its last row must be 0 0 0 1");
    return make_transform(Matrix3(m.topLeftCorner<3, 3>()), Vector3(m.topRightCorner<3, 1>()));
  }
  return make_transform(node.get("translation", Vector3(0, 0, 0), &JsonValue::vector3),
                        node.get("rotation", Quaternion(1, 0, 0, 0), &JsonValue::rotation),
                        node.get("scale", Vector3(1, 1, 1), &JsonValue::vector3));
}

/// Sets what each node's JSON says, and its parent.
void read_each(GltfDocument& document) {
  std::vector<GltfNode>& nodes = document.nodes;
  nodes.resize(document.size_of("nodes"));
  UniqueNames names;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const JsonValue json = document.item_of("nodes", i);
    GltfNode& node = nodes[i];
    node.name = names.add(json.name(fmt::format("node {}", i)));
    node.local = read_transform(json);
    if (!node.local.is_finite()) json.fail("its transform overflows");
    node.mesh = json.find_index("mesh", document.size_of("meshes"), "mesh");
    node.skin = json.find_index("skin", document.size_of("skins"), "skin");
    for (const JsonValue& child : json.items("children")) {
      const int index = child.index(nodes.size(), "node");
      int& parent = nodes[index].parent;
      if (parent >= 0) child.fail("node {} has two parents: it is also a child of node {}", index, parent);
      parent = static_cast<int>(i);
      node.children.push_back(index);
    }
  }
}

/// Sets depths and world transforms, from the roots down.
void place_nodes(GltfDocument& document) {
  std::vector<GltfNode>& nodes = document.nodes;
  std::vector<int>& order = document.parents_first;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (nodes[i].parent < 0) order.push_back(static_cast<int>(i));
  }
  for (std::size_t next = 0; next < order.size(); ++next) {
    GltfNode& node = nodes[order[next]];
    const JsonValue json = document.item_of("nodes", order[next]);
    node.depth = node.parent < 0 ? 1 : nodes[node.parent].depth + 1;
    if (node.depth > deepest_node) json.fail("lies deeper than {} levels of nodes", deepest_node);
    node.world = node.parent < 0 ? node.local : compose(nodes[node.parent].world, node.local);
    if (!node.world.is_finite()) json.fail("its transform overflows");
    order.insert(order.end(), node.children.begin(), node.children.end());
  }
  // Every node has one parent at most, so a node that no root leads to lies on a cycle or below one.
  const auto lost = std::ranges::find(nodes, 0, &GltfNode::depth);
  if (lost != nodes.end()) {
    document.item_of("nodes", lost - nodes.begin()).fail("is its own ancestor: the nodes form a cycle");
  }
}

/// Sets the default scene and its nodes.
void choose_scene(GltfDocument& document) {
  std::vector<GltfNode>& nodes = document.nodes;
  const auto scene = document.root().find("scene");
  if (scene || document.size_of("scenes") > 0) {
    document.scene = scene ? document.index_of(*scene, "scenes", "scene") : 0;
    for (const JsonValue& node : document.item_of("scenes", document.scene).items("nodes")) {
      const int index = node.index(nodes.size(), "node");
      const int parent = nodes[index].parent;
      if (parent >= 0) node.fail("node {} is not a root: it is a child of node {}", index, parent);
      nodes[index].in_scene = true;
    }
  }
  for (const int index : document.parents_first) {
    GltfNode& node = nodes[index];
    if (node.parent >= 0) node.in_scene = nodes[node.parent].in_scene;
    if (node.parent < 0 && document.scene < 0) node.in_scene = true;
  }
}

}  // namespace

Pose NodeTransform::rigid() const {
  if (!mirrors()) return {translation, rotation};
  // −1 on all axes and half a turn about x are a mirror image in x.
  return {translation, rotation * Quaternion(0, -1, 0, 0)};
}

NodeTransform make_transform(const Vector3& translation, const Quaternion& rotation, const Vector3& scale) {
  NodeTransform transform;
  transform.translation = translation;
  transform.rotation = rotation;
  transform.scale = scale;
  make_signs_equal(transform.rotation, transform.scale);
  transform.linear = transform.rotation.toRotationMatrix() * transform.scale.asDiagonal();
  return transform;
}

NodeTransform make_transform(const Matrix3& linear, const Vector3& translation) {
  NodeTransform transform;
  transform.linear = linear;
  transform.translation = translation;
  transform.sheared = true;
  transform.has_rotation = false;
  const Vector3 lengths{linear.col(0).norm(), linear.col(1).norm(), linear.col(2).norm()};
  if (!(lengths.minCoeff() > 0)) return transform;  // an axis is lost, and with it the rotation
  Matrix3 axes = linear;
  for (int i = 0; i < 3; ++i) axes.col(i) /= lengths[i];
  const double skew =
      std::max({std::fabs(axes.col(0).dot(axes.col(1))), std::fabs(axes.col(1).dot(axes.col(2))),
                std::fabs(axes.col(2).dot(axes.col(0)))});
  if (!(skew <= 1e-6)) return transform;
  transform.sheared = false;
  transform.has_rotation = true;
  transform.scale = lengths;
  if (axes.col(0).cross(axes.col(1)).dot(axes.col(2)) < 0) {
    axes = -axes;
    transform.scale = -lengths;
  }
  axes.col(1) = (axes.col(1) - axes.col(0).dot(axes.col(1)) * axes.col(0)).normalized();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  transform.rotation = Quaternion(axes).normalized();
  return transform;
}

NodeTransform compose(const NodeTransform& outer, const NodeTransform& inner) {
  const bool uniform = outer.scale.x() == outer.scale.y() && outer.scale.y() == outer.scale.z();
  const bool unturned = inner.rotation.w() == 1;
  if (!outer.sheared && !inner.sheared && (uniform || unturned)) {
    const Vector3 translation =
        outer.rotation * outer.scale.cwiseProduct(inner.translation) + outer.translation;
    return make_transform(translation, (outer.rotation * inner.rotation).normalized(),
                          outer.scale.cwiseProduct(inner.scale));
  }
  NodeTransform transform = make_transform(Matrix3(outer.linear * inner.linear),
                                           Vector3(outer.linear * inner.translation + outer.translation));
  if (transform.sheared && outer.has_rotation && inner.has_rotation) {
    transform.has_rotation = true;
    transform.rotation = (outer.rotation * inner.rotation).normalized();
  }
  return transform;
}

void read_nodes(GltfDocument& document) {
  read_each(document);
  place_nodes(document);
  choose_scene(document);
}

}  // namespace substep
