#pragma once
/// Measures how visible the difference of two pictures is to a person who flips between them.
///
/// LDR-FLIP after P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström and M. D. Fairchild,
/// "FLIP: A Difference Evaluator for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech. 3(2),
/// 2020. Means agree with the authors' program to 2e-6, extremes to 4e-6 (image_comparison_test.cpp).

#include <numbers>
#include <string_view>
#include <vector>

#include "render/image.h"

namespace substep::golden {

struct Flip {
  int width = 0;
  int height = 0;
  std::vector<float> map;  ///< per pixel, rows from the top; 0: no visible difference, 1: the largest
  double mean = 0;
  double max = 0;
};

/// Pixels per degree of a viewer 0.7 m from a screen of 3840 pixels on 0.7 m: the authors' default.
inline constexpr float pixels_per_degree = 0.7F * (3840 / 0.7F) * (std::numbers::pi_v<float> / 180);

/// Returns the FLIP error of two images of equal size; exactly 0 for equal images.
Flip flip(const render::Image& expected, const render::Image& actual);

/// Returns the map as a picture, brighter where the difference is more visible.
render::Image heat_map(const Flip& flip);

/// Returns a word for the largest value: "invisible" below 0.1, "subtle" below 0.3, else "visible".
std::string_view visibility(const Flip& flip);

}  // namespace substep::golden
