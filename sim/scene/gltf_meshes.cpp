#include "sim/scene/gltf_meshes.h"

#include <assimp/mesh.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/IOStream.hpp>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <bit>
#include <cmath>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "sim/error.h"
#include "sim/scene/memory_stream.h"

namespace substep {
namespace {

using nlohmann::json;

constexpr int mode_triangles = 4;
constexpr std::size_t largest_total = 50'000'000;  // vertices and indices; primitives may share a buffer

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

// Checks one accessor of a mesh down to its bytes and returns its count.
class AccessorCheck {
 public:
  explicit AccessorCheck(const GltfDocument& document) : document_(document) {}

  std::uint64_t vectors(const JsonValue& reference) { return check(reference, "VEC3", {5126}, 3).count; }

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
        const char* from = elements.begin + i * elements.stride + k * size;
        std::uint32_t bits = 0;
        for (std::uint64_t byte = size; byte-- > 0;)
          bits = bits << 8 | static_cast<unsigned char>(from[byte]);
        const double largest = size == 1 ? 0xff : 0xffff;
        result.push_back(size == 4 ? std::bit_cast<float>(bits) : normalized ? bits / largest : bits);
        if (!std::isfinite(result.back())) reference.fail(fmt::format("element {} is not finite", i));
      }
    }
    return result;
  }

  // assimp leaves out a triangle with an index out of range without a word, so they are looked at here.
  std::uint64_t indices(const JsonValue& reference, std::uint64_t vertices) {
    const Elements elements = check(reference, "SCALAR", {5121, 5123, 5125}, 1);
    for (std::uint64_t i = 0; i < elements.count; ++i) {
      std::uint64_t index = 0;
      for (std::uint64_t byte = elements.size; byte-- > 0;) {
        index = index << 8 | static_cast<unsigned char>(elements.begin[i * elements.stride + byte]);
      }
      if (index >= vertices) {
        reference.fail(fmt::format("index {} of triangle {} is out of range: the primitive has {} vertices",
                                   index, i / 3, vertices));
      }
    }
    return elements.count;
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
    const std::uint64_t count = accessor.require("count").integer(largest_total);
    if (count == 0) accessor.require("count").fail("is 0");
    total_ += count;
    if (total_ > largest_total) {
      reference.fail(
          fmt::format("the meshes together have more than {} vertices and indices", largest_total));
    }

    const JsonValue view_reference = accessor.require("bufferView");
    const int view_index = view_reference.index(document_.size_of("bufferViews"), "buffer view");
    const JsonValue view = document_.item_of("bufferViews", view_index);
    const std::string& buffer =
        document_.buffers[view.require("buffer").index(document_.buffers.size(), "buffer")];
    const auto number = [](const JsonValue& object, const char* key) {
      const auto value = object.find(key);
      return value ? value->integer(std::uint64_t{1} << 40) : 0;
    };
    const std::uint64_t view_length = view.require("byteLength").integer(std::uint64_t{1} << 40);
    const std::uint64_t view_end = number(view, "byteOffset") + view_length;
    if (view_end > buffer.size()) {
      view.fail(fmt::format("ends at byte {}, but its buffer has {}", view_end, buffer.size()));
    }
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
    if (end > view_length) {
      accessor.fail(fmt::format("ends at byte {}, but its buffer view has {}", end, view_length));
    }
    return {buffer.data() + number(view, "byteOffset") + offset, count, stride, element};
  }

  const GltfDocument& document_;
  std::uint64_t total_ = 0;
};

constexpr const char* copy_name = "copy.gltf";

// All that assimp may open: the copy of the document, and the document's buffers by number. It never reaches
// the disk.
class MemorySystem : public Assimp::IOSystem {
 public:
  MemorySystem(std::string copy, const std::vector<std::string>& buffers)
      : copy_(std::move(copy)), buffers_(buffers) {}

  bool Exists(const char* name) const override { return find(name) != nullptr; }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* name, const char*) override {
    const std::string* bytes = find(name);
    return bytes ? new MemoryStream(*bytes) : nullptr;
  }
  void Close(Assimp::IOStream* stream) override { delete stream; }

 private:
  const std::string* find(std::string_view name) const {
    name.remove_prefix(name.rfind('/') + 1);  // rfind gives −1 where there is none
    if (name == copy_name) return &copy_;
    for (std::size_t i = 0; i < buffers_.size(); ++i) {
      if (name == fmt::format("buffer{}", i)) return &buffers_[i];
    }
    return nullptr;
  }

  std::string copy_;
  const std::vector<std::string>& buffers_;
};

// Of `object` the keys that are wanted, as they are.
json picked(const json& object, std::initializer_list<const char*> keys) {
  json result = json::object();
  for (const char* key : keys) {
    if (object.contains(key)) result[key] = object[key];
  }
  return result;
}

// The document's geometry alone, its names and extensions dropped: one node "#mesh<i>" for each mesh.
class GeometryCopy {
 public:
  explicit GeometryCopy(const GltfDocument& document) {
    copy_["asset"] = {{"version", "2.0"}};
    copy_["scene"] = 0;
    // A second root makes assimp put a root of its own above all, so that our nodes keep their names.
    copy_["nodes"] = json::array({{{"name", "#pad"}}});
    copy_["meshes"] = json::array();
    for (std::size_t i = 0; i < document.buffers.size(); ++i) {
      copy_["buffers"].push_back(
          {{"byteLength", document.buffers[i].size()}, {"uri", fmt::format("buffer{}", i)}});
    }
    for (std::size_t i = 0; i < document.size_of("bufferViews"); ++i) {
      copy_["bufferViews"].push_back(picked(document.item_of("bufferViews", static_cast<int>(i)).json(),
                                            {"buffer", "byteOffset", "byteLength", "byteStride"}));
    }
    for (std::size_t i = 0; i < document.size_of("accessors"); ++i) {
      copy_["accessors"].push_back(picked(document.item_of("accessors", static_cast<int>(i)).json(),
                                          {"bufferView", "byteOffset", "componentType", "count", "type"}));
    }
  }

  void add(std::size_t mesh, const json& primitives) {
    copy_["nodes"].push_back({{"name", fmt::format("#mesh{}", mesh)}, {"mesh", copy_["meshes"].size()}});
    copy_["meshes"].push_back({{"primitives", primitives}});
  }

  bool empty() const { return copy_["meshes"].empty(); }

  std::string text() {
    json roots = json::array();
    for (std::size_t i = 0; i < copy_["nodes"].size(); ++i) roots.push_back(i);
    copy_["scenes"] = json::array({{{"nodes", roots}}});
    return copy_.dump();
  }

 private:
  json copy_;
};

std::vector<SkinInfluence> influences(const JsonValue& attributes, std::uint64_t vertices,
                                      AccessorCheck& check, std::vector<std::string>& warnings) {
  const auto joints = attributes.find("JOINTS_0");
  const auto weights = attributes.find("WEIGHTS_0");
  if (!joints && !weights) return {};
  if (attributes.find("JOINTS_1")) {
    warnings.push_back(attributes.path() + ": more than four joints hold a vertex; the first four count");
  }
  const std::vector<double> indices = check.numbers(attributes.require("JOINTS_0"), "VEC4", {5121, 5123}, 4);
  const std::vector<double> shares =
      check.numbers(attributes.require("WEIGHTS_0"), "VEC4", {5121, 5123, 5126}, 4, true);
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

std::optional<json> checked_primitive(const GltfDocument& document, const JsonValue& primitive,
                                      AccessorCheck& check, GltfPrimitive& read,
                                      std::vector<std::string>& warnings) {
  const auto mode = primitive.find("mode");
  const std::uint64_t kind = mode ? mode->integer(6) : mode_triangles;
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
  if (kind < mode_triangles) return std::nullopt;

  json kept{{"mode", kind}, {"attributes", {{"POSITION", position.json()}}}};
  const std::uint64_t vertices = check.vectors(position);
  if (const auto normal = attributes.find("NORMAL")) {
    if (check.vectors(*normal) != vertices) normal->fail("has another number of elements than POSITION");
    kept["attributes"]["NORMAL"] = normal->json();
  }
  read.influences = influences(attributes, vertices, check, warnings);
  std::uint64_t corners = vertices;
  if (const auto indices = primitive.find("indices")) {
    corners = check.indices(*indices, vertices);
    kept["indices"] = indices->json();
  }
  if (corners < 3 || (kind == mode_triangles && corners % 3 != 0)) {
    primitive.fail(fmt::format("{} corners make no whole triangles", corners));
  }
  return kept;
}

Vector3 to_vector(const aiVector3D& vector) {
  return {vector.x, vector.y, vector.z};
}

void take_over(const aiMesh& mesh, const JsonValue& place, GltfPrimitive& primitive) {
  primitive.positions.reserve(mesh.mNumVertices);
  for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
    primitive.positions.push_back(to_vector(mesh.mVertices[i]));
    if (!primitive.positions.back().allFinite()) {
      place.fail(fmt::format(
          "vertex {} is not finite: POSITION holds a NaN or an infinity; export the mesh again", i));
    }
  }
  if (mesh.HasNormals()) {
    primitive.normals.reserve(mesh.mNumVertices);
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
      const Vector3 normal = to_vector(mesh.mNormals[i]);
      if (!normal.allFinite()) place.fail(fmt::format("normal {} is not finite", i));
      const double length = normal.norm();
      if (!(length > 0)) {  // no direction: as if none had been given
        primitive.normals.clear();
        break;
      }
      primitive.normals.push_back(normal / length);
    }
  }
  primitive.triangles.reserve(mesh.mNumFaces);
  for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
    const aiFace& face = mesh.mFaces[i];
    if (face.mNumIndices != 3) place.fail(fmt::format("face {} has {} corners", i, face.mNumIndices));
    Triangle triangle{};
    for (int corner = 0; corner < 3; ++corner) {
      triangle[corner] = face.mIndices[corner];
      if (triangle[corner] >= mesh.mNumVertices) place.fail(fmt::format("triangle {} is out of range", i));
    }
    primitive.triangles.push_back(triangle);
  }
  if (!primitive.influences.empty() && primitive.influences.size() != primitive.positions.size()) {
    place.fail("assimp changes the number of its vertices, so its skin does not fit");
  }
}

}  // namespace

std::vector<GltfSkin> read_skins(const GltfDocument& document) {
  std::vector<GltfSkin> skins(document.size_of("skins"));
  AccessorCheck check(document);
  for (std::size_t i = 0; i < skins.size(); ++i) {
    const JsonValue skin = document.item_of("skins", static_cast<int>(i));
    for (const JsonValue& joint : skin.require("joints").items()) {
      skins[i].joints.push_back(joint.index(document.nodes.size(), "node"));
    }
    skins[i].joint_from_mesh.resize(skins[i].joints.size());
    const auto given = skin.find("inverseBindMatrices");
    if (!given) continue;
    const std::vector<double> entries = check.numbers(*given, "MAT4", {5126}, 16);
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
  std::vector<std::vector<JsonValue>> places(meshes.size());
  GeometryCopy copy(document);
  AccessorCheck check(document);
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    const JsonValue mesh = document.item_of("meshes", static_cast<int>(i));
    json primitives = json::array();
    bool morphs = false;
    for (const JsonValue& primitive : mesh.require("primitives").items()) {
      morphs = morphs || primitive.find("targets");
      GltfPrimitive read;
      const std::optional<json> kept = checked_primitive(document, primitive, check, read, warnings);
      if (!kept) {
        warnings.push_back(primitive.path() + ": points and lines are left out");
        continue;
      }
      primitives.push_back(*kept);
      places[i].push_back(primitive);
      meshes[i].primitives.push_back(std::move(read));
    }
    if (morphs) warnings.push_back(mesh.path() + ": morph targets are ignored");
    if (!primitives.empty()) copy.add(i, primitives);
  }
  if (copy.empty()) return meshes;

  Assimp::Importer importer;
  importer.SetIOHandler(new MemorySystem(copy.text(), document.buffers));  // the importer deletes it
  const aiScene* scene = importer.ReadFile(copy_name, 0);
  if (!scene || !scene->mRootNode) {
    throw Error(
        fmt::format("{}: its meshes cannot be read: {}", document.file_name, importer.GetErrorString()));
  }
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    if (places[i].empty()) continue;
    const aiNode* node = scene->mRootNode->FindNode(fmt::format("#mesh{}", i).c_str());
    if (!node || node->mNumMeshes != places[i].size()) {
      throw Error(fmt::format("{}: /meshes/{}: cannot be read: assimp gave {} primitives of {}",
                              document.file_name, i, node ? node->mNumMeshes : 0, places[i].size()));
    }
    for (std::size_t k = 0; k < places[i].size(); ++k) {
      take_over(*scene->mMeshes[node->mMeshes[k]], places[i][k], meshes[i].primitives[k]);
    }
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
