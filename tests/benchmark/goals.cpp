#include "tests/benchmark/goals.h"

#include <fmt/format.h>

#include <cmath>

namespace substep::benchmark {

std::vector<Goal> goals(const Results& results) {
  std::vector<Goal> all;
  const auto add = [&](const std::string& about, const std::string& what, const std::string& one,
                       const std::string& other, const std::string& figure, double limit,
                       bool at_least = false) {
    const double ratio = results.median(one, figure) / results.median(other, figure);
    if (!std::isfinite(ratio)) return;
    Goal goal{about, what, ratio, limit, at_least, ""};
    for (const std::string& name : {one, other}) {
      if (results.failed(name)) goal.remark += (goal.remark.empty() ? "" : ", ") + name;
    }
    all.push_back(goal);
  };
  for (const std::string scene : {"pendulum", "chain 10", "heavy chain"}) {
    add("joints", "A1 on " + scene + " / dWorldStep", scene + "/A1", scene + "/dWorldStep", "us_per_step",
        0.5);
  }
  for (const std::string scene : {"pendulum", "chain 10", "heavy chain"}) {
    add("joints", "A5 n=4 on " + scene + " / QuickStep 20", scene + "/A5 n=4 m=1", scene + "/QuickStep 20",
        "us_per_step", 0.5);
  }
  add("A1 by size", "A1 a link, chain of 10000 / of 100", "chain 10000/A1", "chain 100/A1",
      "ns_per_body_step", 1.2);
  for (const std::string scene : {"pyramid 55", "pyramid 210", "pyramid 465", "pile 250", "pile 2000"}) {
    add(scene.substr(0, scene.find(' ')) + "s", "A5 n=10 on " + scene + " / Bullet 10", scene + "/A5 n=10",
        scene + "/Bullet SI 10", "us_per_step", 0.28);
  }
  add("piles", "A5 n=10 a body-step, pile of 2000 / of 250", "pile 2000/A5 n=10", "pile 250/A5 n=10",
      "ns_per_body_step", 1.2);
  const std::pair<const char*, double> stacks[] = {
      {"stack 10", 1}, {"stack 10 top 100 kg", 5}, {"stack 10 top 1000 kg", 12}};
  for (const auto& [scene, milliseconds] : stacks) {
    for (const int frequency : {60, 15}) {
      const std::string name = fmt::format("{}, h = 1/{} s/cheapest that stands", scene, frequency);
      const double measured = results.median(name, "ms_per_second");
      if (!std::isfinite(measured)) continue;
      const std::string what =
          fmt::format("{} on {}, moved {:.2g} m in 10 s: ms a simulated second / {}", results.remark(name),
                      scene, results.median(name, "moved_m"), milliseconds);
      all.push_back({"stacks", what, measured / milliseconds, 1, false, ""});
    }
  }
  add("A1 by size", "A1 a row, pyramid of 210 / of 15", "pyramid 210/cost of A1", "pyramid 15/cost of A1",
      "ns_per_row", 2);
  add("A1 by size", "A1 a row, pyramid of 465 / of 55", "pyramid 465/cost of A1", "pyramid 55/cost of A1",
      "ns_per_row", 2);
  for (const auto& [scene, limit] : {std::pair("pyramid 55", 2.0), std::pair("pyramid 210", 2.0),
                                     std::pair("pyramid 465", 2.0), std::pair("wall 100", 6.0)}) {
    const std::string name = scene;
    add("heaps", "A1 on " + name + " / A5 n=10", name + "/cost of A1", name + "/A5 n=10", "us_per_step",
        limit);
  }
  add("kernel", "row solves of A5 on pile 250: the machine's limit / measured",
      "pile 250/row solves at the machine's limit", "pile 250/row solves A5", "ns_per_row_solve", 0.5, true);
  for (const std::string scene : {"pyramid 55", "pyramid 210", "pyramid 465", "pile 250", "pile 2000"}) {
    const double part = results.median(scene + "/stages of A5 n=10", "part_of_rows");
    if (std::isfinite(part))
      all.push_back({"stages", "s1 and s2 of A5 on " + scene + ", of a step", part, 0.4, false, ""});
  }
  for (const auto& [name, milliseconds] :
       {std::pair("substep --help", 10.0), std::pair("substep check", 10000.0)}) {
    const double measured = results.median(name, "ms_of_program");
    if (!std::isfinite(measured)) continue;
    all.push_back({"program", fmt::format("{}: ms of CPU time / {:g}", name, milliseconds),
                   measured / milliseconds, 1, false, results.failed(name) ? name : ""});
  }
  return all;
}

std::string lines(const std::vector<Goal>& goals) {
  std::string text;
  for (const Goal& goal : goals) {
    text += fmt::format("goal, {}: {} = {:.3g} (wanted {} {}){}\n", goal.about, goal.what, goal.ratio,
                        goal.at_least ? ">=" : "<=", goal.limit,
                        goal.remark.empty() ? "" : "; fails its check: " + goal.remark);
  }
  return text;
}

std::string markdown(const std::vector<Goal>& goals) {
  std::string text = "| of | ratio | measured | wanted | fails its check |\n|---|---|---:|---:|---|\n";
  for (const Goal& goal : goals) {
    text += fmt::format("| {} | {} | {:.3g} | {} {} | {} |\n", goal.about, goal.what, goal.ratio,
                        goal.at_least ? "≥" : "≤", goal.limit, goal.remark);
  }
  return text;
}

}  // namespace substep::benchmark
