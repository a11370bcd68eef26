// A part of a program's own that is learned besides the Gaussians, in one file: one gain for all photographs. And what
// a program does between the parts of a step.
#include <train/runs.hpp>

using namespace gart_test;

namespace {

template <class Frame>
class learned_gain final : public gart::learned_part<Frame> {
  using E = typename Frame::execution_type;

 public:
  explicit learned_gain(E& exec) : exec_(&exec), shown_(exec) {}

  std::size_t numbers() const override { return 1; }
  gart::part_needs needs(std::size_t, int, int) const override { return {.image = true}; }
  gart::span<float const> before_loss(gart::step_view const&, gart::span<float const> image,
                                      gart::span<float>) override {
    image_.resize(image.size());
    exec_->copy_out(image_.data(), image.data(), image.size() * sizeof(float));
    std::vector<float> shown = image_;
    for (float& x : shown) x *= gain_[0];
    shown_.assign(shown);
    return shown_;
  }
  void after_loss(gart::step_view const&, gart::span<float> gradient, gart::span<float> numbers) override {
    std::vector<float> by(gradient.size());
    exec_->copy_out(by.data(), gradient.data(), by.size() * sizeof(float));
    float sum = 0;
    for (std::size_t i = 0; i < by.size(); ++i) sum += by[i] * image_[i], by[i] *= gain_[0];
    exec_->copy_in(gradient.data(), by.data(), by.size() * sizeof(float));
    exec_->copy_in(numbers.data(), &sum, sizeof sum);
  }
  void step(std::size_t, int, gart::span<float const> numbers, int, int, gart::learning_rates const&) override {
    gain_[0] -= 0.1f * numbers.data()[0];
  }
  void save(gart::named_arrays& state) const override { state.set("gain", gain_); }
  void load(gart::named_arrays const& state) override { state.take("gain", gain_); }

 private:
  E* exec_;
  gart::buffer<float, E> shown_;
  std::vector<float> image_, gain_{1.0f};
};

}  // namespace

TEST_CASE_TEMPLATE("a part of one's own is learned", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  gart::dataset data = capture(exec, seed);
  for (auto& v : data.train)
    for (auto& x : v.image.data) x = static_cast<gart::u8>(x / 2);
  using run_type = run_of<E, gart::deterministic_method>;
  auto const made = [&] {
    auto run = std::make_unique<run_type>(exec, still(200), data, cloud(seed, 0.6f));
    run->learn(std::make_unique<learned_gain<typename run_type::frame_type>>(exec));
    return run;
  };
  auto const run = made();
  for (int i = 0; i < 100; ++i) run->step();
  auto const other = made();
  other->set_state(run->state());
  for (int i = 0; i < 100; ++i) CHECK(run->step().loss == other->step().loss);
  CHECK(floats(run->state(), "gain")[0] == doctest::Approx(0.5).epsilon(0.05));
  gart::training_state const none = run_type(exec, still(9), data, cloud(seed, 0.6f)).state();
  CHECK_THROWS_WITH_AS(run->set_state(none), doctest::Contains("array gain has 0 numbers"), gart::invalid_argument);
}

TEST_CASE_TEMPLATE("hooks see a step between its parts", E, GART_TEST_POLICIES) {
  E exec;
  gart::dataset const data = capture(exec, 1);
  gart::train_options options;
  options.iterations = 20, options.densify = gart::densify_kind::none;
  run_of<E> run(exec, options, data, cloud(2, 0.6f));
  std::vector<int> calls;
  gart::training_hooks<E> hooks;
  hooks.rates = [&](gart::learning_rates& rates, int step) { rates.mean = 0, calls.push_back(step); };
  hooks.before_optimizer = [&](auto const&, gart::gaussians_view<float> const& by, int step) {
    exec.zero(by.opacity, by.count * sizeof(float)), calls.push_back(step);
  };
  hooks.after_step = [&](gart::step_report const& report) { calls.push_back(report.step); };
  run.set_hooks(hooks);
  gart::gaussian_model const before = run.model();
  for (int i = 0; i < 2; ++i) run.step();
  CHECK(calls == std::vector<int>{0, 0, 1, 1, 1, 2});
  gart::gaussian_model const after = run.model();
  CHECK(after.mean == before.mean);
  CHECK(after.opacity == before.opacity);
  CHECK(after.log_scale != before.log_scale);
}

TEST_CASE_TEMPLATE("Gaussians and moments change their number together", E, GART_TEST_POLICIES) {
  E exec;
  gart::dataset const data = capture(exec, 1);
  gart::train_options options;
  options.iterations = 20, options.densify = gart::densify_kind::none;
  run_of<E> run(exec, options, data, cloud(2, 0.6f));
  for (int i = 0; i < 3; ++i) run.step();
  for (gart::index_t const n : {1000u, 40u, 41u}) {
    run.resize(n);
    CHECK(run.size() == n);
    gart::training_state const state = run.state();
    CHECK(state.scene.size() == n);
    CHECK(state.second.size() == n);
    if (n != 40) CHECK(state.scene.log_scale.back() == 0);
    if (n != 40) CHECK(state.second.mean.back() == 0);
    exec.zero(run.edit().mean, 3 * sizeof(float));
    CHECK(run.scene().mean.front() == 0);
    CHECK(run.step().gaussians == n);
    CHECK(run.gradients().size() == n);
  }
}
