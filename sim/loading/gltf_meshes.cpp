#include "sim/loading/gltf_meshes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>
#include <string_view>

#include "sim/loading/file_bytes.h"

namespace substep {
namespace {

// glTF's modes of primitives: points and three kinds of lines come before, strips of triangles between.
constexpr std::uint64_t mode_triangles = 4;
constexpr std::uint64_t mode_fan = 6;

/// A type of the numbers in an accessor.
struct Component {
  std::uint64_t type;
  std::uint64_t size;
  const char* name;
};

constexpr std::array<Component, 6> components{{{5120, 1, "byte"},
                                               {5121, 1, "unsigned byte"},
                                               {5122, 2, "short"},
                                               {5123, 2, "unsigned short"},
                                               {5125, 4, "unsigned int"},
                                               {5126, 4, "float"}}};

/// The form that the elements of an accessor must have.
struct Layout {
  const char* type;
  std::size_t width;                      ///< numbers in an element
  std::vector<std::uint64_t> components;  ///< types that are read
  bool normalized = false;                ///< divides whole numbers by their largest
};

// Reads accessors; checks each down to its bytes.
class AccessorReader {
 public:
  explicit AccessorReader(const GltfDocument& document) : document_(document) {
    for (const std::string_view buffer : document.buffers) most_ += 2 * buffer.size();
  }

  /// Returns vectors that may not be finite.
  std::vector<Vector3> vectors(const JsonValue& reference) {
    const std::vector<double> values = numbers(reference, {"VEC3", 3, {5126}});
    std::vector<Vector3> result;
    for (std::size_t i = 0; i < values.size(); i += 3) result.emplace_back(values.data() + i);
    return result;
  }

  /// Returns the numbers of `count` elements, one element after the other. Messages call the elements' owner
  /// `other`.
  std::vector<double> finite_numbers(const JsonValue& reference, const Layout& layout, std::size_t count,
                                     const char* other) {
    std::vector<double> result = numbers(reference, layout);
    if (result.size() != layout.width * count)
      reference.fail("has another number of elements than {}", other);
    for (std::size_t i = 0; i < result.size(); ++i) {
      if (!std::isfinite(result[i])) reference.fail("element {} is not finite", i / layout.width);
    }
    return result;
  }

  /// Returns rows of `width` floats, one for each vertex; numbers that the file lacks are 1.
  template <std::size_t width>
  std::vector<std::array<float, width>> rows(const JsonValue& reference, const Layout& layout,
                                             std::size_t vertices) {
    const std::vector<double> values = finite_numbers(reference, layout, vertices, "POSITION");
    std::vector<std::array<float, width>> rows(vertices);
    for (std::size_t i = 0; i < vertices; ++i) {
      rows[i].fill(1);
      for (std::size_t k = 0; k < layout.width; ++k)
        rows[i][k] = static_cast<float>(values[layout.width * i + k]);
    }
    return rows;
  }

  std::vector<std::uint32_t> indices(const JsonValue& reference, std::size_t vertices) {
    std::vector<std::uint32_t> result;
    for (const double index : numbers(reference, {"SCALAR", 1, {5121, 5123, 5125}})) {
      if (index >= static_cast<double>(vertices)) {
        reference.fail("index {} of triangle {} is out of range: the primitive has {} vertices", index,
                       result.size() / 3, vertices);
      }
      result.push_back(static_cast<std::uint32_t>(index));
    }
    return result;
  }

 private:
  static const Component& component_of(const JsonValue& type, const Layout& layout,
                                       const JsonValue& reference) {
    const std::uint64_t code = type.integer(0xffff);
    const auto* const component = std::ranges::find(components, code, &Component::type);
    if (component == components.end() ||
        std::ranges::find(layout.components, code) == layout.components.end()) {
      type.fail("is {} ({}), which cannot be read here ({})", code,
                component == components.end() ? "unknown" : component->name, reference.path());
    }
    return *component;
  }

  /// Returns the elements' numbers, one element after the other.
  std::vector<double> numbers(const JsonValue& reference, const Layout& layout) {
    const JsonValue accessor = document_.target_of(reference, "accessors", "accessor");
    if (accessor.find("sparse")) accessor.fail("is sparse, which is not read; export it without");
    if (accessor.require("type").text() != layout.type)
      accessor.require("type").fail("must be {} here ({})", layout.type, reference.path());
    const Component& component = component_of(accessor.require("componentType"), layout, reference);
    const std::uint64_t count = accessor.require("count").integer(0xffffffff);
    if (count == 0) accessor.require("count").fail("is 0");

    const JsonValue view_reference = accessor.require("bufferView");
    const std::string_view bytes = buffer_view(document_, view_reference);
    const JsonValue view = document_.target_of(view_reference, "bufferViews", "buffer view");
    const std::uint64_t size = component.size * layout.width;
    std::uint64_t stride = size;
    if (const auto given = view.find("byteStride")) {
      stride = given->integer(252);
      if (stride < size || stride % component.size != 0)
        given->fail("is {}, but its elements have {} bytes", stride, size);
    }
    const auto offset_in = [](const JsonValue& object) {
      const auto value = object.find("byteOffset");
      return value ? value->integer(std::uint64_t{1} << 40) : 0;
    };
    const std::uint64_t offset = offset_in(accessor);
    if ((offset_in(view) + offset) % component.size != 0)
      accessor.fail("does not begin at a multiple of {} bytes", component.size);
    const std::uint64_t end = offset + stride * (count - 1) + size;
    if (end > bytes.size()) accessor.fail("ends at byte {}, but its buffer view has {}", end, bytes.size());
    read_ += count;
    if (read_ > most_) {
      reference.fail(
          "with it the meshes have more than {} vertices and indices, two for each byte and two million",
          most_);
    }
    return numbers_at(bytes.data() + offset, count, stride, component, layout);
  }

  static std::vector<double> numbers_at(const char* begin, std::uint64_t count, std::uint64_t stride,
                                        const Component& component, const Layout& layout) {
    const double unit = !layout.normalized ? 1 : component.size == 1 ? 0xff : 0xffff;
    std::vector<double> result;
    result.reserve(count * layout.width);
    for (std::uint64_t i = 0; i < count; ++i) {
      for (std::size_t k = 0; k < layout.width; ++k) {
        const std::uint32_t bits = little_endian(begin + i * stride + k * component.size, component.size);
        result.push_back(component.type == 5126 ? std::bit_cast<float>(bits) : bits / unit);
      }
    }
    return result;
  }

  const GltfDocument& document_;
  // Many primitives may share an accessor, so that a small file can need much memory.
  std::uint64_t most_ = 2'000'000;
  std::uint64_t read_ = 0;
};

std::vector<SkinInfluence> influences(const JsonValue& attributes, std::size_t vertices,
                                      AccessorReader& accessors) {
  if (!attributes.find("JOINTS_0") && !attributes.find("WEIGHTS_0")) return {};
  if (attributes.find("JOINTS_1"))
    attributes.warn("more than four joints hold a vertex; the first four count");
  const JsonValue given = attributes.require("WEIGHTS_0");
  const std::vector<double> joints = accessors.finite_numbers(
      attributes.require("JOINTS_0"), {"VEC4", 4, {5121, 5123}}, vertices, "POSITION");
  const std::vector<double> weights =
      accessors.finite_numbers(given, {"VEC4", 4, {5121, 5123, 5126}, true}, vertices, "POSITION");
  std::vector<SkinInfluence> result(vertices);
  for (std::size_t i = 0; i < result.size(); ++i) {
    double sum = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      if (!(weights[4 * i + k] >= 0)) given.fail("element {} has a negative weight", i);
      result[i].joints[k] = static_cast<std::uint16_t>(joints[4 * i + k]);
      sum += weights[4 * i + k];
    }
    for (std::size_t k = 0; k < 4 && sum > 0; ++k) result[i].weights[k] = weights[4 * i + k] / sum;
  }
  return result;
}

VertexAttributes attributes_in(const GltfDocument& document, const JsonValue& attributes,
                               std::size_t vertices, AccessorReader& accessors) {
  const std::vector<std::uint64_t> fractions{5126, 5121, 5123};
  VertexAttributes read;
  for (std::size_t set = 0; set < read.texture_coordinates.size(); ++set) {
    if (const auto given = attributes.find(set == 0 ? "TEXCOORD_0" : "TEXCOORD_1")) {
      read.texture_coordinates[set] = accessors.rows<2>(*given, {"VEC2", 2, fractions, true}, vertices);
    }
  }
  if (const auto given = attributes.find("COLOR_0")) {
    const JsonValue accessor = document.target_of(*given, "accessors", "accessor");
    const bool has_alpha = accessor.require("type").text() == "VEC4";
    const Layout layout{has_alpha ? "VEC4" : "VEC3", has_alpha ? 4U : 3U, fractions, true};
    read.colors = accessors.rows<4>(*given, layout, vertices);
  }
  if (const auto given = attributes.find("TANGENT")) {
    read.tangents = accessors.rows<4>(*given, {"VEC4", 4, {5126}}, vertices);
  }
  return read;
}

// The corners of triangles, strips or fans as triangles.
std::vector<Triangle> triangles_of(std::uint64_t mode, std::span<const std::uint32_t> corners) {
  const std::size_t step = mode == mode_triangles ? 3 : 1;
  std::vector<Triangle> triangles;
  for (std::size_t i = 0; i + 2 < corners.size(); i += step) {
    Triangle& triangle = triangles.emplace_back(Triangle{corners[i], corners[i + 1], corners[i + 2]});
    if (mode == mode_fan) {
      triangle[0] = corners[0];
    } else if (mode != mode_triangles && i % 2 != 0) {
      std::swap(triangle[0], triangle[1]);
    }
  }
  return triangles;
}

// Sets normals of length 1; none where one has no direction, as if the file had given none.
void read_normals(const JsonValue& primitive, const JsonValue& reference, AccessorReader& accessors,
                  Mesh& mesh) {
  mesh.normals = accessors.vectors(reference);
  if (mesh.normals.size() != mesh.positions.size())
    reference.fail("has another number of elements than POSITION");
  for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
    if (!mesh.normals[i].allFinite()) primitive.fail("normal {} is not finite", i);
    const double length = mesh.normals[i].norm();
    if (!(length > 0)) return mesh.normals.clear();
    mesh.normals[i] /= length;
  }
}

// Reads a primitive; returns nothing for points and lines.
std::optional<GltfPrimitive> read_primitive(const GltfDocument& document, const JsonValue& primitive,
                                            AccessorReader& accessors) {
  GltfPrimitive read;
  const auto given_mode = primitive.find("mode");
  const std::uint64_t mode = given_mode ? given_mode->integer(mode_fan) : mode_triangles;
  if (primitive.extension("KHR_draco_mesh_compression")) {
    primitive.fail("is compressed, which is not read; export it without compression");
  }
  const JsonValue attributes = primitive.require("attributes");
  const JsonValue position = attributes.require("POSITION");
  read.surface = primitive.find_index("material", document.size_of("materials"), "material");
  if (read.surface >= 0) {
    read.double_sided =
        document.item_of("materials", read.surface).get("doubleSided", false, &JsonValue::boolean);
  }
  if (mode < mode_triangles) return std::nullopt;

  read.positions = accessors.vectors(position);
  const auto lost = std::ranges::find_if_not(read.positions, [](const Vector3& p) { return p.allFinite(); });
  if (lost != read.positions.end()) {
    primitive.fail("vertex {} is not finite: POSITION holds a NaN or an infinity; export the mesh again",
                   lost - read.positions.begin());
  }
  if (const auto normal = attributes.find("NORMAL")) read_normals(primitive, *normal, accessors, read);
  read.influences = influences(attributes, read.positions.size(), accessors);
  read.attributes = attributes_in(document, attributes, read.positions.size(), accessors);
  std::vector<std::uint32_t> corners(read.positions.size());
  if (const auto indices = primitive.find("indices")) {
    corners = accessors.indices(*indices, read.positions.size());
  } else {
    std::iota(corners.begin(), corners.end(), 0U);
  }
  if (corners.size() < 3 || (mode == mode_triangles && corners.size() % 3 != 0)) {
    primitive.fail("{} corners make no whole triangles", corners.size());
  }
  read.triangles = triangles_of(mode, corners);
  return read;
}

}  // namespace

std::size_t GltfMesh::size() const {
  std::size_t size = 0;
  for (const GltfPrimitive& primitive : primitives) {
    size += primitive.positions.size() + primitive.triangles.size();
  }
  return size;
}

std::vector<GltfSkin> read_skins(const GltfDocument& document) {
  std::vector<GltfSkin> skins;
  AccessorReader accessors(document);
  for (const JsonValue& json : document.root().items("skins")) {
    GltfSkin& skin = skins.emplace_back();
    for (const JsonValue& joint : json.require("joints").items()) {
      skin.joints.push_back(joint.index(document.nodes.size(), "node"));
    }
    skin.joint_from_mesh.resize(skin.joints.size());
    const auto given = json.find("inverseBindMatrices");
    if (!given) continue;
    const std::vector<double> entries =
        accessors.finite_numbers(*given, {"MAT4", 16, {5126}}, skin.joints.size(), "'joints'");
    for (std::size_t joint = 0; joint < skin.joints.size(); ++joint) {
      const Eigen::Map<const Eigen::Matrix4d> matrix(entries.data() + 16 * joint);
      skin.joint_from_mesh[joint] =
          make_transform(Matrix3(matrix.topLeftCorner<3, 3>()), Vector3(matrix.topRightCorner<3, 1>()));
    }
  }
  return skins;
}

std::vector<GltfMesh> read_meshes(const GltfDocument& document) {
  std::vector<GltfMesh> meshes;
  AccessorReader accessors(document);
  for (const JsonValue& json : document.root().items("meshes")) {
    GltfMesh& mesh = meshes.emplace_back();
    bool morphs = false;
    for (const JsonValue& primitive : json.require("primitives").items()) {
      morphs = morphs || primitive.find("targets");
      std::optional<GltfPrimitive> read = read_primitive(document, primitive, accessors);
      if (!read) primitive.warn("points and lines are left out");
      if (read) mesh.primitives.push_back(std::move(*read));
    }
    if (morphs) json.warn("morph targets are ignored");
  }
  return meshes;
}

Mesh posed(const GltfDocument& document, const GltfSkin& skin, const GltfPrimitive& primitive,
           const JsonValue& node) {
  std::vector<NodeTransform> world_from_mesh;
  for (std::size_t joint = 0; joint < skin.joints.size(); ++joint) {
    world_from_mesh.push_back(compose(document.nodes[skin.joints[joint]].world, skin.joint_from_mesh[joint]));
  }
  Mesh mesh = primitive;
  mesh.attributes.tangents.clear();  // the skeleton turns them
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const SkinInfluence& influence = primitive.influences[i];
    Matrix3 linear = Matrix3::Zero();
    Vector3 translation = Vector3::Zero();
    for (std::size_t k = 0; k < 4; ++k) {
      if (influence.weights[k] == 0) continue;
      if (influence.joints[k] >= skin.joints.size()) {
        node.fail("vertex {} is held by joint {} of its skin, which has {}", i, influence.joints[k],
                  skin.joints.size());
      }
      const NodeTransform& joint = world_from_mesh[influence.joints[k]];
      linear += influence.weights[k] * joint.linear;
      translation += influence.weights[k] * joint.translation;
    }
    mesh.positions[i] = linear * primitive.positions[i] + translation;
    if (!mesh.positions[i].allFinite()) node.fail("vertex {} of its skin overflows", i);
    if (mesh.normals.empty()) continue;
    mesh.normals[i] = (linear.inverse().transpose() * primitive.normals[i]).stableNormalized();
  }
  if (!std::ranges::all_of(mesh.normals, [](const Vector3& normal) { return normal.squaredNorm() > 0.5; })) {
    mesh.normals.clear();
  }
  return mesh;
}

}  // namespace substep
