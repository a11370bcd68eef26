// Training by each method: the same loss curve, also where a step has to do with less memory, and with sums in a
// fixed order the same bits twice.
#include "runs.hpp"

#include <concepts>
#include <string>
#include <vector>

using namespace gart_test;
using gart::u64;

namespace {

constexpr int steps = 150;

struct course {
  std::vector<float> loss;
  std::string backward;  // of the last step
  std::size_t hit_buffer_bytes;
  gart::gaussian_model model;
};

template <class Method, class E>
course train(E& exec, gart::dataset const& data, u64 seed, u64 hit_memory = 0) {
  gart::train_options options;
  options.hit_memory = hit_memory;
  options.iterations = steps;
  options.densify = gart::densify_kind::none;
  run_of<E, Method> run(exec, options, data, cloud(seed + 1, 0.7f));
  course out;
  for (int i = 0; i < steps; ++i) {
    auto const report = run.step();
    out.loss.push_back(report.loss), out.backward = report.backward;
  }
  out.hit_buffer_bytes = run.hit_buffer_bytes(), out.model = run.model();
  return out;
}

bool same_bits(gart::gaussian_model const& a, gart::gaussian_model const& b) {
  return a.mean == b.mean && a.log_scale == b.log_scale && a.quaternion == b.quaternion && a.opacity == b.opacity &&
         a.sh == b.sh;
}

}  // namespace

TEST_CASE_TEMPLATE("every method trains along the same loss curve", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  auto const data = capture(exec, seed);
  auto const reference = train<gart::primitive_method>(exec, data, seed);
  CHECK(reference.loss.back() < 0.8f * reference.loss.front());
  CHECK(reference.backward == "primitive");
  // Where the hit buffer has no room a step is done with less.
  auto const with_less = train<gart::primitive_method>(exec, data, seed, reference.hit_buffer_bytes / 2);
  CHECK(with_less.backward == "hybrid");
  CHECK(with_less.hit_buffer_bytes <= reference.hit_buffer_bytes / 2);
  auto const with_none = train<gart::primitive_method>(exec, data, seed, 1);
  CHECK(with_none.backward == "pixel");
  CHECK(with_none.hit_buffer_bytes == 0);
  std::vector<course> others{with_less, with_none};
  gart::gradient_methods::for_each([&]<class Method>(Method) {
    if constexpr (!std::same_as<Method, gart::primitive_method>) others.push_back(train<Method>(exec, data, seed));
  });
  for (auto const& other : others) {
    CAPTURE(other.backward);
    for (int i = 0; i < steps; ++i) {
      CAPTURE(i);
      CHECK(other.loss[i] == doctest::Approx(reference.loss[i]).epsilon(i < 20 ? 1e-3 : 2e-2));
    }
  }
}

TEST_CASE_TEMPLATE("sums in a fixed order give the same bits twice", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  auto const data = capture(exec, seed);
  auto const first = train<gart::deterministic_method>(exec, data, seed);
  auto const second = train<gart::deterministic_method>(exec, data, seed);
  CHECK(first.loss == second.loss);
  CHECK(same_bits(first.model, second.model));
}
