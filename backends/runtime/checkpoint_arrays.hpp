#pragma once
// What a checkpoint holds, array by array: of a training state to a file, and back.

#include <gart/train/state.hpp>

#include <cmath>
#include <limits>
#include <set>
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
  f("seed", std::vector<u64>{state.seed}, 0);
  for (auto const& [name, values] : state.parts.bytes) f(name, values, of_gaussians(name) ? sizeof(u32) : 0);
}

// Of a reader with the members get, names and fail (runtime/checkpoint.hpp).
template <class Reader>
training_state state_of(Reader const& in) {
  training_state s;
  std::vector<int> const degree = in.template get<int>("sh_degree"), step = in.template get<int>("step");
  std::vector<u64> const seed = in.template get<u64>("seed");
  if (degree.size() != 1 || step.size() != 1 || seed.size() != 1) in.fail("a counter is not one number");
  if (degree[0] < 0 || degree[0] > 3) in.fail("is damaged: it is of SH degree " + std::to_string(degree[0]));
  if (step[0] < 0 || step[0] == std::numeric_limits<int>::max())
    in.fail("is damaged: it was saved after step " + std::to_string(step[0]));
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
  s.step = step[0], s.seed = seed[0];
  std::set<std::string> own;
  for_each_state_array(s, [&](std::string const& name, auto const&, std::size_t) { own.insert(name); });
  for (std::string const& name : in.names()) {
    if (own.count(name)) continue;
    std::vector<char> const& values = s.parts.bytes[name] = in.template get<char>(name);
    if (of_gaussians(name) && !values.empty() && values.size() != sizeof(u32) * s.scene.size())
      in.fail("its array " + name + " is not of its " + std::to_string(s.scene.size()) + " Gaussians");
  }
  std::vector<float> const growth = s.parts.get<float>("growth");
  if (growth.size() > 1 || (growth.size() == 1 && !(growth[0] > 0 && std::isfinite(growth[0]))))
    in.fail("is damaged: its growth is no factor");
  return s;
}

}  // namespace gart::io::checkpoint
