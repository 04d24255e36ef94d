/// Measures the time of comparing two pictures of 1280 × 720 on one thread, beside the goal: CPU time, the
/// median of several runs.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <utility>
#include <vector>

#include "golden/compare/flip.h"
#include "golden/compare/image_comparison.h"

namespace {

using substep::golden::compare;
using substep::golden::flip;

/// A chequered floor with noise, so that no pixel is like its neighbour.
substep::render::Image picture(int width, int height, unsigned seed) {
  substep::render::Image image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int channel = 0; channel < 3; ++channel) {
        seed = seed * 1664525 + 1013904223;
        const unsigned level = 90 + 60 * static_cast<unsigned>((x / 97 + y / 53) % 2) + (seed >> 27);
        image.pixel(x, y)[channel] = static_cast<std::uint8_t>(level);
      }
    }
  }
  return image;
}

template <typename Work>
double median_milliseconds(int runs, const Work& work) {
  std::vector<double> times;
  for (int i = 0; i < runs; ++i) {
    const std::clock_t start = std::clock();
    work();
    times.push_back(1000.0 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
  }
  std::sort(times.begin(), times.end());
  return times[times.size() / 2];
}

void print(const std::string& what, double milliseconds) {
  std::printf("| %s | %.2f |\n", what.c_str(), milliseconds);
}

}  // namespace

int main(int argc, char** argv) {
  const int runs = argc > 1 ? std::max(1, std::atoi(argv[1])) : 15;
  const substep::render::Image one = picture(1280, 720, 1);
  const substep::render::Image same = one;
  const substep::render::Image other = picture(1280, 720, 2);
  substep::render::Image moved = one;  // what a moved body leaves
  for (int y = 300; y < 400; ++y) std::copy_n(other.pixel(600, y), 3 * 100, moved.pixel(600, y));
  double sum = 0;
  std::puts("| two pictures | ms |\n|---|---|");
  print("1280 × 720, equal", median_milliseconds(runs, [&] { sum += compare(one, same).mean; }));
  print("1280 × 720, every pixel different, without FLIP",
        median_milliseconds(runs, [&] { sum += compare(one, other).mean; }));
  print("FLIP at 1280 × 720, 100 × 100 pixels different",
        median_milliseconds(runs, [&] { sum += flip(one, moved).mean; }));
  for (const auto& [width, height] : {std::pair{64, 64}, {640, 360}, {1280, 720}, {1920, 1080}}) {
    const substep::render::Image a = picture(width, height, 1);
    const substep::render::Image b = picture(width, height, 2);
    print("FLIP at " + std::to_string(width) + " × " + std::to_string(height) + ", every pixel different",
          median_milliseconds(runs, [&] { sum += flip(a, b).mean; }));
  }
  return sum > 0 ? 0 : 1;
}
