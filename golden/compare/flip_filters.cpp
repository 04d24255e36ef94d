#include "golden/compare/flip_filters.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace substep::golden {
namespace {

// Constants of the paper's sections 4 and 5.
constexpr float feature_width_degrees = 0.082F;  // w
/// Contrast sensitivity: a Gaussian a·√(π/b)·exp(−π²x²/b), x in degrees (the paper's table 1).
struct Sensitivity {
  double a, b;
};
constexpr Sensitivity achromatic{1.0, 0.0047};
constexpr Sensitivity red_green_sensitivity{1.0, 0.0053};
constexpr Sensitivity blue_yellow_narrow{34.1, 0.04};
constexpr Sensitivity blue_yellow_wide{13.5, 0.025};

using cells::Floats;

/// Three standard deviations of the widest sensitivity.
int sensitivity_radius(float pixels_per_degree) {
  using std::numbers::pi;
  return static_cast<int>(std::ceil(3 * std::sqrt(blue_yellow_narrow.b / (2 * pi * pi)) *
                                    static_cast<double>(pixels_per_degree)));
}

/// A Gaussian of a contrast sensitivity, unit sum, and its weight in a sum of such: the two-dimensional
/// filter is a·√(π/b)·exp(−π²(x²+y²)/b), whose sum is that factor times the square of the one-dimensional
/// sum.
struct SensitivityFilter {
  FlipKernel kernel;
  double weight;
};

SensitivityFilter sensitivity_filter(const Sensitivity& s, float pixels_per_degree) {
  using std::numbers::pi;
  const int radius = sensitivity_radius(pixels_per_degree);
  std::vector<double> weights;
  double sum = 0;
  for (int i = -radius; i <= radius; ++i) {
    const double x = i / static_cast<double>(pixels_per_degree);
    weights.push_back(std::exp(-pi * pi * x * x / s.b));
    sum += weights.back();
  }
  // What rounding would swallow need not be computed: the narrow filters have two thirds of the wide ones'
  // taps.
  constexpr double negligible = 1e-9;
  FlipKernel kernel;
  for (const double weight : weights) {
    if (weight / sum >= negligible) kernel.push_back(cells::all(static_cast<float>(weight / sum)));
  }
  return {std::move(kernel), s.a * std::sqrt(pi / s.b) * sum * sum};
}

/// The derivatives' positive weights sum to 1, their negative ones to −1. In single precision as in the
/// authors' program: on flat areas these sums cancel but for their rounding, and the exponent ½ makes 3e-5 of
/// 1e-9, so agreement to 2e-6 needs the same rounding.
FlipKernel of_unit_sums(const std::vector<float>& weights) {
  float positive = 0;
  float negative = 0;
  for (const float w : weights) (w > 0 ? positive : negative) += std::abs(w);
  FlipKernel kernel;
  for (const float w : weights) kernel.push_back(cells::all(w / (w > 0 ? positive : negative)));
  return kernel;
}

constexpr std::size_t batch = 4;  // as many sums of four as the processor can hold beside each other

/// Σ kernel[tap] · from(tap), where both halves of the kernel are the same.
template <typename From>
void weigh_symmetric(const FlipKernel& kernel, const From& from, float* target) {
  const std::size_t radius = kernel.size() / 2;
  for (std::size_t x = 0; x < SeenRow::width; x += batch * cells::width) {
    std::array<Floats, batch> sums;
    for (std::size_t i = 0; i < batch; ++i) {
      sums[i] = kernel[radius] * cells::load(from(radius) + x + cells::width * i);
    }
    for (std::size_t tap = 0; tap < radius; ++tap) {
      const float* before = from(tap) + x;
      const float* after = from(kernel.size() - 1 - tap) + x;
      for (std::size_t i = 0; i < batch; ++i) {
        sums[i] +=
            kernel[tap] * (cells::load(before + cells::width * i) + cells::load(after + cells::width * i));
      }
    }
    for (std::size_t i = 0; i < batch; ++i) cells::store(target + x + cells::width * i, sums[i]);
  }
}

/// √(a² + b²) of a = Σ gaussian[tap] · derived(tap) and b = Σ derivative[tap] · smooth(tap).
void weigh_gradient(const FlipKernel& gaussian, const FlipKernel& derivative, const float* const* derived,
                    const float* const* smooth, float* target) {
  for (std::size_t x = 0; x < SeenRow::width; x += batch * cells::width) {
    std::array<Floats, batch> across{};
    std::array<Floats, batch> down{};
    for (std::size_t tap = 0; tap < gaussian.size(); ++tap) {
      for (std::size_t i = 0; i < batch; ++i) {
        across[i] += gaussian[tap] * cells::load(derived[tap] + x + cells::width * i);
        down[i] += derivative[tap] * cells::load(smooth[tap] + x + cells::width * i);
      }
    }
    for (std::size_t i = 0; i < batch; ++i) {
      cells::store(target + x + cells::width * i, cells::root(across[i] * across[i] + down[i] * down[i]));
    }
  }
}

}  // namespace

FlipFilters::FlipFilters(float pixels_per_degree) {
  lightness = sensitivity_filter(achromatic, pixels_per_degree).kernel;
  red_green = sensitivity_filter(red_green_sensitivity, pixels_per_degree).kernel;
  SensitivityFilter narrow = sensitivity_filter(blue_yellow_narrow, pixels_per_degree);
  SensitivityFilter wide = sensitivity_filter(blue_yellow_wide, pixels_per_degree);
  narrow_share = static_cast<float>(narrow.weight / (narrow.weight + wide.weight));
  blue_narrow = std::move(narrow.kernel);
  blue_wide = std::move(wide.kernel);
  const float deviation = 0.5F * feature_width_degrees * pixels_per_degree;
  const int radius = static_cast<int>(std::ceil(3 * deviation));
  std::vector<float> weights, slopes, curvatures;
  for (int i = -radius; i <= radius; ++i) {
    const auto x = static_cast<float>(i);
    const float g = std::exp(-x * x / (2 * deviation * deviation));
    weights.push_back(g);
    slopes.push_back(-x * g);
    curvatures.push_back((x * x / (deviation * deviation) - 1) * g);
  }
  gaussian = of_unit_sums(weights);
  first = of_unit_sums(slopes);
  second = of_unit_sums(curvatures);
  reach = std::max(sensitivity_radius(pixels_per_degree), radius);
}

SeenStrip::SeenStrip(const render::Image& image, const FlipFilters& filters, const FlipColors& colors)
    : image_(image), filters_(filters), colors_(colors) {
  const auto kept_rows = 2 * static_cast<std::size_t>(filters.reach) + 1;
  rows_.resize(kept_rows);
  sources_.resize(kept_rows);
  smooth_sources_.resize(kept_rows);
  kept_.resize(kept_rows * planes * SeenRow::width);
  // Whole lanes, for each channel and for luminance.
  const int padded = SeenRow::width + 2 * filters.reach;
  pixels_.resize(4 * static_cast<std::size_t>((padded + cells::width - 1) / cells::width * cells::width));
}

void SeenStrip::start(int left) {
  left_ = left;
  std::fill(rows_.begin(), rows_.end(), -1);
}

float* SeenStrip::line(Plane plane, int y) {
  const std::size_t slot = static_cast<std::size_t>(y) % rows_.size();
  return &kept_[(plane * rows_.size() + slot) * SeenRow::width];
}

void SeenStrip::filter_row(int y) {
  const std::size_t length = pixels_.size() / 4;
  float* const channel[3] = {pixels_.data(), pixels_.data() + length, pixels_.data() + 2 * length};
  float* const light = pixels_.data() + 3 * length;
  const std::array<float, 256>& levels = linear_levels();
  for (std::size_t i = 0; i < length; ++i) {
    const int x = std::clamp(left_ - filters_.reach + static_cast<int>(i), 0, image_.width - 1);
    const std::uint8_t* p = image_.pixel(x, y);
    for (std::size_t c = 0; c < 3; ++c) channel[c][i] = levels[p[c]];
  }
  for (std::size_t i = 0; i < length; i += cells::width) {
    const FlipColor seen = colors_.opponent(
        {cells::load(channel[0] + i), cells::load(channel[1] + i), cells::load(channel[2] + i)});
    for (std::size_t c = 0; c < 3; ++c) cells::store(channel[c] + i, seen[c]);
    cells::store(light + i, luminance(seen[0]));
  }
  const auto blur = [&](const float* from, const FlipKernel& kernel, Plane plane) {
    const float* start = from + filters_.reach - kernel.size() / 2;
    weigh_symmetric(
        kernel, [&](std::size_t tap) { return start + tap; }, line(plane, y));
  };
  blur(channel[0], filters_.lightness, lightness);
  blur(channel[1], filters_.red_green, red_green);
  blur(channel[2], filters_.blue_narrow, blue_narrow);
  blur(channel[2], filters_.blue_wide, blue_wide);
  const float* start = light + filters_.reach - filters_.gaussian.size() / 2;
  for (std::size_t x = 0; x < SeenRow::width; x += batch * cells::width) {
    std::array<Floats, batch> mean{}, slope{}, curvature{};
    for (std::size_t tap = 0; tap < filters_.gaussian.size(); ++tap) {
      for (std::size_t i = 0; i < batch; ++i) {
        const Floats value = cells::load(start + x + tap + cells::width * i);
        mean[i] += filters_.gaussian[tap] * value;
        slope[i] += filters_.first[tap] * value;
        curvature[i] += filters_.second[tap] * value;
      }
    }
    for (std::size_t i = 0; i < batch; ++i) {
      cells::store(line(smooth, y) + x + cells::width * i, mean[i]);
      cells::store(line(first, y) + x + cells::width * i, slope[i]);
      cells::store(line(second, y) + x + cells::width * i, curvature[i]);
    }
  }
}

void SeenStrip::see(int y, SeenRow& row) {
  const auto picture_row = [&](int at) { return std::clamp(at, 0, image_.height - 1); };
  for (int i = picture_row(y - filters_.reach); i <= picture_row(y + filters_.reach); ++i) {
    int& kept = rows_[static_cast<std::size_t>(i) % rows_.size()];
    if (kept == i) continue;
    filter_row(i);
    kept = i;
  }
  const auto sources = [&](Plane plane, const FlipKernel& kernel, std::vector<const float*>& result) {
    const int radius = static_cast<int>(kernel.size() / 2);
    for (int tap = 0; tap <= 2 * radius; ++tap) {
      result[static_cast<std::size_t>(tap)] = line(plane, picture_row(y - radius + tap));
    }
  };
  const auto blur = [&](Plane plane, const FlipKernel& kernel, SeenRow::Line& target) {
    sources(plane, kernel, sources_);
    weigh_symmetric(
        kernel, [&](std::size_t tap) { return sources_[tap]; }, target.data());
  };
  blur(lightness, filters_.lightness, row.lightness);
  blur(red_green, filters_.red_green, row.red_green);
  SeenRow::Line wide;
  blur(blue_narrow, filters_.blue_narrow, row.blue_yellow);
  blur(blue_wide, filters_.blue_wide, wide);
  const float share = filters_.narrow_share;
  for (std::size_t x = 0; x < SeenRow::width; ++x) {
    row.blue_yellow[x] = share * row.blue_yellow[x] + (1 - share) * wide[x];
  }
  sources(smooth, filters_.gaussian, smooth_sources_);
  sources(first, filters_.gaussian, sources_);
  weigh_gradient(filters_.gaussian, filters_.first, sources_.data(), smooth_sources_.data(),
                 row.edges.data());
  sources(second, filters_.gaussian, sources_);
  weigh_gradient(filters_.gaussian, filters_.second, sources_.data(), smooth_sources_.data(),
                 row.points.data());
}

}  // namespace substep::golden
