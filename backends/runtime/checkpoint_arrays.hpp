#pragma once
// What a checkpoint holds, array by array: of a training state to a file, and back.

#include <gart/train/state.hpp>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace gart::io::checkpoint {

constexpr char magic[] = "gart checkpoint 2\n", plain_magic[] = "gart checkpoint 1\n";
constexpr std::size_t magic_size = sizeof magic - 1;
constexpr u64 longest_name = 256;

// f(name, values, elements of a Gaussian; 0: of the run) for each array of a state.
template <class F>
void for_each_state_array(training_state const& state, F const& f) {
  auto const model = [&](std::string const& prefix, gaussian_model const& m) {
    for_each_array(
        [&](parameter_array const& a, auto const& values) { f(prefix + a.name, values, a.width(m.sh_degree)); }, m);
  };
  model("", state.scene), model("first/", state.first), model("second/", state.second);
  f("step", std::vector<int>{state.step}, 0);
  f("sh_degree", std::vector<int>{state.scene.sh_degree}, 0);
  f("growth", std::vector<float>{state.growth}, 0);
  f("seed", std::vector<u64>{state.seed}, 0);
  f("error_growth/error_sum", state.error_sum, 1);
  f("adc/gradient_sum", state.gradient_sum, 1), f("adc/touched", state.touched, 1);
  f("sh_trials", state.trials, 0);
  if (exposure_state const& e = state.exposures; !e.value.empty()) {
    f("exposure", e.value, 0), f("exposure/first", e.first, 0), f("exposure/second", e.second, 0);
    f("exposure/visits", e.visits, 0);
  }
  if (vignetting_state const& v = state.vignetting; !v.value.empty()) {
    f("vignetting", v.value, 0), f("vignetting/first", v.first, 0), f("vignetting/second", v.second, 0);
    f("vignetting/visits", v.visits, 0);
  }
  if (pose_state const& p = state.poses; !p.value.empty()) {
    f("pose", p.value, 0), f("pose/first", p.first, 0), f("pose/second", p.second, 0);
    f("pose/metric", p.metric, 0), f("pose/visits", p.visits, 0);
  }
  if (lens_state const& l = state.lenses; !l.value.empty()) {
    f("lens", l.value, 0), f("lens/first", l.first, 0), f("lens/second", l.second, 0);
    f("lens/visits", l.visits, 0);
  }
}

// Of a reader with the members get, has and fail (runtime/checkpoint.hpp).
template <class Reader>
training_state state_of(Reader const& in) {
  training_state s;
  std::vector<int> const degree = in.template get<int>("sh_degree"), step = in.template get<int>("step");
  std::vector<u64> const seed = in.template get<u64>("seed");
  std::vector<float> const growth = in.template get<float>("growth");
  if (degree.size() != 1 || step.size() != 1 || seed.size() != 1 || growth.size() != 1)
    in.fail("a counter is not one number");
  if (degree[0] < 0 || degree[0] > 3) in.fail("is damaged: it is of SH degree " + std::to_string(degree[0]));
  if (step[0] < 0 || step[0] == std::numeric_limits<int>::max())
    in.fail("is damaged: it was saved after step " + std::to_string(step[0]));
  if (!(growth[0] > 0 && std::isfinite(growth[0]))) in.fail("is damaged: its growth is no factor");
  auto const get = [&](std::string const& prefix) {
    gaussian_model m;
    m.sh_degree = degree[0];
    for_each_array([&](parameter_array const& a, auto& values) { values = in.template get<float>(prefix + a.name); },
                   m);
    if (!m.arrays_agree()) in.fail("its arrays " + prefix + "* differ in length");
    return m;
  };
  s.scene = get(""), s.first = get("first/"), s.second = get("second/");
  if (s.first.size() != s.scene.size() || s.second.size() != s.scene.size())
    in.fail("its moments differ in number from its Gaussians");
  s.step = step[0], s.growth = growth[0], s.seed = seed[0];
  if (in.has("error_growth/error_sum")) s.error_sum = in.template get<float>("error_growth/error_sum");
  s.gradient_sum = in.template get<float>("adc/gradient_sum"), s.touched = in.template get<u32>("adc/touched");
  if (s.gradient_sum.size() != s.touched.size()) in.fail("its arrays adc/* differ in length");
  if (in.has("exposure")) {
    exposure_state& e = s.exposures;
    e.value = in.template get<float>("exposure"), e.visits = in.template get<u32>("exposure/visits");
    e.first = in.template get<float>("exposure/first"), e.second = in.template get<float>("exposure/second");
    std::size_t const floats = exposure::floats * e.visits.size();
    if (e.value.size() != floats || e.first.size() != floats || e.second.size() != floats)
      in.fail("its arrays exposure* differ in length");
  }
  if (in.has("vignetting")) {
    vignetting_state& v = s.vignetting;
    v.value = in.template get<float>("vignetting"), v.visits = in.template get<u32>("vignetting/visits");
    v.first = in.template get<float>("vignetting/first"), v.second = in.template get<float>("vignetting/second");
    std::size_t const floats = vignetting::floats * v.visits.size();
    if (v.value.size() != floats || v.first.size() != floats || v.second.size() != floats)
      in.fail("its arrays vignetting* differ in length");
  }
  if (in.has("pose")) {
    pose_state& p = s.poses;
    p.value = in.template get<double>("pose"), p.visits = in.template get<u32>("pose/visits");
    p.metric = in.template get<double>("pose/metric");
    p.first = in.template get<double>("pose/first"), p.second = in.template get<double>("pose/second");
    std::size_t const numbers = std::tuple_size_v<pose_numbers> * p.visits.size();
    if (p.value.size() != numbers || p.first.size() != numbers || p.second.size() != numbers ||
        p.metric.size() != std::tuple_size_v<pose_numbers> * numbers)
      in.fail("its arrays pose* differ in length");
  }
  if (in.has("lens")) {
    lens_state& l = s.lenses;
    l.value = in.template get<double>("lens"), l.visits = in.template get<u32>("lens/visits");
    l.first = in.template get<double>("lens/first"), l.second = in.template get<double>("lens/second");
    std::size_t const numbers = std::tuple_size_v<lens_numbers> * l.visits.size();
    if (l.value.size() != numbers || l.first.size() != numbers || l.second.size() != numbers)
      in.fail("its arrays lens* differ in length");
  }
  if (in.has("sh_trials")) s.trials = in.template get<band_trial>("sh_trials");
  for (band_trial const& t : s.trials)
    if (t.band < 1 || t.band > 3) in.fail("is damaged: a trial of SH band " + std::to_string(t.band));
  return s;
}

}  // namespace gart::io::checkpoint
