#pragma once
/// The library's scenes, each as the text of its glTF file. What they are for is on the page beside each
/// file.

#include <array>
#include <string>
#include <string_view>

namespace substep::make {

std::string rod_chain();
std::string pendulum();
std::string heavy_chain();
std::string tumbling_body();

std::string box_stack();
std::string stone_pyramid();
std::string incline();
std::string powered_wheel();

std::string joint_kinds();
std::string bouncing_balls();
std::string conveyor();

struct SceneFile {
  std::string_view name;  ///< of the file, without ".gltf"
  std::string (*text)();
};

inline constexpr std::array<SceneFile, 11> all_scenes{{
    {"rod_chain", rod_chain},
    {"pendulum", pendulum},
    {"heavy_chain", heavy_chain},
    {"tumbling_body", tumbling_body},
    {"box_stack", box_stack},
    {"stone_pyramid", stone_pyramid},
    {"incline", incline},
    {"powered_wheel", powered_wheel},
    {"joint_kinds", joint_kinds},
    {"bouncing_balls", bouncing_balls},
    {"conveyor", conveyor},
}};

}  // namespace substep::make
