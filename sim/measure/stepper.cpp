#include "sim/measure/stepper.h"

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
  std::int64_t row_solves() const override { return row_solves_; }

 private:
  Simulation simulation_;
  std::int64_t row_solves_ = 0;
};

}  // namespace

std::unique_ptr<Stepper> algorithm_stepper(const Scene& scene, const Settings& settings) {
  return std::make_unique<AlgorithmStepper>(scene, settings);
}

}  // namespace substep
