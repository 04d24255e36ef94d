#include "sim/loading/mesh_file.h"

#include <assimp/MemoryIOWrapper.h>
#include <assimp/material.h>
#include <assimp/mesh.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <exception>
#include <fstream>
#include <list>
#include <new>
#include <optional>
#include <span>

#include "sim/error.h"
#include "sim/loading/file_bytes.h"
#include "sim/math/fnv1a.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t most_objects = 1000;
constexpr std::uintmax_t largest_material_file = std::uintmax_t{1} << 24;

/// Limits for reading a file, by its size. Every format takes a few bytes for a vertex, so the result cannot
/// be many times as large, and every reader takes a fraction of a second for a mebibyte.
struct Limits {
  explicit Limits(std::size_t bytes)
      : seconds(1 + static_cast<unsigned>(bytes / (std::size_t{1} << 20))),
        memory((std::size_t{1} << 29) + 64 * bytes),
        result((std::size_t{1} << 24) + 32 * bytes) {}
  unsigned seconds;    ///< of processor time
  std::size_t memory;  ///< bytes beyond those that the process already has
  std::size_t result;  ///< bytes
};

/// The files that assimp can open: the mesh file, from memory, and the material files beside it.
class MeshSystem : public Assimp::IOSystem {
 public:
  MeshSystem(const fs::path& file, const std::string& bytes) : file_(file), bytes_(bytes) {}

  bool Exists(const char* name) const override { return name == file_.filename() || find(name).has_value(); }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* name, const char*) override {
    if (name == file_.filename()) return stream_of(bytes_);
    Assimp::IOStream* stream = nullptr;
    // Keep the bytes till the end: assimp may open a file twice.
    if (const auto found = find(name))
      stream = stream_of(materials_.emplace_back(read_bytes(*found, found->string(), largest_material_file)));
    if (!stream && missing.empty()) missing = name;
    // Clear the name where assimp finds the file without its path.
    if (stream && missing.ends_with(fs::path(name).filename().string())) missing.clear();
    return stream;
  }
  void Close(Assimp::IOStream* stream) override { delete stream; }

  std::string missing;  ///< the first material file that cannot be read

 private:
  std::optional<fs::path> find(const char* name) const {
    if (lower_extension(name) != ".mtl") return std::nullopt;
    bool leaves = false;
    return file_beside(file_, name, leaves);
  }

  /// Returns a stream of bytes that outlive it; null for none, which assimp's stream cannot read.
  static Assimp::IOStream* stream_of(const std::string& bytes) {
    if (bytes.empty()) return nullptr;
    return new Assimp::MemoryIOStream(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  }

  const fs::path& file_;
  const std::string& bytes_;
  std::list<std::string> materials_;
};

/// A reader of the lists of plain values that a MeshWriter wrote.
class Reader {
 public:
  Reader(std::string_view bytes, const std::string& file) : bytes_(bytes), file_(file) {}

  bool at_end() const { return bytes_.empty(); }

  template <typename Type>
  std::vector<Type> take() {
    std::uint64_t size = 0;
    if (bytes_.size() < sizeof size) break_off();
    std::memcpy(&size, bytes_.data(), sizeof size);
    bytes_.remove_prefix(sizeof size);
    if (bytes_.size() < size || size % sizeof(Type) != 0) break_off();
    std::vector<Type> list(size / sizeof(Type));
    if (size > 0) std::memcpy(static_cast<void*>(list.data()), bytes_.data(), size);
    bytes_.remove_prefix(size);
    return list;
  }

  /// Throws Error.
  [[noreturn]] void break_off() const {
    throw Error(file_ + ": assimp breaks off reading it: it is damaged");
  }

 private:
  std::string_view bytes_;
  const std::string& file_;
};

Vector3 to_vector(const aiVector3D& vector) {
  return {vector.x, vector.y, vector.z};
}

double to_linear(double srgb) {
  return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
}

/// Returns the linear colour of a material; nothing for the one that assimp gives to a mesh without one.
std::vector<double> color_of(const aiMaterial& material) {
  aiString name;
  aiColor3D color;
  if (material.Get(AI_MATKEY_NAME, name) != aiReturn_SUCCESS || name == aiString(AI_DEFAULT_MATERIAL_NAME) ||
      material.Get(AI_MATKEY_COLOR_DIFFUSE, color) != aiReturn_SUCCESS) {
    return {};
  }
  std::vector<double> linear;
  for (const float channel : {color.r, color.g, color.b})
    linear.push_back(to_linear(std::clamp(channel, 0.f, 1.f)));
  return linear;
}

/// Writes the meshes of a scene for the parent process, after the name of a missing material file: lists of
/// plain values, one after the other. Lines and points are left out.
class MeshWriter {
 public:
  MeshWriter(const aiScene& scene, const std::string& missing, bool with_normals, std::size_t most)
      : scene_(scene), with_normals_(with_normals), most_(most) {
    add(std::span<const char>(missing));
    write_node(*scene.mRootNode, Matrix3::Identity(), Vector3::Zero());
    if (objects_ == 0) throw Error("it holds no triangles");
  }

  std::string bytes;

 private:
  template <typename Type>
  void add(std::span<const Type> list) {
    const std::uint64_t size = list.size_bytes();
    if (bytes.size() + sizeof size + size > most_) throw Error("it unfolds to more than its size allows");
    bytes.append(reinterpret_cast<const char*>(&size), sizeof size);
    bytes.append(reinterpret_cast<const char*>(list.data()), size);
  }

  void write_node(const aiNode& node, const Matrix3& outer, const Vector3& origin) {
    const aiMatrix4x4& m = node.mTransformation;
    Matrix3 linear;
    linear << m.a1, m.a2, m.a3, m.b1, m.b2, m.b3, m.c1, m.c2, m.c3;
    const Vector3 translation = outer * Vector3(m.a4, m.b4, m.c4) + origin;
    linear = outer * linear;
    bool is_object = false;
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
      const aiMesh& mesh = *scene_.mMeshes[node.mMeshes[i]];
      if ((mesh.mPrimitiveTypes & aiPrimitiveType_TRIANGLE) == 0) continue;
      if (!is_object && ++objects_ > most_objects)
        throw Error("it holds more than {} meshes, the most that are read", most_objects);
      is_object = true;
      add(std::span<const std::uint32_t>(&objects_, 1));
      add(std::span<const char>(node.mName.C_Str(), node.mName.length));
      write_mesh(mesh, linear, translation);
    }
    for (unsigned i = 0; i < node.mNumChildren; ++i) write_node(*node.mChildren[i], linear, translation);
  }

  void write_mesh(const aiMesh& mesh, const Matrix3& linear, const Vector3& translation) {
    std::vector<double> color;
    if (mesh.mMaterialIndex < scene_.mNumMaterials) color = color_of(*scene_.mMaterials[mesh.mMaterialIndex]);
    std::vector<Vector3> positions;
    std::vector<Vector3> normals;
    std::vector<Triangle> triangles;
    // Transform normals by the cofactors. Their signs are corrected where triangles are wound.
    Matrix3 cofactors;
    for (int i = 0; i < 3; ++i) cofactors.col(i) = linear.col((i + 1) % 3).cross(linear.col((i + 2) % 3));
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
      positions.emplace_back(linear * to_vector(mesh.mVertices[i]) + translation);
      if (mesh.HasNormals() && with_normals_) normals.emplace_back(cofactors * to_vector(mesh.mNormals[i]));
    }
    const bool mirrors = linear.determinant() < 0;
    for (const aiFace& face : std::span(mesh.mFaces, mesh.mNumFaces)) {
      if (face.mNumIndices != 3) continue;
      triangles.push_back({face.mIndices[0], face.mIndices[mirrors ? 2 : 1], face.mIndices[mirrors ? 1 : 2]});
    }
    add(std::span<const double>(color));
    add(std::span<const Vector3>(positions));
    add(std::span<const Vector3>(normals));
    add(std::span<const Triangle>(triangles));
  }

  const aiScene& scene_;
  bool with_normals_;
  std::size_t most_;
  std::uint32_t objects_ = 0;
};

/// Returns the meshes that assimp reads, as a MeshWriter writes them.
std::string converted(const fs::path& file, const std::string& bytes, const Limits& limits) {
  Assimp::Importer importer;
  auto* const system = new MeshSystem(file, bytes);
  importer.SetIOHandler(system);  // the importer deletes it
  const unsigned steps = aiProcess_Triangulate | aiProcess_SortByPType;
  const aiScene* scene = importer.ReadFile(file.filename().string(), steps);
  if (!scene || !scene->mRootNode) throw Error(importer.GetErrorString());
  // Readers of other formats request files that need not be there.
  const std::string missing = lower_extension(file) == ".obj" ? system->missing : "";
  // Ignore the normals of STL files: each triangle has its own, even where the surface is smooth.
  return std::move(MeshWriter(*scene, missing, lower_extension(file) != ".stl", limits.result).bytes);
}

constexpr char answer_mesh = 'm';
constexpr char answer_refusal = 'r';

void limit(int resource, rlim_t most) {
  const rlimit both{most, most};
  setrlimit(static_cast<__rlimit_resource_t>(resource), &both);
}

rlim_t address_space_in_use() {
  std::ifstream statistics("/proc/self/statm");
  rlim_t pages = 0;
  statistics >> pages;
  return pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE));
}

// The address sanitizer reserves terabytes, which no limit on the address space allows.
#ifndef __has_feature
#define __has_feature(feature) 0
#endif
#if defined(__SANITIZE_ADDRESS__) || __has_feature(address_sanitizer)
constexpr bool can_limit_memory = false;
#else
constexpr bool can_limit_memory = true;
#endif

[[noreturn]] void run_child(int to, const fs::path& file, const std::string& bytes, const Limits& limits) {
  // Reset the parent's handlers: a signal ends this process silently.
  for (const int number : {SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGSEGV, SIGXCPU, SIGALRM, SIGPIPE})
    signal(number, SIG_DFL);
  const int nowhere = open("/dev/null", O_RDWR);
  for (int standard = 0; nowhere >= 0 && standard < 3; ++standard) dup2(nowhere, standard);
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, limits.seconds);
  limit(RLIMIT_FSIZE, 0);
  if (can_limit_memory) limit(RLIMIT_AS, address_space_in_use() + limits.memory);
  alarm(20 * limits.seconds);  // ends a child that waits forever; twenty times, for busy machines
  std::string answer;
  try {
    answer = answer_mesh + converted(file, bytes, limits);
  } catch (const std::bad_alloc&) {
    answer = answer_refusal + std::string("it takes too much memory for its size");
  } catch (const std::exception& failure) {
    answer = answer_refusal + std::string(failure.what());
  }
  for (std::string_view rest = answer; !rest.empty();) {
    const ssize_t written = write(to, rest.data(), rest.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) _exit(1);
    rest.remove_prefix(static_cast<std::size_t>(written));
  }
  _exit(0);
}

/// Runs assimp in a child process and returns its answer; throws Error when there is none.
std::string answer_of_child(const fs::path& file, const std::string& bytes, const Limits& limits) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw Error(file.string() + ": no pipe can be opened to read it through");
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    run_child(ends[1], file, bytes, limits);
  }
  close(ends[1]);
  if (child < 0) {
    close(ends[0]);
    throw Error(file.string() + ": no process can be started to read it in");
  }
  std::string answer;
  std::vector<char> buffer(std::size_t{1} << 16);
  for (ssize_t count = 1; count > 0 || (count < 0 && errno == EINTR);) {
    count = read(ends[0], buffer.data(), buffer.size());
    if (count > 0) answer.append(buffer.data(), static_cast<std::size_t>(count));
  }
  close(ends[0]);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  if (signal == SIGXCPU || signal == SIGKILL || signal == SIGALRM) {
    throw Error(file.string() + ": takes more time or memory to read than its size allows: it is damaged");
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || answer.empty())
    throw Error(file.string() + ": assimp fails to read it: it is damaged");
  return answer;
}

/// Reads a mesh that a MeshWriter wrote, and checks all of it: the child may have been corrupted.
Mesh checked_mesh(Reader& reader, const std::string& where) {
  Mesh mesh;
  mesh.positions = reader.take<Vector3>();
  mesh.normals = reader.take<Vector3>();
  mesh.triangles = reader.take<Triangle>();
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    if (mesh.positions[i].allFinite()) continue;
    throw Error("{}: vertex {} is not finite; export the mesh again", where, i);
  }
  for (Vector3& normal : mesh.normals) normal = normal.stableNormalized();
  const auto is_unit = [](const Vector3& normal) { return normal.squaredNorm() > 0.5; };
  if (mesh.normals.size() != mesh.positions.size() || !std::ranges::all_of(mesh.normals, is_unit)) {
    mesh.normals.clear();  // one is missing or has no direction
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (std::ranges::max(mesh.triangles[i]) < mesh.positions.size()) continue;
    throw Error("{}: triangle {} is out of range", where, i);
  }
  return mesh;
}

/// Returns true for names that assimp makes up where the file gives none.
bool is_placeholder(const std::string& name) {
  return name.empty() || name.front() == '<' || name == "defaultobject" || name == "default";
}

void add_mesh(MeshFile& file, Reader& reader, const std::string& file_name, const std::string& stem,
              UniqueNames& names) {
  const std::vector<std::uint32_t> object = reader.take<std::uint32_t>();
  const std::vector<char> given = reader.take<char>();
  if (object.size() != 1 || object[0] == 0) reader.break_off();
  if (object[0] > file.objects.size()) {
    const std::string name = printable(std::string(given.begin(), given.end()));
    file.objects.emplace_back().name = names.add(is_placeholder(name) ? stem : name);
  }
  const std::vector<double> color = reader.take<double>();
  const std::string& name = file.objects.back().name;
  Mesh& mesh = file.objects.back().meshes.emplace_back(
      checked_mesh(reader, fmt::format("{}: mesh '{}'", file_name, name)));
  mesh.surface = -1;
  if (color.size() != 3) return;
  mesh.surface = static_cast<int>(file.surfaces.size());
  Surface& surface = file.surfaces.emplace_back();
  surface.name = name;
  std::ranges::copy(color, surface.base_color.begin());
}

}  // namespace

bool is_mesh_extension(const std::string& extension) {
  return extension.size() > 1 && Assimp::Importer().IsExtensionSupported(extension);
}

MeshFile read_mesh_file(const fs::path& file) {
  const std::string file_name = file.string();
  const std::string bytes = read_bytes(file, file_name);
  if (bytes.empty()) throw Error(file_name + ": is empty");
  const std::string answer = answer_of_child(file, bytes, Limits(bytes.size()));
  if (answer.front() != answer_mesh)
    throw Error("{}: cannot be read as a mesh: {}", file_name, printable(answer.substr(1)));
  MeshFile mesh_file;
  mesh_file.hash = add_binary_to_hash(fnv1a_start, bytes);
  UniqueNames names;
  Reader reader(std::string_view(answer).substr(1), file_name);
  if (const std::vector<char> missing = reader.take<char>(); !missing.empty()) {
    mesh_file.warnings.push_back(fmt::format(
        "its material file '{}' is empty or not in the mesh's folder: put it there for its colours",
        printable(std::string(missing.begin(), missing.end()))));
  }
  while (!reader.at_end()) add_mesh(mesh_file, reader, file_name, file.stem().string(), names);
  return mesh_file;
}

}  // namespace substep
