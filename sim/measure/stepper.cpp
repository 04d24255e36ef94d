#include "sim/measure/stepper.h"

#include <utility>

#include "sim/simulation.h"

namespace substep {
namespace {

class AlgorithmStepper : public Stepper {
 public:
  AlgorithmStepper(const Scene& scene, const Settings& settings) : simulation_(scene, settings) {}

  bool step() override {
    const StepReport& report = simulation_.step();
    row_solves_ += report.row_solves;
    return report.status != StepReport::Status::diverged;
  }
  const State& state() const override { return simulation_.state(); }
  std::optional<std::vector<ContactImpulse>> contact_impulses() const override {
    return simulation_.contact_impulses();
  }
  std::int64_t row_solves() const override { return row_solves_; }

 private:
  Simulation simulation_;
  std::int64_t row_solves_ = 0;
};

class RecordedStepper : public Stepper {
 public:
  explicit RecordedStepper(std::vector<State> states) : states_(std::move(states)) {}

  bool step() override {
    if (frame_ + 1 >= states_.size()) return false;
    ++frame_;
    return true;
  }
  const State& state() const override { return states_[frame_]; }

 private:
  std::vector<State> states_;
  std::size_t frame_ = 0;
};

}  // namespace

std::unique_ptr<Stepper> recorded_stepper(std::vector<State> states) {
  return std::make_unique<RecordedStepper>(std::move(states));
}

std::unique_ptr<Stepper> algorithm_stepper(const Scene& scene, const Settings& settings) {
  return std::make_unique<AlgorithmStepper>(scene, settings);
}

}  // namespace substep
