// One optimizer step over every parameter.
#include "support/frame.hpp"

#include <gart/optim/adam.hpp>

namespace {

template <gart::execution E>
void adam(benchmark::State& state, E& exec) {
  gart::gaussian_model const& model = gart_bench::the_scene().model;
  gart::gaussians<E> parameters(exec, model);
  gart::gaussians<E> const gradients(exec, model);  // any finite numbers
  gart::optimizer_state<E> moments(exec, parameters.size(), gart_bench::sh_degree);
  gart::learning_rates const rates;
  int step = 0;
  gart_bench::measure(state, exec, [&] {
    gart::adam_step(exec, parameters, gradients, moments, rates, ++step, gart_bench::sh_degree);
  });
  constexpr std::int64_t floats = 11 + 3 * gart::sh_coefficients(gart_bench::sh_degree);
  state.SetBytesProcessed(state.iterations() * floats * 28 * static_cast<std::int64_t>(model.size()));
}

}  // namespace

GART_BENCH("adam", adam)
