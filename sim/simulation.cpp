#include "sim/simulation.h"

#include <algorithm>
#include <utility>

#include "sim/algorithms.h"
#include "sim/constraints/contact_finder.h"
#include "sim/constraints/formulate.h"
#include "sim/direct/frozen_problem.h"
#include "sim/math/floating_point.h"
#include "sim/model/model.h"

namespace substep {

struct Simulation::Implementation {
  Implementation(const Scene& s, const Settings& set, Procedure p)
      : scene(s),
        settings(set),
        procedure(std::move(p)),
        model(build_model(s)),
        finder(scene, model, settings.algorithm == Algorithm::a3),
        state(initial_state(s)) {
    sub_stepped = settings.algorithm >= Algorithm::a3;
    is_direct = settings.algorithm == Algorithm::a1;
    is_descendant = !is_of_report(settings.algorithm) && !procedure;
    problem.model = &model;
    problem.substeps.bias_at_next_frame = settings.algorithm == Algorithm::a3;
    problem.substeps.count = sub_stepped && settings.algorithm != Algorithm::avbd ? settings.substeps : 1;
    build_blocks(problem, is_descendant ? Joints::plain : sub_stepped ? settings.joints : Joints::rows);
    // Use the contacts' τ and κ for all where there are no joints: A5 scales its sum of velocities by the
    // joints' τ/κ, and contacts with another ratio undo the difference.
    if (problem.c.blocks.empty()) {
      const auto [tau, kappa] = settings.of_contacts();
      settings.tau = tau;
      settings.kappa = kappa;
    }
    part_settings = settings;
    is_jointed.resize(state.v.size());
    for (const Block& x : problem.c.blocks) is_jointed[x.a] = is_jointed[x.b] = true;
    is_warm = settings.warm_start > 0 || (is_direct && model.contacts && !procedure);
    reserve();
    report.rows = static_cast<int>(problem.c.row_count());
    if (!sub_stepped && !procedure) divide_step();
    most_equal_parts = equal_parts;
  }

  /// Reserves memory, so that steps after the first allocate none.
  void reserve() {
    const std::size_t contacts = model.contacts ? 16 * scene.colliders.size() : 0;  // as ContactFinder does
    for (State* kept : {&state, &before, &next}) {
      kept->contacts.reserve(contacts);
      kept->patches.reserve(contacts);
      if (is_descendant || is_warm) kept->joint_forces.reserve(2 * problem.c.rows.size());
    }
    earlier_impulses.reserve(6 * contacts);
    problem.kept_patches = &finder.kept_patches();
    for (VelocityVector* v : {&work.sum, &work.sum_v, &problem.substeps.offset, &problem.substeps.change})
      v->resize(state.v.size());
  }

  /// Sets how many equal parts a step has. A1 and A2 evaluate the geometric stiffness of taut joints at the
  /// step's start, so that frequencies above 2/h diverge. A swinging body pulls with at most three times its
  /// weight, which raises frequencies by √3. So frequencies at the scene's start may be at most 1/h.
  void divide_step() {
    if (std::ranges::find(model.locks, Lock::Kind::point, &Lock::kind) == model.locks.end()) return;
    follows_tension = is_direct;
    stiffness.reserve(state.q.size());
    const std::vector<Contact>& contacts =
        model.contacts ? finder.find(state, settings.step, 1, true) : no_contacts;
    const double frequency = frequency_at_rest(model, contacts, state.q, settings.step);
    equal_parts = static_cast<int>(std::clamp(std::ceil(settings.step * frequency), 1.0, most_divided));
  }

  /// Takes the step in its equal parts.
  void step() {
    before.q = state.q;
    before.v = state.v;
    is_continued = false;
    work.row_solves = 0;
    report.status = StepReport::Status::ok;
    report.residual = report.contradicting = 0;
    earlier_impulses.clear();
    // Take more parts in A1 after a step in which joints pulled harder. A2 keeps the start's number, so that
    // each step has as many rows. A part removes its fraction of a gap: removed faster, it pulls harder yet.
    const double needed = std::ceil(settings.step * state.transverse_frequency / allowed_swing);
    const int parts = std::max(equal_parts, static_cast<int>(std::min(needed, most_divided)));
    most_equal_parts = std::max(most_equal_parts, parts);
    equal_part = settings.step / parts;
    for (int i = 0; i < parts; ++i) {
      if (i > 0) start_next_part();
      take_equal_part();
      if (report.status == StepReport::Status::diverged) {
        state.q = before.q;
        state.v = before.v;
        if (is_continued) swap_caches(state, before);
        return;
      }
    }
    if (follows_tension) {
      // Reduce the limit by more than rounding, which would else divide steps of one size in nine.
      const double least = (1 - 1e-9) * equal_parts * allowed_swing / settings.step;
      state.transverse_frequency = transverse_frequency(problem, part_settings.step, least, stiffness);
    }
    ++steps;
  }

  static void swap_caches(State& a, State& b) {
    a.contacts.swap(b.contacts);
    a.patches.swap(b.patches);
    a.joint_forces.swap(b.joint_forces);
  }

  /// Keeps the impulses of the step's last part and, after the first one, the caches from before it.
  void start_next_part() {
    append_contact_impulses(earlier_impulses);
    if (!std::exchange(is_continued, true)) swap_caches(before, next);
  }

  /// Takes an equal part of the step. Where an impact deflects a body into another one, the part stops at
  /// that impact and continues from there.
  void take_equal_part() {
    tried_parts = 0;
    for (double rest = equal_part; rest > 0;) {
      if (rest < equal_part) start_next_part();
      const double part = take_part(rest);
      if (report.status == StepReport::Status::diverged) return;
      rest -= part;
    }
  }

  /// Advances the state by `rest`, or by the part of it during which its contacts hold. Returns the advance,
  /// s.
  double take_part(double rest) {
    constexpr int most_parts = 64;
    const double shortest = 1e-6 * equal_part;
    start_q = state.q;
    start_v = state.v;
    const StepReport earlier = report;
    for (double part = rest;;) {
      report = earlier;
      const bool is_last = ++tried_parts >= most_parts;
      find_contacts(part, is_last);
      double sooner = is_last ? part : std::max(finder.first_timed_impact(), shortest);
      if (!(sooner < part)) {
        take(part);
        if (report.status == StepReport::Status::diverged) return part;
        const auto missed = is_last ? std::nullopt : finder.missed(start_q, state.q, part);
        // Stop at the first impact: it bends the path to what was missed, whose time is known only
        // afterwards.
        const double first = finder.first_impact();
        if (missed) sooner = std::max(first < part ? first : *missed, shortest);
        if (!missed || !(sooner < part)) {
          swap_caches(state, next);
          if (report.status == StepReport::Status::unsolved && earlier.status != report.status)
            first_unsolved = work.mlcp;
          return part;
        }
        state.q = start_q;
        state.v = start_v;
      }
      part = sooner;
    }
  }

  /// s1, geometry: finds the contacts of the next `duration`.
  void find_contacts(double duration, bool all_contacts) {
    part_settings.step = duration;
    problem.substeps.part = duration / (settings.step / equal_parts);
    problem.substeps.duration = duration / problem.substeps.count;
    if (!model.contacts) return;
    problem.contacts =
        &finder.find(state, duration, problem.substeps.count, is_direct, problem.substeps.part, all_contacts);
  }

  /// Advances the state by `duration`, with the contacts that were found for it.
  void take(double duration) {
    if (model.contacts) {
      // Leave out descendants, which have their own contact rows, and patches in A1, which solves all points.
      if (!is_descendant) build_contacts(problem, is_direct ? no_coordinates : state.q);
      report.contacts = static_cast<int>(problem.contacts->size());
      for (const PatchShape& patch : problem.c.contacts.shapes) {
        if (patch.is_kept) report.contacts += patch.corners;
      }
      report.rows = static_cast<int>(problem.c.row_count()) + (is_descendant ? 3 * report.contacts : 0);
    }
    shift_velocities(1, duration);
    // s2: rows
    formulate(problem, state.q, problem.substeps.duration);
    // s3, s4
    if (sub_stepped) {
      problem.substeps.stepped = state.q;
      set_zero(problem.substeps.offset);
      to_local(problem.rotations, state.v);
    }
    if (is_descendant) start_joints();
    if (is_warm) start_warm();
    if (procedure) {
      procedure(state.q, state.v, part_settings, problem, work);
    } else {
      run_algorithm();
    }
    if (sub_stepped) {
      for (std::size_t i = 0; i < state.q.size(); ++i)
        state.v[i].angular = state.q[i].angular * state.v[i].angular;
    }
    shift_velocities(-1, duration);
    report.row_solves = work.row_solves;
    if (!is_finite(state, &report.diverged_body, &model)) {
      report.status = StepReport::Status::diverged;
      return;
    }
    if (is_descendant) {
      next.joint_forces = work.carried.joints;
      substep::remember(*problem.contacts, work.carried.contacts, next.contacts);
    } else if (is_warm) {
      remember_joints();
    }
    if (model.contacts && !is_descendant) {
      problem.c.contacts.remember(*problem.contacts, state.q, !is_direct, next.contacts, next.patches);
    }
  }

  /// In steps of v' = v + g hs, x' = x + hs v', a body in flight keeps to a parabola on which its velocity is
  /// v + g hs/2. Where a part of a step has shorter sub-steps, this converts v to theirs (`sign` = 1) and
  /// back (−1), so that flights, and heights after impacts, do not depend on where a step is divided.
  void shift_velocities(double sign, double duration) {
    if (duration == equal_part || !model.contacts) return;
    const double difference = (equal_part - duration) / problem.substeps.count;
    for (std::size_t i = 1; i < state.v.size(); ++i) {
      const auto body = static_cast<int>(i);
      if (is_jointed[i] || finder.is_at_rest(body)) continue;
      state.v[i].linear += sign * difference / 2 * finder.fall_of(body);
    }
  }

  /// Starts joints' rows from the last step's forces.
  void start_joints() {
    for (std::size_t i = 0; i < problem.c.rows.size(); ++i) {
      const bool is_known = i < state.joint_forces.size();
      problem.c.rows[i].impulse = is_known ? problem.substeps.duration * state.joint_forces[i] : 0;
    }
  }

  /// Continues the impulses of the last step: A2 to A5 begin with a fraction of them, A1 with the active set
  /// that they give.
  void start_warm() {
    const double duration = problem.substeps.duration;
    const double joint_scale = settings.algorithm == Algorithm::a5 ? settings.kappa : 1;
    const double contact_scale = scale_of_contact_impulses();
    problem.warm_start = {is_direct ? 0 : settings.warm_start, joint_scale, contact_scale};
    problem.c.last_step_impulses.assign(problem.c.rows.size(), 0);
    for (std::size_t i = 0; i < std::min(state.joint_forces.size(), problem.c.rows.size()); ++i)
      problem.c.last_step_impulses[i] = duration / joint_scale * state.joint_forces[i];
    set_start_impulses(problem.c.contacts, *problem.contacts, duration, contact_scale);
  }

  /// Returns the factor of A5's contact impulses relative to its rows' λ□, else 1.
  double scale_of_contact_impulses() const {
    return settings.algorithm == Algorithm::a5 ? settings.of_contacts().kappa : 1;
  }

  /// Stores joints' impulses of the last sub-step as forces.
  void remember_joints() {
    next.joint_forces.clear();
    for (const Row& row : problem.c.rows)
      next.joint_forces.push_back(problem.warm_start.joint_scale / problem.substeps.duration * row.impulse);
  }

  /// Appends the impulses of contacts in the last part of a step.
  void append_contact_impulses(std::vector<ContactImpulse>& impulses) const {
    if (is_descendant) {
      substep::append_contact_impulses(*problem.contacts, work.carried.contacts, state.q, impulses);
      return;
    }
    const std::size_t earlier = impulses.size();
    substep::append_contact_impulses(problem, state.q, impulses);
    for (std::size_t i = earlier; i < impulses.size(); ++i)
      impulses[i].impulse *= scale_of_contact_impulses();
  }

  void run_algorithm() {
    switch (settings.algorithm) {
      case Algorithm::a1:
        return run_a1();
      case Algorithm::a2:
        return proc2(state.q, state.v, part_settings, problem, work);
      case Algorithm::a3:
        return proc3(state.q, state.v, part_settings, problem, work);
      case Algorithm::a4:
        return proc4(state.q, state.v, part_settings, problem, work);
      case Algorithm::a5:
        return proc5(state.q, state.v, part_settings, problem, work);
      case Algorithm::soft:
        work.row_solves += soft_step(state.q, state.v, part_settings, problem, work.soft, work.carried);
        return;
      case Algorithm::avbd:
        work.row_solves +=
            avbd(state.q, state.v, part_settings, problem, state.joint_forces, work.avbd, work.carried);
        return;
    }
  }

  void run_a1() {
    proc1(state.q, state.v, part_settings, problem, work);
    if (is_warm || follows_tension) keep_impulses(work.lambda, problem.c);
    report.active_sets = work.report.active_sets;
    report.residual = std::max(report.residual, work.report.residual);
    report.contradicting = std::max(report.contradicting, work.report.contradicting);
    // MlcpReport's statuses are the first three of StepReport.
    report.status = std::max(report.status, static_cast<StepReport::Status>(work.report.status));
  }

  Scene scene;
  Settings settings;
  Procedure procedure;
  Model model;
  ContactFinder finder;
  State state;
  State before;                      ///< the step's start, with caches where `is_continued`
  bool is_continued = false;         ///< the step has a second part
  std::vector<Coordinates> start_q;  ///< at the current part's start
  std::vector<Velocity> start_v;
  State next;  ///< caches alone, of the current part's end
  Settings part_settings;
  bool is_warm = false;  ///< the last step's impulses are kept for the next
  /// Largest h ω of a swing, ω in rad/s; explicit steps diverge above 2.
  static constexpr double allowed_swing = 1.7;
  static constexpr double most_divided = 64;     ///< most equal parts of a step
  bool follows_tension = false;                  ///< A1 with a joint that locks a point
  std::vector<Matrix3> stiffness;                ///< by body
  int equal_parts = 1;                           ///< least number of equal parts of a step
  int most_equal_parts = 1;                      ///< largest number so far
  double equal_part = 0;                         ///< duration of each, s
  Mlcp first_unsolved;                           ///< of the parts of an unsolved step
  int tried_parts = 0;                           ///< in the current equal part
  std::vector<bool> is_jointed;                  ///< by body
  std::vector<ContactImpulse> earlier_impulses;  ///< of all parts of the step but the last
  bool sub_stepped;    ///< all but A1 and A2: take() has angular velocities in body frames
  bool is_direct;      ///< A1
  bool is_descendant;  ///< Soft Step, AVBD
  const std::vector<Coordinates> no_coordinates;
  Problem problem;
  Work work;
  StepReport report;
  std::int64_t steps = 0;
};

Simulation::Simulation(const Scene& scene, const Settings& settings, Procedure procedure) {
  const DefaultFloatingPoint environment;
  check(settings);
  implementation_ = std::make_unique<Implementation>(scene, settings, std::move(procedure));
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
  if (implementation_->steps == 0) return {};
  std::vector<ContactImpulse> impulses = implementation_->earlier_impulses;
  implementation_->append_contact_impulses(impulses);
  return impulses;
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
int Simulation::equal_parts() const {
  return implementation_->most_equal_parts;
}

void Simulation::set_state(const State& state) {
  require_valid(state, scene());
  implementation_->state = state;
}

std::string Simulation::modelled() const {
  return description(implementation_->model);
}

std::string Simulation::last_problem() const {
  const Implementation& i = *implementation_;
  if (i.settings.algorithm != Algorithm::a1) return "";
  return to_text(i.report.status == StepReport::Status::unsolved ? i.first_unsolved : i.work.mlcp);
}

}  // namespace substep
