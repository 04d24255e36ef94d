#include "sim/simulation.h"
#include "tests/benchmark/contestant.h"

namespace substep::benchmark {
namespace {

class Ours final : public Contestant {
 public:
  Ours(const Scene& scene, const Settings& settings) : simulation_(scene, settings) {}
  void step() override { simulation_.step(); }
  Vector3 position(int body) const override { return simulation_.state().q[body].linear; }

 private:
  Simulation simulation_;
};

}  // namespace

std::unique_ptr<Contestant> make_ours(const Scene& scene, const Settings& settings) {
  return std::make_unique<Ours>(scene, settings);
}

}  // namespace substep::benchmark
