#include "golden/check/check_cases.h"

#include <algorithm>
#include <exception>
#include <memory>
#include <new>
#include <optional>
#include <utility>

#include "golden/check/case_check.h"
#include "sim/loading/load_scene.h"
#include "sim/scene/scene.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

/// Cases of one scene follow each other: it is loaded once.
class Stage {
 public:
  const Scene& scene(const fs::path& file) {
    if (!scene_ || scene_file_ != file) {
      scene_ = nullptr;
      scene_ = std::make_unique<Scene>(load_scene(file));
      scene_file_ = file;
    }
    return *scene_;
  }

 private:
  fs::path scene_file_;
  std::unique_ptr<Scene> scene_;
};

}  // namespace

CheckPlan plan_check(const CheckOptions& options) {
  CheckPlan plan{read_suite(options.suite), options, {}};
  plan.options.suite = plan.suite.file;
  plan.cases = select(plan.suite, options.cases);
  return plan;
}

std::vector<fs::path> CheckPlan::orphans() const {
  if (!options.cases.empty()) return {};
  return golden::orphans(suite);
}

void check_cases(std::span<const SuiteCase> cases, const CheckOptions& options, const MadeWith& made_with,
                 const CheckListener& listener) {
  Stage stage;
  for (const SuiteCase& entry : cases) {
    if (listener.before_case) listener.before_case(entry);
    CheckedCase checked;
    try {
      checked = check_case(options, made_with, entry, stage.scene(entry.scene));
    } catch (const std::bad_alloc&) {
      checked = failed_case(options, entry, "there is not enough memory for it");
    } catch (const std::exception& error) {
      checked = failed_case(options, entry, error.what());
    }
    if (listener.after_case) listener.after_case(checked);
  }
}

MadeWith made_with_here(const Suite& suite, std::span<const SuiteCase> cases, const CheckOptions& options) {
  const bool has_pictures =
      std::any_of(cases.begin(), cases.end(), [](const SuiteCase& entry) { return !entry.images.empty(); });
  return made_with(suite.folder(), options.images && has_pictures);
}

}  // namespace substep::golden
