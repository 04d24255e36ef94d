#pragma once
/// The pairs of pictures in golden/vectors, with what other programs measured on them.

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "render/image.h"
#include "tests/folders.h"

namespace substep::golden {

struct VectorPair {
  std::string name;
  render::Image expected;
  render::Image actual;
  double flip_mean = 0;  ///< the authors' program's map, summed in double precision
  double flip_min = 0;
  double flip_max = 0;
  int max_difference = 0;
  int above_0 = 0, above_2 = 0, above_8 = 0, above_16 = 0;
};

/// Reads values.csv: its second column is text in quotes, the others are plain numbers.
inline std::vector<VectorPair> vector_pairs() {
  const std::filesystem::path folder = std::filesystem::path(test::source_folder) / "golden/vectors";
  std::ifstream file(folder / "values.csv");
  std::vector<VectorPair> pairs;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    VectorPair pair;
    pair.name = line.substr(0, line.find(','));
    std::istringstream numbers(line.substr(line.rfind('"') + 2));
    std::vector<double> values;
    for (std::string value; std::getline(numbers, value, ',');) values.push_back(std::stod(value));
    pair.flip_mean = values.at(1);
    pair.flip_min = values.at(5);
    pair.flip_max = values.at(6);
    pair.max_difference = static_cast<int>(values.at(8));
    pair.above_0 = static_cast<int>(values.at(9));
    pair.above_2 = static_cast<int>(values.at(10));
    pair.above_8 = static_cast<int>(values.at(11));
    pair.above_16 = static_cast<int>(values.at(12));
    pair.expected = render::read_png(folder / (pair.name + ".ref.png"));
    pair.actual = render::read_png(folder / (pair.name + ".test.png"));
    pairs.push_back(std::move(pair));
  }
  return pairs;
}

}  // namespace substep::golden
