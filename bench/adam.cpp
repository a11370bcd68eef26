// One optimizer step over every parameter.
#include "support/frame.hpp"

#include <gart/optim/adam.hpp>

#include <algorithm>

namespace {

// Sparse: with one Gaussian of four seen.
template <bool Sparse, gart::execution E>
void adam(benchmark::State& state, E& exec) {
  gart::gaussian_model const& model = gart_bench::the_scene().model;
  gart::gaussian_model any = model;  // finite numbers
  gart::adam_options options;
  options.sparse = Sparse;
  std::size_t const seen = Sparse ? model.size() / 4 : model.size();
  for (std::size_t i = 0; Sparse && i < model.size(); ++i)
    if (i % 4 != 0) std::fill_n(&any.mean[3 * i], 3, 0.0f);
  gart::gaussians<E> parameters(exec, model);
  gart::gaussians<E> const gradients(exec, any);
  gart::optimizer_state<E> moments(exec, parameters.size(), gart_bench::sh_degree);
  gart::learning_rates const rates;
  int step = 0;
  gart_bench::measure(state, exec, [&] {
    gart::adam_step(exec, parameters, gradients, moments, rates, ++step, gart_bench::sh_degree, {}, options);
  });
  constexpr std::int64_t floats = 11 + 3 * gart::sh_coefficients(gart_bench::sh_degree);
  state.SetBytesProcessed(state.iterations() * floats * 28 * static_cast<std::int64_t>(seen));
}

}  // namespace

GART_BENCH("adam", adam<false>)
GART_BENCH("adam/seen", adam<true>)
