// The length that schedules go by, set while a run is under way: every schedule follows, as if it had been known.
#include "runs.hpp"

using namespace gart_test;

namespace {

gart::train_options options_of(gart::densify_kind densify, int iterations) {
  gart::train_options options;
  options.iterations = iterations, options.densify = densify;
  options.max_gaussians = 220, options.exposure = options.vignetting = true;
  options.mcmc.from = 20, options.mcmc.every = 10;
  options.adc.from = 20, options.adc.every = 10, options.adc.opacity_reset_every = 60, options.adc.gradient = 1e-6f;
  return options;
}

bool same_bits(gart::gaussian_model const& a, gart::gaussian_model const& b) {
  return a.mean == b.mean && a.log_scale == b.log_scale && a.quaternion == b.quaternion && a.opacity == b.opacity &&
         a.sh == b.sh;
}

}  // namespace

TEST_CASE("a length that is set is as good as one that was known") {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  auto densify = gart::densify_kind::mcmc;
  SUBCASE("mcmc") {}
  SUBCASE("adc") { densify = gart::densify_kind::adc; }
  gart::serial_exec exec;
  auto const data = capture(exec, seed);
  auto const start = cloud(seed + 1, 0.7f);
  constexpr int length = 150;
  run_of<gart::serial_exec> known(exec, options_of(densify, length), data, start),
      told(exec, options_of(densify, 9000), data, start), untold(exec, options_of(densify, 9000), data, start);
  told.set_iterations(length);
  for (int i = 0; i < length; ++i) known.step(), told.step(), untold.step();
  CHECK(known.model().size() != start.size());
  CHECK(same_bits(known.model(), told.model()));
  CHECK(same_bits(known.state().second, told.state().second));
  CHECK(floats(known.state(), "exposure") == floats(told.state(), "exposure"));
  CHECK(floats(known.state(), "vignetting") == floats(told.state(), "vignetting"));
  CHECK_FALSE(same_bits(known.model(), untold.model()));

  // Under way, it goes on from where it stands: the rate of the means ends where that of the run ends.
  run_of<gart::serial_exec> late(exec, options_of(densify, 9000), data, start);
  for (int i = 0; i < 100; ++i) late.step();
  late.set_iterations(100);
  auto const before = late.model();
  late.step();
  auto const after = late.model();
  auto const rates = gart::rates_at(gart::learning_rates{}, data.extent, 100, 100);
  CHECK(rates.mean < 0.02f * gart::rates_at(gart::learning_rates{}, data.extent, 0, 100).mean);
  if (densify == gart::densify_kind::adc) {
    REQUIRE(after.size() == before.size());
    // A step of Adam is some rates long at most; no noise is added by adaptive density.
    float farthest = 0;
    for (std::size_t k = 0; k < before.mean.size(); ++k)
      farthest = std::max(farthest, std::abs(after.mean[k] - before.mean[k]));
    CHECK(farthest < 10 * rates.mean);
  }
}
