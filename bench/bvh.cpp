// The tree over the ellipsoids' boxes: built, and refitted to the same boxes.
#include "support/frame.hpp"

#include <gart/bvh/bvh.hpp>

namespace {

template <gart::execution E>
gart::buffer<gart::box, E> boxes_of_scene(E& exec) {
  gart_bench::frame<E> frame(exec);
  gart::buffer<gart::box, E> boxes(exec, frame.gaussians.size());
  gart::parallel_for(
      exec, "boxes", frame.gaussians.size(),
      gart::trace_kernels::bound_ellipsoids<>{frame.scene(), frame.view.position, frame.options.alpha_min, boxes});
  exec.synchronize();
  return boxes;
}

template <gart::execution E>
void build(benchmark::State& state, E& exec) {
  auto const boxes = boxes_of_scene(exec);
  gart::bvh<E> tree(exec);
  gart_bench::measure(state, exec, [&] { tree.build(exec, boxes); });
}

template <gart::execution E>
void refit(benchmark::State& state, E& exec) {
  auto const boxes = boxes_of_scene(exec);
  gart::bvh<E> tree(exec);
  tree.build(exec, boxes);
  gart_bench::measure(state, exec, [&] { tree.refit(exec, boxes); });
}

}  // namespace

GART_BENCH("bvh/build", build)
GART_BENCH("bvh/refit", refit)
