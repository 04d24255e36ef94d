#pragma once
/// A small valid scene for tests to change, and the files to put it in.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sim/loading/json_value.h"
#include "sim/loading/load_scene.h"
#include "tests/temporary_folder.h"

namespace substep::test {

/// Returns the buffer of `example()`: a cube with corners at ±0.5, 8 float positions and 36 16-bit indices.
std::string cube_buffer();

/// Returns a valid glTF document. Nodes: 0 "ground" with a plane; 1 "crate", a box of 2 kg, with its mesh and
/// the child 2 "hook", which a joint ties to 3 "nail" in the world; 4 "rock", the hull of node 5, which lies
/// outside the scene; 6 "eye", a camera; 7 "sun", a light. The buffer is a data URI.
Json example();

/// Changes a document: "/nodes/1/name = 5; /nodes/- = {}" sets one value and appends another; an empty
/// value removes. In pointers, $ stands for extensions/KHR_physics_rigid_bodies and # for
/// extensions/KHR_implicit_shapes/shapes.
Json edited(Json document, const std::string& edits);
/// Returns the changed example.
Json edited(const std::string& edits);

/// Returns a pointer with $ and # written out.
std::string pointer(std::string text);

/// Returns the rows of a table as cells that '|' separates. A row is a line; lines that end with '|', ';' or
/// ',' continue.
std::vector<std::vector<std::string>> rows(const std::string& table);

/// Appends eight items of numbers to `bytes`, which become the first buffer. Returns the items' accessor.
int add_accessor(Json& document, std::string& bytes, const std::string& numbers, int component,
                 const char* type);

/// Returns the document with a skin for the cube of `node`: half of its corners follow each of two joints.
Json skinned(Json document, int node, const std::string& joints);

/// Returns a document with one node, named "body", that has this motion and this implicit shape as its
/// collider.
Json one_body(const std::string& motion, const std::string& shape);

/// Returns the two chunks as a `.glb` file; the document's first buffer must have no `uri`.
std::string glb(const std::string& json, const std::string& binary);

Scene load(const Json& document);  ///< writes the document to a file, and loads that

/// Compares values of scene_json(). Each row: a pointer, the value, and the tolerance of its numbers, which
/// is 0 where none is given.
void expect_scene(const Scene& scene, const std::string& table);

/// Returns the message of the Error that load_scene() throws; empty where it throws none.
std::string complaint(const std::filesystem::path& file);
/// Returns the warnings of load_scene, a line each.
std::string warnings(const Json& document);
std::string complaint(const Json& document);

/// The result of load_scene() in a process of its own, and its costs.
struct Outcome {
  std::string message;  ///< empty where it loaded, with all bodies finite
  double mebibytes = 0;
  double seconds = 0;  ///< of processor time
};
Outcome outcome_of(const std::filesystem::path& file, const std::optional<MeshOptions>& options = {});

}  // namespace substep::test
