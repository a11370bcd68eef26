#pragma once
// Trainings of the small capture. The trainers that several tests take are compiled once, in runs.cpp (gart_test's
// BODIES train_runs): here they are not to be instantiated.

#include <train/capture.hpp>

#include <gart/trace/tile_tracer.hpp>
#include <gart/train/trainer.hpp>

namespace gart_test {

template <class E, class Method = gart::primitive_method>
using run_of = gart::trainer<E, gart::scene_traits<1>, gart::tile_tracer<E>, Method>;

// Numbers of either sign.
inline std::vector<float> values(std::mt19937_64& random, std::size_t n) {
  std::normal_distribution<float> normal;
  std::vector<float> out(n);
  for (float& x : out) x = normal(random);
  return out;
}

// Whether they are of the same numbers.
inline bool same(gart::gaussian_model const& a, gart::gaussian_model const& b) {
  bool equal = a.size() == b.size();
  gart::for_each_array([&](auto const&, auto const& x, auto const& y) { equal = equal && x == y; }, a, b);
  return equal;
}

// The Gaussians of the capture stand still: what is learned besides them is learned alone.
inline gart::train_options still(int iterations) {
  gart::train_options options;
  options.iterations = iterations;
  options.max_gaussians = 400;
  options.densify = gart::densify_kind::none;
  options.sh_every = 1;
  auto& r = options.rates;
  r.mean = r.mean_final = r.log_scale = r.quaternion = r.opacity = r.sh_dc = r.sh_rest = 0;
  return options;
}

}  // namespace gart_test

// Of a policy: `extern` in all files but one.
#define GART_TEST_TRAINER(E, Method) \
  template class gart::basic_trainer<E, gart::scene_traits<1>, gart::tile_tracer<E>, Method, gart::self_comm>
#define GART_TEST_TRAINERS_ELSEWHERE(E)                \
  extern GART_TEST_TRAINER(E, gart::primitive_method); \
  extern GART_TEST_TRAINER(E, gart::hybrid_method);    \
  extern GART_TEST_TRAINER(E, gart::pixel_method);     \
  extern GART_TEST_TRAINER(E, gart::deterministic_method);
GART_TEST_EACH_POLICY(GART_TEST_TRAINERS_ELSEWHERE)
