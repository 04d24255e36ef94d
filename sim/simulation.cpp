#include "sim/simulation.h"

#include <utility>

#include "sim/algorithms.h"
#include "sim/constraints/contact_finder.h"
#include "sim/constraints/formulate.h"
#include "sim/direct/mlcp_text.h"
#include "sim/error.h"
#include "sim/math/floating_point.h"
#include "sim/model/model.h"

namespace substep {
namespace {

/// World angular velocities from local ones, at coordinates that have no rotation matrices yet.
void to_world(const CoordinateVector& q, VelocityVector& v) {
  for (std::size_t i = 0; i < q.size(); ++i) v[i].angular = q[i].angular * v[i].angular;
}

StepReport::Status status_of(MlcpReport::Status status) {
  switch (status) {
    case MlcpReport::Status::solved:
      break;
    case MlcpReport::Status::least_squares:
      return StepReport::Status::least_squares;
    case MlcpReport::Status::unsolved:
      return StepReport::Status::unsolved;
  }
  return StepReport::Status::ok;
}

}  // namespace

struct Simulation::Implementation {
  Implementation(const Scene& s, const Settings& set, Procedure p, const ContactReading& how)
      : scene(s),
        settings(set),
        procedure(std::move(p)),
        reading(how),
        model(build_model(s)),
        finder(scene, model),
        state(initial_state(s)) {
    sub_stepped = settings.algorithm >= Algorithm::a3;
    problem.model = &model;
    problem.contacts = &no_contacts;
    problem.frame = settings.algorithm == Algorithm::a2 ? Frame::world : Frame::body;
    problem.c.contacts.reading = reading;
    problem.substeps.bias_at_next_frame = settings.algorithm == Algorithm::a3;
    problem.substeps.duration = sub_stepped ? settings.step / settings.substeps : settings.step;
    joints = sub_stepped ? settings.joints : Joints::rows;
    build_blocks(problem, joints);
    // A5's sum of velocities is scaled by one τ/κ, the joints', and contacts that have another undo the rest.
    // Where there are no joints it is the contacts', and nothing has to be undone.
    if (problem.c.blocks.empty()) {
      const auto [tau, kappa] = settings.of_contacts();
      settings.tau = tau;
      settings.kappa = kappa;
    }
    if (model.contacts) state.contacts.reserve(16 * scene.colliders.size());  // as ContactFinder has
    work.sum.resize(state.v.size());
    work.sum_v.resize(state.v.size());
    work.change.resize(state.v.size());
    problem.substeps.offset.resize(state.v.size());
    report.rows = static_cast<int>(problem.c.row_count());
  }

  void step() {
    // s1: geometry
    if (model.contacts) {
      // A1's solution is the same for all tangents; its sweeps, which start its active sets, are not.
      const bool aligned = settings.algorithm == Algorithm::a1 || !reading.isotropic_friction;
      problem.contacts = &finder.find(state, settings.step, aligned);
      build_blocks(problem, joints);
      report.contacts = static_cast<int>(problem.contacts->size());
      report.rows = static_cast<int>(problem.c.row_count());
    }
    // s2: rows
    formulate(problem, state.q, problem.substeps.duration);
    // s3, s4
    before_q = state.q;
    before_v = state.v;
    work.row_solves = 0;
    report.status = StepReport::Status::ok;
    if (sub_stepped) {
      problem.substeps.stepped = state.q;
      set_zero(problem.substeps.offset);
      to_local(problem.rotations, state.v);
    }
    if (procedure) {
      procedure(state.q, state.v, settings, problem, work);
    } else {
      run_algorithm();
    }
    if (sub_stepped) to_world(state.q, state.v);
    report.row_solves = work.row_solves;
    if (!is_finite(state, &report.diverged_body)) {
      report.status = StepReport::Status::diverged;
      state.q = before_q;
      state.v = before_v;
      return;
    }
    if (model.contacts && settings.algorithm != Algorithm::a1) {
      problem.c.contacts.remember(*problem.contacts, state.q, state.contacts);
    }
    ++steps;
  }

  void run_algorithm() {
    switch (settings.algorithm) {
      case Algorithm::a1:
        proc1(state.q, state.v, settings, problem, work);
        report.active_sets = work.report.active_sets;
        report.residual = work.report.residual;
        report.contradicting = work.report.contradicting;
        report.status = status_of(work.report.status);
        break;
      case Algorithm::a2:
        proc2(state.q, state.v, settings, problem, work);
        break;
      case Algorithm::a3:
        proc3(state.q, state.v, settings, problem, work);
        break;
      case Algorithm::a4:
        proc4(state.q, state.v, settings, problem, work);
        break;
      case Algorithm::a5:
        proc5(state.q, state.v, settings, problem, work);
        break;
    }
  }

  Scene scene;
  Settings settings;
  Procedure procedure;
  ContactReading reading;
  Model model;
  ContactFinder finder;
  State state;
  std::vector<Coordinates> before_q;
  std::vector<Velocity> before_v;
  bool sub_stepped;  ///< A3–A5: velocities are v̆ between to_local and to_world
  Joints joints;
  std::vector<Contact> no_contacts;
  Problem problem;
  Work work;
  StepReport report;
  std::int64_t steps = 0;
};

Simulation::Simulation(const Scene& scene, const Settings& settings)
    : Simulation(scene, settings, Procedure{}) {}

Simulation::Simulation(const Scene& scene, const Settings& settings, Procedure procedure)
    : Simulation(scene, settings, std::move(procedure), ContactReading{}) {}

Simulation::Simulation(const Scene& scene, const Settings& settings, const ContactReading& reading)
    : Simulation(scene, settings, Procedure{}, reading) {}

Simulation::Simulation(const Scene& scene, const Settings& settings, Procedure procedure,
                       const ContactReading& reading) {
  const DefaultFloatingPoint environment;
  check(settings);
  implementation_ = std::make_unique<Implementation>(scene, settings, std::move(procedure), reading);
}
Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;

const StepReport& Simulation::step() {
  const DefaultFloatingPoint environment;
  implementation_->step();
  return implementation_->report;
}

const State& Simulation::state() const {
  return implementation_->state;
}
std::vector<ContactImpulse> Simulation::contact_impulses() const {
  const Implementation& of = *implementation_;
  if (of.steps == 0) return {};
  const bool is_direct = of.settings.algorithm == Algorithm::a1 && !of.procedure;
  return substep::contact_impulses(of.problem, of.state.q, is_direct ? &of.work.lambda : nullptr);
}
const Settings& Simulation::settings() const {
  return implementation_->settings;
}
const Scene& Simulation::scene() const {
  return implementation_->scene;
}
std::int64_t Simulation::steps() const {
  return implementation_->steps;
}

void Simulation::set_state(const State& state) {
  if (state.q.size() != implementation_->state.q.size() || state.v.size() != state.q.size()) {
    throw Error("set_state: the state has another number of bodies than the scene");
  }
  implementation_->state = state;
}

std::string Simulation::modelled() const {
  return description(implementation_->model);
}

std::string Simulation::last_problem() const {
  return implementation_->settings.algorithm == Algorithm::a1 ? to_text(implementation_->work.mlcp) : "";
}

}  // namespace substep
