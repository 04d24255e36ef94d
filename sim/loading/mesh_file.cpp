#include "sim/loading/mesh_file.h"

#include <assimp/material.h>
#include <assimp/mesh.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <exception>
#include <fstream>
#include <memory>
#include <new>
#include <set>
#include <type_traits>

#include "sim/error.h"
#include "sim/loading/file_bytes.h"
#include "sim/loading/memory_stream.h"
#include "sim/math/fnv1a.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t most_objects = 1000;
constexpr std::uintmax_t largest_material_file = std::uintmax_t{1} << 24;

// What reading a file of some size may cost. Every format takes a few bytes for a vertex, so the result
// cannot be many times as large, and every reader gets through a mebibyte in a fraction of a second.
struct Limits {
  explicit Limits(std::size_t bytes)
      : seconds(1 + bytes / (std::size_t{1} << 20)),
        memory((std::size_t{1} << 29) + 64 * bytes),
        result((std::size_t{1} << 24) + 32 * bytes) {}
  std::size_t seconds;  // of processor time
  std::size_t memory;   // bytes on top of what the process has
  std::size_t result;   // bytes
};

// The file itself from memory, and the material files beside it.
class MeshSystem : public Assimp::IOSystem {
 public:
  MeshSystem(const fs::path& file, const std::string& bytes) : file_(file), bytes_(bytes) {}

  bool Exists(const char* name) const override { return name == file_.filename() || find(name).has_value(); }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* name, const char*) override {
    if (name == file_.filename()) return new MemoryStream(bytes_);
    const auto found = find(name);
    if (!found) return nullptr;
    // Kept till the end: assimp may open a file twice.
    materials_.push_back(
        std::make_unique<std::string>(read_bytes(*found, found->string(), largest_material_file)));
    return new MemoryStream(*materials_.back());
  }
  void Close(Assimp::IOStream* stream) override { delete stream; }

 private:
  std::optional<fs::path> find(const char* name) const {
    if (lower_extension(name) != ".mtl") return std::nullopt;
    bool leaves = false;
    return file_beside(file_, name, leaves);
  }

  const fs::path& file_;
  const std::string& bytes_;
  std::vector<std::unique_ptr<std::string>> materials_;
};

// The result on its way from the child: plain values one after the other.
class Writer {
 public:
  explicit Writer(std::size_t most) : most_(most) {}

  template <typename Type>
  void add(const Type& value) {
    static_assert(std::is_trivially_copyable_v<Type>);
    append(&value, sizeof value);
  }
  void add_vector(const Vector3& vector) { append(vector.data(), 3 * sizeof(double)); }
  void add_text(const std::string& text) {
    add<std::uint64_t>(text.size());
    append(text.data(), text.size());
  }
  const std::string& bytes() const { return bytes_; }

 private:
  void append(const void* from, std::size_t size) {
    if (bytes_.size() + size > most_) throw Error("it unfolds to more than its size allows");
    bytes_.append(static_cast<const char*>(from), size);
  }

  std::size_t most_;
  std::string bytes_;
};

class Reader {
 public:
  Reader(std::string_view bytes, const std::string& file) : bytes_(bytes), file_(file) {}

  template <typename Type>
  Type take() {
    Type value{};
    const std::string_view from = take_bytes(sizeof value);
    std::memcpy(&value, from.data(), sizeof value);
    return value;
  }
  Vector3 take_vector() {
    const auto numbers = take<std::array<double, 3>>();
    return {numbers[0], numbers[1], numbers[2]};
  }
  std::string take_text() { return std::string(take_bytes(take<std::uint64_t>())); }
  // A count of things that each take `size` bytes at least.
  std::size_t take_count(std::size_t size) {
    const auto count = take<std::uint64_t>();
    if (count > bytes_.size() / size) break_off();
    return count;
  }

 private:
  std::string_view take_bytes(std::uint64_t size) {
    if (size > bytes_.size()) break_off();
    const std::string_view taken = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return taken;
  }

  [[noreturn]] void break_off() const {
    throw Error(file_ + ": assimp breaks off reading it: it is damaged");
  }

  std::string_view bytes_;
  const std::string& file_;
};

struct Placement {
  Matrix3 linear = Matrix3::Identity();
  Vector3 translation = Vector3::Zero();
};

Placement composed(const Placement& outer, const aiMatrix4x4& m) {
  Matrix3 linear;
  linear << m.a1, m.a2, m.a3, m.b1, m.b2, m.b3, m.c1, m.c2, m.c3;
  return {outer.linear * linear, outer.linear * Vector3(m.a4, m.b4, m.c4) + outer.translation};
}

Vector3 to_vector(const aiVector3D& vector) {
  return {vector.x, vector.y, vector.z};
}

double to_linear(double srgb) {
  return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
}

// The material that assimp gives to a mesh without one.
bool is_stand_in(const aiMaterial& material) {
  aiString name;
  return material.Get(AI_MATKEY_NAME, name) != aiReturn_SUCCESS || name == aiString(AI_DEFAULT_MATERIAL_NAME);
}

// One mesh of assimp's, with what is not a triangle left out.
void write_part(Writer& writer, const aiScene& scene, const aiMesh& mesh, const Placement& place,
                bool with_normals) {
  aiColor3D color;
  const bool colored =
      mesh.mMaterialIndex < scene.mNumMaterials && !is_stand_in(*scene.mMaterials[mesh.mMaterialIndex]) &&
      scene.mMaterials[mesh.mMaterialIndex]->Get(AI_MATKEY_COLOR_DIFFUSE, color) == aiReturn_SUCCESS;
  writer.add(colored);
  if (colored) {
    for (const float channel : {color.r, color.g, color.b})
      writer.add(to_linear(std::clamp(channel, 0.f, 1.f)));
  }
  writer.add<std::uint64_t>(mesh.mNumVertices);
  for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
    writer.add_vector(place.linear * to_vector(mesh.mVertices[i]) + place.translation);
  }
  // In STL files each triangle has its own normal, which says nothing of how smooth the surface is.
  const bool has_normals = mesh.HasNormals() && with_normals;
  writer.add(has_normals);
  if (has_normals) {
    // Normals go with the cofactors; signs are settled where triangles are wound.
    Matrix3 cofactors;
    for (int i = 0; i < 3; ++i) {
      cofactors.col(i) = place.linear.col((i + 1) % 3).cross(place.linear.col((i + 2) % 3));
    }
    for (unsigned i = 0; i < mesh.mNumVertices; ++i)
      writer.add_vector(cofactors * to_vector(mesh.mNormals[i]));
  }
  const bool mirrors = place.linear.determinant() < 0;
  std::uint64_t triangles = 0;
  for (unsigned i = 0; i < mesh.mNumFaces; ++i) triangles += mesh.mFaces[i].mNumIndices == 3;
  writer.add(triangles);
  for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
    const aiFace& face = mesh.mFaces[i];
    if (face.mNumIndices != 3) continue;
    Triangle triangle{face.mIndices[0], face.mIndices[1], face.mIndices[2]};
    if (mirrors) std::swap(triangle[1], triangle[2]);
    writer.add(triangle);
  }
}

void write_node(Writer& writer, const aiScene& scene, const aiNode& node, const Placement& outer,
                bool with_normals, std::size_t& objects) {
  const Placement place = composed(outer, node.mTransformation);
  std::vector<const aiMesh*> meshes;
  for (unsigned i = 0; i < node.mNumMeshes; ++i) {
    const aiMesh* mesh = scene.mMeshes[node.mMeshes[i]];
    if ((mesh->mPrimitiveTypes & aiPrimitiveType_TRIANGLE) != 0) meshes.push_back(mesh);
  }
  if (!meshes.empty()) {
    if (++objects > most_objects) {
      throw Error(fmt::format("it holds more than {} meshes, the most that are read", most_objects));
    }
    writer.add(true);
    writer.add_text(node.mName.C_Str());
    writer.add<std::uint64_t>(meshes.size());
    for (const aiMesh* mesh : meshes) write_part(writer, scene, *mesh, place, with_normals);
  }
  for (unsigned i = 0; i < node.mNumChildren; ++i)
    write_node(writer, scene, *node.mChildren[i], place, with_normals, objects);
}

std::string converted(const fs::path& file, const std::string& bytes, const Limits& limits) {
  Assimp::Importer importer;
  importer.SetIOHandler(new MeshSystem(file, bytes));  // the importer deletes it
  const unsigned steps = aiProcess_Triangulate | aiProcess_SortByPType;
  const aiScene* scene = importer.ReadFile(file.filename().string(), steps);
  if (!scene || !scene->mRootNode) throw Error(importer.GetErrorString());
  Writer writer(limits.result);
  std::size_t objects = 0;
  write_node(writer, *scene, *scene->mRootNode, {}, lower_extension(file) != ".stl", objects);
  if (objects == 0) throw Error("it holds no triangles");
  writer.add(false);
  return writer.bytes();
}

constexpr char answer_mesh = 'm';
constexpr char answer_refusal = 'r';

bool send(int to, const char* data, std::size_t size) {
  while (size > 0) {
    const ssize_t written = write(to, data, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    data += written;
    size -= static_cast<std::size_t>(written);
  }
  return true;
}

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
#if defined(__SANITIZE_ADDRESS__)
constexpr bool can_limit_memory = false;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
constexpr bool can_limit_memory = false;
#else
constexpr bool can_limit_memory = true;
#endif
#else
constexpr bool can_limit_memory = true;
#endif

[[noreturn]] void run_child(int to, const fs::path& file, const std::string& bytes, const Limits& limits) {
  // Whatever goes wrong in here ends this process alone, and without a trace.
  for (const int number : {SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGSEGV, SIGXCPU, SIGALRM, SIGPIPE}) {
    signal(number, SIG_DFL);
  }
  const int nowhere = open("/dev/null", O_RDWR);
  for (int standard = 0; nowhere >= 0 && standard < 3; ++standard) dup2(nowhere, standard);
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, limits.seconds);
  limit(RLIMIT_FSIZE, 0);
  if (can_limit_memory) limit(RLIMIT_AS, address_space_in_use() + limits.memory);
  std::string answer;
  try {
    answer = answer_mesh + converted(file, bytes, limits);
  } catch (const std::bad_alloc&) {
    answer = answer_refusal + std::string("it takes too much memory for its size");
  } catch (const std::exception& failure) {
    answer = answer_refusal + std::string(failure.what());
  }
  send(to, answer.data(), answer.size());
  _exit(0);
}

// Runs assimp in a child process and returns its answer; throws Error when there is none.
std::string answer_of_child(const fs::path& file, const std::string& bytes, const Limits& limits) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw Error(file.string() + ": no pipe can be opened to read it through");
  const pid_t child = fork();
  if (child < 0) {
    close(ends[0]);
    close(ends[1]);
    throw Error(file.string() + ": no process can be started to read it in");
  }
  if (child == 0) {
    close(ends[0]);
    run_child(ends[1], file, bytes, limits);
  }
  close(ends[1]);

  // The limit is on processor time; this one is for a child that waits for something, on a busy machine too.
  using Clock = std::chrono::steady_clock;
  const Clock::time_point deadline = Clock::now() + std::chrono::seconds(20 * limits.seconds);
  std::string answer;
  std::vector<char> buffer(std::size_t{1} << 16);
  bool late = false;
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    pollfd waiting{ends[0], POLLIN, 0};
    const int ready = poll(&waiting, 1, static_cast<int>(std::clamp<long long>(left, 0, 1000)));
    if (ready < 0 && errno != EINTR) break;
    if (ready <= 0) {
      if (left > 0) continue;
      late = true;
      break;
    }
    const ssize_t count = read(ends[0], buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) break;
    answer.append(buffer.data(), static_cast<std::size_t>(count));
  }
  close(ends[0]);
  if (late) kill(child, SIGKILL);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (late || (WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL))) {
    throw Error(fmt::format("{}: reading it takes longer than the {} s that its size allows: it is damaged",
                            file.string(), limits.seconds));
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || answer.empty()) {
    throw Error(file.string() + ": assimp fails to read it: it is damaged");
  }
  return answer;
}

MeshPart taken_part(Reader& reader, const std::string& where) {
  MeshPart part;
  if (reader.take<bool>()) part.color = reader.take<std::array<double, 3>>();
  part.positions.resize(reader.take_count(sizeof(Vector3)));
  for (std::size_t i = 0; i < part.positions.size(); ++i) {
    part.positions[i] = reader.take_vector();
    if (!part.positions[i].allFinite()) {
      throw Error(fmt::format("{}: vertex {} is not finite; export the mesh again", where, i));
    }
  }
  if (reader.take<bool>()) {
    part.normals.resize(part.positions.size());
    bool sound = true;
    for (Vector3& normal : part.normals) {
      normal = reader.take_vector().stableNormalized();
      sound = sound && normal.squaredNorm() > 0.5;
    }
    if (!sound) part.normals.clear();  // some show nowhere: as if none had been given
  }
  part.triangles.resize(reader.take_count(sizeof(Triangle)));
  for (std::size_t i = 0; i < part.triangles.size(); ++i) {
    part.triangles[i] = reader.take<Triangle>();
    for (const std::uint32_t corner : part.triangles[i]) {
      if (corner >= part.positions.size())
        throw Error(fmt::format("{}: triangle {} is out of range", where, i));
    }
  }
  return part;
}

// assimp's stand-ins for a name that the file does not give.
bool is_placeholder(const std::string& name) {
  return name.empty() || name.front() == '<' || name == "defaultobject" || name == "default";
}

}  // namespace

bool is_mesh_extension(const std::string& extension) {
  return extension.size() > 1 && Assimp::Importer().IsExtensionSupported(extension);
}

MeshFile read_mesh_file(const fs::path& file) {
  const std::string complaint = file.string();
  const std::string bytes = read_bytes(file, complaint);
  if (bytes.empty()) throw Error(complaint + ": is empty");
  const Limits limits(bytes.size());
  const std::string answer = answer_of_child(file, bytes, limits);
  if (answer.front() != answer_mesh) {
    throw Error(fmt::format("{}: cannot be read as a mesh: {}", complaint, printable(answer.substr(1))));
  }
  MeshFile mesh_file;
  mesh_file.hash = add_binary_to_hash(fnv1a_start, bytes);
  std::set<std::string> names{"world"};  // of body 0
  try {
    for (Reader reader(std::string_view(answer).substr(1), complaint); reader.take<bool>();) {
      MeshObject& object = mesh_file.objects.emplace_back();
      const std::string given = printable(reader.take_text());
      const std::string base = is_placeholder(given) ? file.stem().string() : given;
      object.name = base;
      for (int use = 2; !names.insert(object.name).second; ++use)
        object.name = fmt::format("{} #{}", base, use);
      const std::size_t parts = reader.take_count(1);
      for (std::size_t i = 0; i < parts; ++i) {
        object.parts.push_back(taken_part(reader, fmt::format("{}: mesh '{}'", complaint, object.name)));
      }
    }
  } catch (const std::bad_alloc&) {
    throw Error(complaint + ": is too large for this machine's memory");
  }
  return mesh_file;
}

}  // namespace substep
