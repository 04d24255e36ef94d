#pragma once
/// A small valid scene for tests to change, and the files to put it in.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "sim/scene/scene.h"
#include "tests/temporary_folder.h"

namespace substep::test {

/// The buffer of `example()`: a cube with corners at ±0.5, 8 float positions and 36 16-bit indices.
std::string cube_buffer();

/// Nodes: 0 "ground" with a plane; 1 "crate", a box of 2 kg, with its mesh and the child 2 "hook", which a
/// joint ties to 3 "nail" in the world; 4 "rock", the hull of node 5, which lies outside the scene; 6 "eye",
/// a camera; 7 "sun", a light. The buffer is a data URI.
nlohmann::json example();

/// The physics of a node.
nlohmann::json& physics(nlohmann::json& document, int node);

/// Appends eight items of numbers to `bytes`, which become the first buffer. Returns the accessor of the
/// items.
int add_accessor(nlohmann::json& document, std::string& bytes, const std::string& numbers, int component,
                 const char* type);

/// A document with one node, named "body", that has this motion and this implicit shape as its collider.
nlohmann::json one_body(const std::string& motion, const std::string& shape);

/// The two chunks as a `.glb` file; the document's first buffer must have no `uri`.
std::string glb(const std::string& json, const std::string& binary);

Scene load(const nlohmann::json& document);

/// Returns the message of load_scene; empty where it throws none.
std::string complaint(const std::filesystem::path& file);
std::string complaint(const nlohmann::json& document);

}  // namespace substep::test
