#pragma once
/// The library's scenes, each as the text of its glTF file. What they are for is on the page beside each
/// file.

#include <array>
#include <string>
#include <string_view>

namespace substep::scenes {

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

std::string heavy_top();
std::string turntable();
std::string sliding_ball();
std::string balls_on_tray();
std::string shaken_block();
std::string cradle();
std::string door();
std::string short_chain();
std::string heavy_on_light();
std::string overlap();
std::string painleve_rod();
std::string card_house();
std::string masonry_arch();
std::string dominoes();
std::string wrecking_ball();
std::string ragdoll();
std::string squeezer();
std::string bricard();
std::string four_bar();
std::string governor();
std::string water_wheel();
std::string euler_disk();
std::string rock_slide();
std::string rattleback();
std::string bowling();
std::string funnel();
std::string near_miss();
std::string seams();
std::string struck();

std::string tall_stack();
std::string top_heavy_stack();
std::string box_pyramid();
std::string brick_wall();

std::string kapla();
std::string kapla_slippery();
std::string rapier_chain();
std::string five_boxes();
std::string sliding_boxes();
std::string slopes();
std::string rolling_ball();
std::string heavy_rope();
std::string heavy_rope_open();
std::string growing_cubes();
std::string friction_ways();
std::string million_to_one();
std::string million_to_one_dropped();
std::string pyramid_80();
std::string pyramid_100();
std::string cube_tower();

struct SceneFile {
  std::string_view name;  ///< of the file, without ".gltf"
  std::string (*text)();
};

inline constexpr std::array<SceneFile, 60> all_scenes{{
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
    {"heavy_top", heavy_top},
    {"turntable", turntable},
    {"sliding_ball", sliding_ball},
    {"balls_on_tray", balls_on_tray},
    {"shaken_block", shaken_block},
    {"cradle", cradle},
    {"door", door},
    {"short_chain", short_chain},
    {"heavy_on_light", heavy_on_light},
    {"overlap", overlap},
    {"painleve_rod", painleve_rod},
    {"card_house", card_house},
    {"masonry_arch", masonry_arch},
    {"dominoes", dominoes},
    {"wrecking_ball", wrecking_ball},
    {"ragdoll", ragdoll},
    {"squeezer", squeezer},
    {"bricard", bricard},
    {"four_bar", four_bar},
    {"governor", governor},
    {"water_wheel", water_wheel},
    {"euler_disk", euler_disk},
    {"rock_slide", rock_slide},
    {"rattleback", rattleback},
    {"bowling", bowling},
    {"funnel", funnel},
    {"near_miss", near_miss},
    {"seams", seams},
    {"struck", struck},
    {"tall_stack", tall_stack},
    {"top_heavy_stack", top_heavy_stack},
    {"box_pyramid", box_pyramid},
    {"brick_wall", brick_wall},
    {"published/kapla", kapla},
    {"published/kapla_slippery", kapla_slippery},
    {"published/rapier_chain", rapier_chain},
    {"published/five_boxes", five_boxes},
    {"published/sliding_boxes", sliding_boxes},
    {"published/slopes", slopes},
    {"published/rolling_ball", rolling_ball},
    {"published/heavy_rope", heavy_rope},
    {"published/heavy_rope_open", heavy_rope_open},
    {"published/growing_cubes", growing_cubes},
    {"published/friction_ways", friction_ways},
    {"published/million_to_one", million_to_one},
    {"published/million_to_one_dropped", million_to_one_dropped},
    {"published/pyramid_80", pyramid_80},
    {"published/pyramid_100", pyramid_100},
    {"published/cube_tower", cube_tower},
}};

}  // namespace substep::scenes
