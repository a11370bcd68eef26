// A check of every step: a sound training passes it, and a number that is not finite is found wherever it is.
#include "runs.hpp"

#include <limits>
#include <string>
#include <utility>
#include <vector>

using namespace gart_test;

namespace {

gart::train_options options_with(gart::densify_kind densify) {
  gart::train_options options;
  options.iterations = 60;
  options.max_gaussians = 400;
  options.densify = densify;
  options.mcmc.from = options.adc.from = 10, options.mcmc.every = options.adc.every = 10;
  options.check_finite = true;
  return options;
}

struct group {
  std::string name;
  std::vector<float> gart::gaussian_model::*values;
  std::size_t stride;
};

std::vector<group> const groups{{"mean", &gart::gaussian_model::mean, 3},
                                {"log-scale", &gart::gaussian_model::log_scale, 3},
                                {"quaternion", &gart::gaussian_model::quaternion, 4},
                                {"opacity", &gart::gaussian_model::opacity, 1},
                                {"SH", &gart::gaussian_model::sh, 12}};

bool has(std::string const& text, std::string const& part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE_TEMPLATE("a sound training passes the check; none unless asked", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  auto const data = capture(exec, seed);
  for (auto const densify : {gart::densify_kind::none, gart::densify_kind::mcmc, gart::densify_kind::adc}) {
    auto options = options_with(densify);
    run_of<E> checked(exec, options, data, cloud(seed + 1, 0.7f));
    options.check_finite = false;
    run_of<E> plain(exec, options, data, cloud(seed + 1, 0.7f));
    exec.profile.enable(true);
    for (int i = 0; i < options.iterations; ++i) CHECK(checked.step().skipped == 0);
    exec.synchronize();
    CHECK(exec.profile.stages().count("finite/parameters") == 1);
    CHECK(exec.profile.stages().at("finite/moments").launches == options.iterations);
    exec.profile.clear();
    for (int i = 0; i < 3; ++i) plain.step();
    exec.synchronize();
    CHECK(exec.profile.stages().count("finite/parameters") == 0);
    CHECK(exec.profile.stages().count("finite/moments") == 0);
    exec.profile.enable(false);
    exec.profile.clear();
  }
}

TEST_CASE_TEMPLATE("one non-finite number is found in every parameter group", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  E exec;
  auto const data = capture(exec, seed);
  run_of<E> run(exec, options_with(gart::densify_kind::none), data, cloud(seed + 1, 0.7f));
  for (int i = 0; i < 3; ++i) run.step();
  auto const sound = run.state();
  std::pair<std::string, gart::gaussian_model gart::training_state::*> const sets[] = {
      {"", &gart::training_state::scene},
      {"Adam's first moment of ", &gart::training_state::first},
      {"Adam's second moment of ", &gart::training_state::second}};
  for (auto const& [prefix, set] : sets) {
    for (auto const& g : groups) {
      for (float const bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        auto state = sound;
        auto& values = state.*set.*g.values;
        std::size_t const at = random() % values.size(), gaussian = at / g.stride;
        values[at] = bad;
        run.set_state(state);
        CAPTURE(at);
        try {
          run.step();
          FAIL("not found: " << prefix << g.name);
        } catch (gart::not_finite const& e) {
          CHECK(e.group == prefix + g.name);
          CHECK(e.gaussian == gaussian);
          std::string const text = e.what();
          CHECK_MESSAGE(has(text, "step 4, view "), text);
          CHECK_MESSAGE(has(text, ": 1 number of " + prefix + g.name + " is not finite, that of Gaussian " +
                                      std::to_string(gaussian) + ", element " + std::to_string(at % g.stride)),
                        text);
          CHECK_MESSAGE(has(text, "train_options.densify = none"), text);
        }
      }
    }
  }
  // Of several the first is named, the last Gaussian is not out of reach, and a state that is mended passes.
  auto state = sound;
  state.scene.opacity[149] = state.scene.opacity[40] = NAN, state.scene.sh[149 * 12 + 11] = NAN;
  run.set_state(state);
  CHECK_THROWS_WITH_AS(run.step(),
                       doctest::Contains("2 numbers of opacity are not finite, the first that of Gaussian 40"),
                       gart::not_finite);
  state = sound;
  state.scene.sh[149 * 12 + 11] = NAN;
  run.set_state(state);
  CHECK_THROWS_WITH_AS(run.step(), doctest::Contains("Gaussian 149, element 11 of 12"), gart::not_finite);
  run.set_state(sound);
  CHECK(run.step().step == 4);
}

TEST_CASE_TEMPLATE("updates that Adam leaves out are counted, step by step", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  auto const data = capture(exec, seed);
  run_of<E> run(exec, options_with(gart::densify_kind::none), data, cloud(seed + 1, 0.7f));
  // A loss whose gradient is not finite in one colour of every pixel spoils that colour's SH of all that is hit.
  auto const report = run.step([](gart::loss_input<E> const& in) {
    std::vector<float> gradient(in.gradient.size(), 0.0f);
    for (std::size_t i = 0; i < gradient.size(); i += 3) gradient[i] = NAN;
    in.exec.copy_in(in.gradient.data(), gradient.data(), gradient.size() * sizeof(float));
    std::vector<float> const value{1, 1};
    in.exec.copy_in(in.value.data(), value.data(), value.size() * sizeof(float));
  });
  CHECK(report.skipped > 0);
  CHECK(run.step().skipped == 0);
}
