#include "sim/loading/gltf_meshes.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>
#include <string_view>

namespace substep {
namespace {

// glTF's modes of primitives: points and three kinds of lines come before, strips of triangles between.
constexpr std::uint64_t mode_triangles = 4;
constexpr std::uint64_t mode_fan = 6;

struct Component {
  std::uint64_t size;
  const char* name;
};

std::optional<Component> component(std::uint64_t type) {
  switch (type) {
    case 5120:
      return Component{1, "byte"};
    case 5121:
      return Component{1, "unsigned byte"};
    case 5122:
      return Component{2, "short"};
    case 5123:
      return Component{2, "unsigned short"};
    case 5125:
      return Component{4, "unsigned int"};
    case 5126:
      return Component{4, "float"};
    default:
      return std::nullopt;
  }
}

template <int size>
std::uint32_t little_endian(const char* bytes) {
  std::uint32_t value = 0;
  for (int i = size - 1; i >= 0; --i) value = value << 8 | static_cast<unsigned char>(bytes[i]);
  return value;
}

std::uint32_t whole_number(const char* bytes, std::uint64_t size) {
  return size == 1 ? little_endian<1>(bytes) : size == 2 ? little_endian<2>(bytes) : little_endian<4>(bytes);
}

// Reads accessors; checks each down to its bytes.
class AccessorReader {
 public:
  explicit AccessorReader(const GltfDocument& document) : document_(document) {
    for (const std::string_view buffer : document.buffers) most_ += 2 * buffer.size();
  }

  std::vector<Vector3> vectors(const JsonValue& reference) {
    const Elements elements = check(reference, "VEC3", {5126}, 3);
    std::vector<Vector3> result;
    result.reserve(elements.count);
    for (std::uint64_t i = 0; i < elements.count; ++i) {
      const char* from = elements.begin + i * elements.stride;
      const auto coordinate = [&](int k) { return std::bit_cast<float>(little_endian<4>(from + 4 * k)); };
      result.emplace_back(coordinate(0), coordinate(1), coordinate(2));
    }
    return result;
  }

  // Rows of `width` numbers; whole ones are divided by their largest where `normalized`.
  std::vector<double> numbers(const JsonValue& reference, const char* type,
                              std::initializer_list<std::uint64_t> components, std::uint64_t width,
                              bool normalized = false) {
    const Elements elements = check(reference, type, components, width);
    const std::uint64_t size = elements.size / width;
    std::vector<double> result;
    result.reserve(elements.count * width);
    for (std::uint64_t i = 0; i < elements.count; ++i) {
      for (std::uint64_t k = 0; k < width; ++k) {
        const std::uint32_t bits = whole_number(elements.begin + i * elements.stride + k * size, size);
        const double largest = size == 1 ? 0xff : 0xffff;
        result.push_back(size == 4 ? std::bit_cast<float>(bits) : normalized ? bits / largest : bits);
        if (!std::isfinite(result.back())) reference.fail(fmt::format("element {} is not finite", i));
      }
    }
    return result;
  }

  std::vector<std::uint32_t> indices(const JsonValue& reference, std::uint64_t vertices) {
    const Elements elements = check(reference, "SCALAR", {5121, 5123, 5125}, 1);
    std::vector<std::uint32_t> result;
    result.reserve(elements.count);
    for (std::uint64_t i = 0; i < elements.count; ++i) {
      result.push_back(whole_number(elements.begin + i * elements.stride, elements.size));
      if (result.back() >= vertices) {
        reference.fail(fmt::format("index {} of triangle {} is out of range: the primitive has {} vertices",
                                   result.back(), i / 3, vertices));
      }
    }
    return result;
  }

 private:
  struct Elements {
    const char* begin;
    std::uint64_t count;
    std::uint64_t stride;
    std::uint64_t size;
  };

  Elements check(const JsonValue& reference, const char* type,
                 std::initializer_list<std::uint64_t> components, std::uint64_t width) {
    const int index = reference.index(document_.size_of("accessors"), "accessor");
    const JsonValue accessor = document_.item_of("accessors", index);
    if (accessor.find("sparse")) accessor.fail("is sparse, which is not read; export it without");
    if (accessor.require("type").text() != type) {
      accessor.require("type").fail(fmt::format("must be {} here ({})", type, reference.path()));
    }
    const std::uint64_t component_type = accessor.require("componentType").integer(0xffff);
    const auto found = component(component_type);
    if (!found || std::find(components.begin(), components.end(), component_type) == components.end()) {
      accessor.require("componentType")
          .fail(fmt::format("is {} ({}), which cannot be read here ({})", component_type,
                            found ? found->name : "unknown", reference.path()));
    }
    const std::uint64_t count = accessor.require("count").integer(0xffffffff);
    if (count == 0) accessor.require("count").fail("is 0");

    const JsonValue view_reference = accessor.require("bufferView");
    const int view_index = view_reference.index(document_.size_of("bufferViews"), "buffer view");
    const JsonValue view = document_.item_of("bufferViews", view_index);
    const std::string_view bytes = buffer_view(document_, view_index);
    const auto number = [](const JsonValue& object, const char* key) {
      const auto value = object.find(key);
      return value ? value->integer(std::uint64_t{1} << 40) : 0;
    };
    const std::uint64_t element = found->size * width;
    std::uint64_t stride = element;
    if (const auto given = view.find("byteStride")) {
      stride = given->integer(252);
      if (stride < element || stride % found->size != 0) {
        given->fail(fmt::format("is {}, but its elements have {} bytes", stride, element));
      }
    }
    const std::uint64_t offset = number(accessor, "byteOffset");
    if ((number(view, "byteOffset") + offset) % found->size != 0) {
      accessor.fail(fmt::format("does not begin at a multiple of {} bytes", found->size));
    }
    const std::uint64_t end = offset + stride * (count - 1) + element;
    if (end > bytes.size()) {
      accessor.fail(fmt::format("ends at byte {}, but its buffer view has {}", end, bytes.size()));
    }
    read_ += count;
    if (read_ > most_) {
      reference.fail(fmt::format(
          "with it the meshes have more than {} vertices and indices, two for each byte and two million",
          most_));
    }
    return {bytes.data() + offset, count, stride, element};
  }

  const GltfDocument& document_;
  // Many primitives may share an accessor, so that a small file can need much memory.
  std::uint64_t most_ = 2'000'000;
  std::uint64_t read_ = 0;
};

std::vector<SkinInfluence> influences(const JsonValue& attributes, std::uint64_t vertices,
                                      AccessorReader& accessors, std::vector<std::string>& warnings) {
  const auto joints = attributes.find("JOINTS_0");
  const auto weights = attributes.find("WEIGHTS_0");
  if (!joints && !weights) return {};
  if (attributes.find("JOINTS_1")) {
    warnings.push_back(attributes.path() + ": more than four joints hold a vertex; the first four count");
  }
  const std::vector<double> indices =
      accessors.numbers(attributes.require("JOINTS_0"), "VEC4", {5121, 5123}, 4);
  const std::vector<double> shares =
      accessors.numbers(attributes.require("WEIGHTS_0"), "VEC4", {5121, 5123, 5126}, 4, true);
  if (indices.size() != 4 * vertices) joints->fail("has another number of elements than POSITION");
  if (shares.size() != 4 * vertices) weights->fail("has another number of elements than POSITION");
  std::vector<SkinInfluence> result(vertices);
  for (std::size_t i = 0; i < result.size(); ++i) {
    double sum = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      if (!(shares[4 * i + k] >= 0)) weights->fail(fmt::format("element {} has a negative weight", i));
      result[i].joints[k] = static_cast<std::uint16_t>(indices[4 * i + k]);
      sum += shares[4 * i + k];
    }
    for (std::size_t k = 0; k < 4 && sum > 0; ++k) result[i].weights[k] = shares[4 * i + k] / sum;
  }
  return result;
}

// What an attribute has for each vertex, as rows of `width` numbers, of which `rows` says how many there are.
template <std::size_t width>
std::vector<std::array<float, width>> rows_of(const JsonValue& attribute, std::span<const double> numbers,
                                              std::size_t in_file, std::uint64_t vertices) {
  if (numbers.size() != in_file * vertices) attribute.fail("has another number of elements than POSITION");
  std::vector<std::array<float, width>> rows(vertices);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].fill(1);
    for (std::size_t k = 0; k < in_file; ++k) rows[i][k] = static_cast<float>(numbers[in_file * i + k]);
  }
  return rows;
}

VertexLooks looks_of(const GltfDocument& document, const JsonValue& attributes, std::uint64_t vertices,
                     AccessorReader& accessors) {
  VertexLooks looks;
  for (std::size_t set = 0; set < looks.texture_coordinates.size(); ++set) {
    const auto given = attributes.find(set == 0 ? "TEXCOORD_0" : "TEXCOORD_1");
    if (!given) continue;
    const std::vector<double> numbers = accessors.numbers(*given, "VEC2", {5126, 5121, 5123}, 2, true);
    looks.texture_coordinates[set] = rows_of<2>(*given, numbers, 2, vertices);
  }
  if (const auto given = attributes.find("COLOR_0")) {
    const int index = given->index(document.size_of("accessors"), "accessor");
    const bool has_alpha = document.item_of("accessors", index).require("type").text() == "VEC4";
    const std::size_t width = has_alpha ? 4 : 3;
    const std::vector<double> numbers =
        accessors.numbers(*given, has_alpha ? "VEC4" : "VEC3", {5126, 5121, 5123}, width, true);
    looks.colors = rows_of<4>(*given, numbers, width, vertices);
  }
  if (const auto given = attributes.find("TANGENT")) {
    looks.tangents = rows_of<4>(*given, accessors.numbers(*given, "VEC4", {5126}, 4), 4, vertices);
  }
  return looks;
}

// The corners of triangles, strips or fans as triangles.
std::vector<Triangle> triangles_of(std::uint64_t mode, std::span<const std::uint32_t> corners) {
  std::vector<Triangle> triangles;
  if (mode == mode_triangles) {
    triangles.reserve(corners.size() / 3);
    for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
      triangles.push_back({corners[i], corners[i + 1], corners[i + 2]});
    }
    return triangles;
  }
  triangles.reserve(corners.size() - 2);
  for (std::size_t i = 0; i + 2 < corners.size(); ++i) {
    if (mode == mode_fan) {
      triangles.push_back({corners[0], corners[i + 1], corners[i + 2]});
    } else if (i % 2 == 0) {
      triangles.push_back({corners[i], corners[i + 1], corners[i + 2]});
    } else {
      triangles.push_back({corners[i + 1], corners[i], corners[i + 2]});
    }
  }
  return triangles;
}

std::vector<Vector3> unit_normals(std::vector<Vector3> normals, const JsonValue& place) {
  for (std::size_t i = 0; i < normals.size(); ++i) {
    if (!normals[i].allFinite()) place.fail(fmt::format("normal {} is not finite", i));
    const double length = normals[i].norm();
    if (!(length > 0)) return {};  // no direction: as if none had been given
    normals[i] /= length;
  }
  return normals;
}

// Nothing where the primitive has no triangles.
std::optional<GltfPrimitive> read_primitive(const GltfDocument& document, const JsonValue& primitive,
                                            AccessorReader& accessors, std::vector<std::string>& warnings) {
  GltfPrimitive read;
  const auto given_mode = primitive.find("mode");
  const std::uint64_t mode = given_mode ? given_mode->integer(mode_fan) : mode_triangles;
  if (primitive.extension("KHR_draco_mesh_compression") || primitive.extension("EXT_meshopt_compression")) {
    primitive.fail("is compressed, which is not read; export it without compression");
  }
  const JsonValue attributes = primitive.require("attributes");
  const JsonValue position = attributes.require("POSITION");
  if (const auto given = primitive.find("material")) {
    read.material = given->index(document.size_of("materials"), "material");
    read.double_sided =
        get(document.item_of("materials", read.material), "doubleSided", false, &JsonValue::boolean);
  }
  if (mode < mode_triangles) return std::nullopt;

  read.positions = accessors.vectors(position);
  const auto lost = std::ranges::find_if_not(read.positions, [](const Vector3& p) { return p.allFinite(); });
  if (lost != read.positions.end()) {
    primitive.fail(
        fmt::format("vertex {} is not finite: POSITION holds a NaN or an infinity; export the mesh again",
                    lost - read.positions.begin()));
  }
  if (const auto normal = attributes.find("NORMAL")) {
    std::vector<Vector3> normals = accessors.vectors(*normal);
    if (normals.size() != read.positions.size()) normal->fail("has another number of elements than POSITION");
    read.normals = unit_normals(std::move(normals), primitive);
  }
  read.influences = influences(attributes, read.positions.size(), accessors, warnings);
  read.looks = looks_of(document, attributes, read.positions.size(), accessors);
  std::vector<std::uint32_t> corners;
  if (const auto indices = primitive.find("indices")) {
    corners = accessors.indices(*indices, read.positions.size());
  } else {
    corners.resize(read.positions.size());
    std::iota(corners.begin(), corners.end(), 0U);
  }
  if (corners.size() < 3 || (mode == mode_triangles && corners.size() % 3 != 0)) {
    primitive.fail(fmt::format("{} corners make no whole triangles", corners.size()));
  }
  read.triangles = triangles_of(mode, corners);
  return read;
}

}  // namespace

std::vector<GltfSkin> read_skins(const GltfDocument& document) {
  std::vector<GltfSkin> skins(document.size_of("skins"));
  AccessorReader accessors(document);
  for (std::size_t i = 0; i < skins.size(); ++i) {
    const JsonValue skin = document.item_of("skins", static_cast<int>(i));
    for (const JsonValue& joint : skin.require("joints").items()) {
      skins[i].joints.push_back(joint.index(document.nodes.size(), "node"));
    }
    skins[i].joint_from_mesh.resize(skins[i].joints.size());
    const auto given = skin.find("inverseBindMatrices");
    if (!given) continue;
    const std::vector<double> entries = accessors.numbers(*given, "MAT4", {5126}, 16);
    if (entries.size() != 16 * skins[i].joints.size())
      given->fail("has another number of elements than 'joints'");
    for (std::size_t joint = 0; joint < skins[i].joints.size(); ++joint) {
      const Eigen::Map<const Eigen::Matrix4d> matrix(entries.data() + 16 * joint);
      skins[i].joint_from_mesh[joint] =
          make_transform(Matrix3(matrix.topLeftCorner<3, 3>()), Vector3(matrix.topRightCorner<3, 1>()));
    }
  }
  return skins;
}

std::vector<GltfMesh> read_meshes(const GltfDocument& document, std::vector<std::string>& warnings) {
  std::vector<GltfMesh> meshes(document.size_of("meshes"));
  AccessorReader accessors(document);
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    const JsonValue mesh = document.item_of("meshes", static_cast<int>(i));
    bool morphs = false;
    for (const JsonValue& primitive : mesh.require("primitives").items()) {
      morphs = morphs || primitive.find("targets");
      std::optional<GltfPrimitive> read = read_primitive(document, primitive, accessors, warnings);
      if (read) {
        meshes[i].primitives.push_back(std::move(*read));
      } else {
        warnings.push_back(primitive.path() + ": points and lines are left out");
      }
    }
    if (morphs) warnings.push_back(mesh.path() + ": morph targets are ignored");
  }
  return meshes;
}

PosedVertices posed_vertices(const GltfDocument& document, const GltfSkin& skin,
                             const GltfPrimitive& primitive, const JsonValue& place) {
  std::vector<NodeTransform> world_from_mesh;
  for (std::size_t joint = 0; joint < skin.joints.size(); ++joint) {
    world_from_mesh.push_back(compose(document.nodes[skin.joints[joint]].world, skin.joint_from_mesh[joint]));
  }
  PosedVertices posed;
  for (std::size_t i = 0; i < primitive.positions.size(); ++i) {
    const SkinInfluence& influence = primitive.influences[i];
    Matrix3 linear = Matrix3::Zero();
    Vector3 translation = Vector3::Zero();
    for (std::size_t k = 0; k < 4; ++k) {
      if (influence.weights[k] == 0) continue;
      if (influence.joints[k] >= skin.joints.size()) {
        place.fail(fmt::format("vertex {} is held by joint {} of its skin, which has {}", i,
                               influence.joints[k], skin.joints.size()));
      }
      const NodeTransform& joint = world_from_mesh[influence.joints[k]];
      linear += influence.weights[k] * joint.linear;
      translation += influence.weights[k] * joint.translation;
    }
    posed.positions.push_back(linear * primitive.positions[i] + translation);
    if (!posed.positions.back().allFinite()) place.fail(fmt::format("vertex {} of its skin overflows", i));
    if (primitive.normals.empty()) continue;
    posed.normals.push_back((linear * primitive.normals[i]).stableNormalized());
  }
  if (!std::ranges::all_of(posed.normals, [](const Vector3& normal) { return normal.squaredNorm() > 0.5; })) {
    posed.normals.clear();
  }
  return posed;
}

}  // namespace substep
