// A densifier of a program's own, in one file: of each view's gradients it takes the largest, doubles that Gaussian
// every fifth step, and fades all. Its state resumes a run with the same bits.
#include <train/runs.hpp>

using namespace gart_test;

namespace {

template <class E>
class doubles_largest final : public gart::densifier<E> {
 public:
  explicit doubles_largest(E& exec) : gart::densifier<E>({0, 5, 0.8f}, 40), exec_(&exec), sum_(exec) {}

  bool by_gradient() const override { return true; }
  void observe(gart::gaussians<E> const& model, gart::gaussians<E> const& gradients, gart::camera const&) override {
    std::vector<float> sum = sum_.size() == model.size() ? sum_.to_host() : std::vector<float>(model.size());
    std::vector<float> const opacity = gradients.opacity.to_host();
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += std::abs(opacity[i]);
    sum_.assign(sum);
  }
  void penalty(gart::trained_gaussians<E>& g, gart::index_t total) override {
    std::vector<float> by = g.gradients.opacity.to_host();
    for (float& x : by) x += 0.1f / static_cast<float>(total);
    g.gradients.opacity.assign(by);
  }
  gart::density_change step(gart::trained_gaussians<E>& g, gart::density_step<E> const& now) override {
    if (!this->due(now.step)) return {};
    std::vector<float> const sum = sum_.to_host();
    gart::index_t const n = g.size();
    std::vector<gart::u32> from{static_cast<gart::u32>(std::max_element(sum.begin(), sum.end()) - sum.begin())};
    gart::buffer<gart::u32, E> const source(*exec_, from), target(*exec_, std::vector<gart::u32>{n});
    g.resize(n + 1);
    now.rows.copy(*exec_, g.model, source, target);
    gart::clear_moments(*exec_, g.moments, gart::span<gart::u32 const>(target), now.rows.owners());
    exec_->synchronize();
    sum_.assign(std::vector<float>(n + 1));
    return {0, 1, 0};
  }
  void save(gart::named_arrays& state) const override { state.set("gaussians/largest", sum_.to_host()); }
  void load(gart::named_arrays const& state) override { sum_.assign(state.get<float>("gaussians/largest")); }

 private:
  E* exec_;
  gart::buffer<float, E> sum_;
};

}  // namespace

TEST_CASE_TEMPLATE("a densifier of one's own grows a run", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  gart::dataset const data = capture(exec, seed);
  gart::gaussian_model const start = cloud(seed + 1, 0.6f);
  gart::train_options options;
  options.iterations = 40, options.densify = gart::densify_kind::none;
  auto const run_of_own = [&] {
    auto run = std::make_unique<run_of<E, gart::deterministic_method>>(exec, options, data, start);
    run->densify_by(std::make_unique<doubles_largest<E>>(exec));
    return run;
  };
  auto const whole = run_of_own();
  for (int i = 0; i < 40; ++i) CHECK(whole->step().gaussians == 150 + std::min(i + 1, 31) / 5);
  CHECK(whole->gradients().size() == 156);

  auto const first = run_of_own();
  for (int i = 0; i < 17; ++i) first->step();
  auto const second = run_of_own();
  second->set_state(first->state());
  while (second->steps_done() < 40) second->step();
  CHECK(same(second->model(), whole->model()));
}

TEST_CASE_TEMPLATE("one that forgets the moments is refused", E, GART_TEST_POLICIES) {
  struct forgets final : gart::densifier<E> {
    gart::density_change step(gart::trained_gaussians<E>& g, gart::density_step<E> const&) override {
      g.model.resize_keep(g.size() + 1);
      return {0, 1, 0};
    }
  };
  E exec;
  gart::dataset const data = capture(exec, 1);
  run_of<E> run(exec, still(9), data, cloud(2, 0.6f));
  run.densify_by(std::make_unique<forgets>());
  CHECK_THROWS_WITH_AS(run.step(), doctest::Contains("without their moments"), gart::invalid_argument);
}
