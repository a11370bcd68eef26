// The prefix sum over a count a Gaussian.
#include "support/frame.hpp"

#include <gart/algorithm/exclusive_scan.hpp>

namespace {

template <gart::execution E>
void scan(benchmark::State& state, E& exec) {
  std::size_t const n = gart_bench::the_scene().model.size();
  gart::buffer<gart::u32, E> const counts(exec, std::vector<gart::u32>(n, 3));
  gart::buffer<gart::u64, E> offsets(exec, n + 1);
  gart_bench::measure(state, exec, [&] {
    gart::exclusive_scan(exec, gart::span<gart::u32 const>(counts), offsets.view().subspan(0, n),
                         offsets.view().subspan(n, 1));
  });
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations() * n * 12));
}

}  // namespace

GART_BENCH("scan", scan)
