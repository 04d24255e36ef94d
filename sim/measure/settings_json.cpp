#include "sim/measure/settings_json.h"

#include "sim/error.h"

namespace substep {

nlohmann::ordered_json to_json(const Settings& s) {
  return {{"algorithm", name(s.algorithm)},
          {"step", s.step},
          {"substeps", s.substeps},
          {"iterations", s.iterations},
          {"tau", s.tau},
          {"kappa", s.kappa},
          {"joints", name(s.joints)},
          {"relaxation", s.relaxation},
          {"tolerance", s.tolerance}};
}

Settings settings_in(const nlohmann::ordered_json& json) {
  const auto algorithm = algorithm_named(json.at("algorithm").get<std::string>());
  const auto joints = joints_named(json.at("joints").get<std::string>());
  if (!algorithm || !joints) throw Error("unknown settings");
  Settings s;
  s.algorithm = *algorithm;
  s.joints = *joints;
  json.at("step").get_to(s.step);
  json.at("substeps").get_to(s.substeps);
  json.at("iterations").get_to(s.iterations);
  json.at("tau").get_to(s.tau);
  json.at("kappa").get_to(s.kappa);
  json.at("relaxation").get_to(s.relaxation);
  json.at("tolerance").get_to(s.tolerance);
  return s;
}

}  // namespace substep
