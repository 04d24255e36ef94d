/// How long it takes to compare two pictures of 1280 × 720, on one thread, beside what is wanted. CPU time,
/// the median of several runs.

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <iostream>
#include <vector>

#include "golden/flip.h"
#include "golden/image_comparison.h"

namespace {

using substep::Image;

constexpr int width = 1280;
constexpr int height = 720;

/// A chequered floor with noise, so that no pixel is like its neighbour.
Image picture(unsigned seed) {
  Image image(width, height);
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

void print(const char* what, double milliseconds, double wanted) {
  std::cout << "| " << what << " | " << milliseconds << " | " << wanted << " |\n";
}

}  // namespace

int main(int argc, char** argv) {
  const int runs = argc > 1 ? std::max(1, std::atoi(argv[1])) : 15;
  const Image one = picture(1);
  const Image same = one;
  const Image other = picture(2);
  double sum = 0;
  std::cout << "| two pictures of 1280 × 720 | ms | wanted |\n|---|---|---|\n";
  print("equal", median_milliseconds(runs, [&] { sum += compare(one, same).mean; }), 2);
  print("every pixel different, without FLIP",
        median_milliseconds(runs, [&] { sum += compare(one, other).mean; }), 15);
  print("FLIP, every pixel different", median_milliseconds(runs, [&] { sum += flip(one, other).mean; }), 100);
  return sum > 0 ? 0 : 1;
}
