// Boxes, near depths and areas of all Gaussians in a view, and the two prefix sums that place them.
#include "support/frame.hpp"

#include <gart/tiles/footprints.hpp>

namespace {

template <int TileSize, gart::execution E>
void footprint(benchmark::State& state, E& exec) {
  gart_bench::frame<E> frame(exec);
  gart::footprints<E, TileSize> prints(exec);
  gart_bench::measure(state, exec, [&] {
    prints.measure(exec, frame.scene(), frame.view, frame.options.alpha_min, frame.options.near);
  });
  state.counters["hit_slots"] = static_cast<double>(prints.slots());
  state.counters["pairs"] = static_cast<double>(prints.pairs());
}

}  // namespace

GART_BENCH("footprint", footprint<8>)
