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
  if (vec3d const& o = state.origin; o != vec3d(0.0)) f("origin", std::vector<double>{o.x, o.y, o.z}, 0);
  f("error_growth/error_sum", state.error_sum, 1);
  f("adc/gradient_sum", state.gradient_sum, 1), f("adc/touched", state.touched, 1);
  // Rows with Adam's moments, where any are learned.
  auto const learned = [&](std::string const& name, auto const& rows) {
    if (rows.value.empty()) return;
    f(name, rows.value, 0), f(name + "/first", rows.first, 0), f(name + "/second", rows.second, 0);
    if constexpr (requires { rows.metric; }) f(name + "/metric", rows.metric, 0);
    f(name + "/visits", rows.visits, 0);
  };
  learned("exposure", state.exposures), learned("vignetting", state.vignetting);
  learned("pose", state.poses), learned("lens", state.lenses);
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
  if (in.has("origin")) {
    std::vector<double> const origin = in.template get<double>("origin");
    if (origin.size() != 3) in.fail("its array origin is not three numbers");
    s.origin = {origin[0], origin[1], origin[2]};
  }
  if (in.has("error_growth/error_sum")) s.error_sum = in.template get<float>("error_growth/error_sum");
  s.gradient_sum = in.template get<float>("adc/gradient_sum"), s.touched = in.template get<u32>("adc/touched");
  if (s.gradient_sum.size() != s.touched.size()) in.fail("its arrays adc/* differ in length");
  auto const learned = [&]<class Rows>(std::string const& name, std::size_t width, Rows& rows) {
    if (!in.has(name)) return;
    using number = typename decltype(rows.value)::value_type;
    rows.value = in.template get<number>(name), rows.visits = in.template get<u32>(name + "/visits");
    rows.first = in.template get<number>(name + "/first"), rows.second = in.template get<number>(name + "/second");
    std::size_t const numbers = width * rows.visits.size();
    bool agree = rows.value.size() == numbers && rows.first.size() == numbers && rows.second.size() == numbers;
    if constexpr (requires { rows.metric; }) {
      rows.metric = in.template get<number>(name + "/metric");
      agree = agree && rows.metric.size() == width * numbers;
    }
    if (!agree) in.fail("its arrays " + name + "* differ in length");
  };
  learned("exposure", exposure::floats, s.exposures), learned("vignetting", vignetting::floats, s.vignetting);
  learned("pose", std::tuple_size_v<pose_numbers>, s.poses), learned("lens", std::tuple_size_v<lens_numbers>, s.lenses);
  return s;
}

}  // namespace gart::io::checkpoint
