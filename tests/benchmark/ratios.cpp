#include "tests/benchmark/ratios.h"

#include <fmt/format.h>

#include <cmath>

namespace substep::benchmark {

std::string ratios(const Results& results) {
  std::string text = "| of | ratio | measured | fails its check |\n|---|---|---:|---|\n";
  const auto add = [&](const std::string& about, const std::string& what, const std::string& one,
                       const std::string& other, const std::string& figure) {
    const double ratio = results.median(one, figure) / results.median(other, figure);
    if (!std::isfinite(ratio)) return;
    std::string failed;
    for (const std::string& name : {one, other}) {
      if (results.failed(name)) failed += (failed.empty() ? "" : ", ") + name;
    }
    text += fmt::format("| {} | {} | {:.3g} | {} |\n", about, what, ratio, failed);
  };
  for (const std::string scene : {"pendulum", "chain 10", "heavy chain"}) {
    add("joints", "A1 on " + scene + " / dWorldStep", scene + "/A1", scene + "/dWorldStep", "us_per_step");
  }
  for (const std::string scene : {"pendulum", "chain 10", "heavy chain"}) {
    add("joints", "A5 n=4 on " + scene + " / QuickStep 20", scene + "/A5 n=4 m=1", scene + "/QuickStep 20",
        "us_per_step");
  }
  add("A1 by size", "A1 a link, chain of 10000 / of 100", "chain 10000/A1", "chain 100/A1",
      "ns_per_body_step");
  for (const std::string scene : {"pyramid 55", "pyramid 210", "pyramid 465", "pile 250", "pile 2000"}) {
    add(scene.substr(0, scene.find(' ')) + "s", "A5 n=10 on " + scene + " / Bullet 10", scene + "/A5 n=10",
        scene + "/Bullet SI 10", "us_per_step");
  }
  add("piles", "A5 n=10 a body-step, pile of 2000 / of 250", "pile 2000/A5 n=10", "pile 250/A5 n=10",
      "ns_per_body_step");
  add("A1 by size", "A1 a row, pyramid of 210 / of 15", "pyramid 210/cost of A1", "pyramid 15/cost of A1",
      "ns_per_row");
  add("A1 by size", "A1 a row, pyramid of 465 / of 55", "pyramid 465/cost of A1", "pyramid 55/cost of A1",
      "ns_per_row");
  for (const std::string scene : {"pyramid 55", "pyramid 210", "pyramid 465", "wall 100"}) {
    add("heaps", "A1 on " + scene + " / A5 n=10", scene + "/cost of A1", scene + "/A5 n=10", "us_per_step");
  }
  return text;
}

}  // namespace substep::benchmark
