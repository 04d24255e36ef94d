#include "golden/check/case_context.h"

namespace substep::golden {
std::vector<std::string> body_names(const Scene& scene) {
  std::vector<std::string> names;
  for (const Body& body : scene.bodies) names.push_back(body.name);
  return names;
}

CaseContext::CaseContext(const CheckOptions& options_of, const MadeWith& with, const SuiteCase& entry,
                         const Scene& of)
    : options(options_of), made_with(with), scene(of), folder(options.output / entry.name) {
  result.entry = entry;
  result.files = options.output / entry.name;
  result.entry.settings = entry.settings_for(scene);
  result.step = result.entry.settings.step;
  sidecar = read_sidecar(entry.sidecar);
}

bool CaseContext::is_exact_here() const {
  if (!result.entry.any_renderer) return made_with.is_pinned;
  return sidecar.platform == made_with.platform;
}

void CaseContext::note(std::string_view text) {
  result.notes.emplace_back(text);
}

}  // namespace substep::golden
