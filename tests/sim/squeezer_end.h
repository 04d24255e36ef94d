#pragma once
/// The end of Andrews' squeezer at 0.03 s: Test Set for IVP Solvers, problem "Andrews' squeezing mechanism".

#include <array>
#include <utility>

namespace substep::test {

/// The mechanism's seven angles, radians.
inline constexpr std::array<double, 7> squeezer_end{
    15.81077119629904,  -15.75637105984298, 0.04082224013073101, -0.5347301163226948,
    0.5244099658805304, 0.5347301163226948, 1.048080741042263};

/// Orientations of the scene's bodies about z, radians.
inline constexpr std::array<std::pair<const char*, double>, 7> squeezer_angles{
    {{"crank", squeezer_end[0]},
     {"rod", squeezer_end[0] + squeezer_end[1]},
     {"lever", squeezer_end[2]},
     {"upper_link", squeezer_end[3] + squeezer_end[4]},
     {"upper_arm", squeezer_end[4]},
     {"lower_link", squeezer_end[5] + squeezer_end[6]},
     {"lower_arm", squeezer_end[6]}}};

}  // namespace substep::test
