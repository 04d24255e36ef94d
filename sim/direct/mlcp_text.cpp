#include "sim/direct/mlcp_text.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "sim/error.h"

namespace substep {

std::string to_text(const Mlcp& problem) {
  std::string text = fmt::format("substep mlcp 1\nbodies {}\nrows {}\n", problem.bodies, problem.rows.size());
  for (const Mlcp::Row& row : problem.rows) {
    text += fmt::format("row {} {} {} {} {} {} {} {}", row.a, row.b, row.right, row.low, row.high,
                        row.softness, row.normal, row.friction);
    for (const Vector6& part : {row.part_a, row.part_b}) {
      for (const double value : part) text += fmt::format(" {}", value);
    }
    text += '\n';
  }
  return text;
}

Mlcp parse_mlcp(std::string_view text, const std::string& what) {
  int line_number = 0;
  std::string_view rest = text;
  std::vector<std::string_view> words;
  const auto fail = [&](const std::string& message) {
    throw Error(fmt::format("{}:{}: {}: not a problem that substep wrote", what, line_number, message));
  };
  const auto next_line = [&](std::string_view name, std::size_t count) {
    ++line_number;
    const std::size_t end = rest.find('\n');
    if (end == std::string_view::npos) fail("the file ends too early");
    words.clear();
    std::string_view line = rest.substr(0, end);
    rest.remove_prefix(end + 1);
    while (!line.empty()) {
      const std::size_t space = std::min(line.find(' '), line.size());
      if (space > 0) words.push_back(line.substr(0, space));
      line.remove_prefix(std::min(space + 1, line.size()));
    }
    if (words.size() != count + 1 || words[0] != name)
      fail(fmt::format("expected '{}' and {} values", name, count));
  };
  const auto parsed = [&]<typename Number>(std::size_t word, Number value) {
    const std::string_view digits = words[word];
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error != std::errc{} || end != digits.data() + digits.size())
      fail(fmt::format("'{}' is no number", digits));
    return value;
  };
  next_line("substep", 2);
  if (words[1] != "mlcp" || words[2] != "1") fail("another format");
  Mlcp problem;
  next_line("bodies", 1);
  problem.bodies = parsed(1, 0);
  next_line("rows", 1);
  const int rows = parsed(1, 0);
  if (problem.bodies < 0 || rows < 0) fail("negative counts");
  for (int i = 0; i < rows; ++i) {
    next_line("row", 20);
    Mlcp::Row row{};
    row.a = parsed(1, 0);
    row.b = parsed(2, 0);
    row.right = parsed(3, 0.0);
    row.low = parsed(4, 0.0);
    row.high = parsed(5, 0.0);
    row.softness = parsed(6, 0.0);
    row.normal = parsed(7, 0);
    row.friction = parsed(8, 0.0);
    for (int k = 0; k < 6; ++k) {
      row.part_a[k] = parsed(9 + k, 0.0);
      row.part_b[k] = parsed(15 + k, 0.0);
    }
    const bool known = row.a >= -1 && row.a < problem.bodies && row.b >= -1 && row.b < problem.bodies;
    if (!known || row.normal < -1 || row.normal >= i) fail("a body or a normal's row that is not there");
    const bool finite = row.part_a.allFinite() && row.part_b.allFinite() && std::isfinite(row.right);
    if (!finite || !(row.low <= row.high) || !(row.softness >= 0) || !(row.friction >= 0))
      fail("values out of range");
    problem.rows.push_back(row);
  }
  return problem;
}

}  // namespace substep
