// Traversal alone, by tracer: every ray to its end, hits counted, nothing shaded.
#include "support/frame.hpp"

namespace {

struct count_hits : gart::ray_program_base {
  using ray_type = gart::primary_ray;
  struct state {
    gart::vec3 direction;
    gart::u32 hits = 0;
    float transmittance = 1;
  };
  gart::camera view;
  gart::pixel_order order;
  float transmittance_min;
  gart::u32* hits;

  GART_HD bool active(gart::index_t i) const { return order.inside(order.at(i)); }
  GART_HD gart::pixel at(gart::index_t i) const { return order.at(i); }
  GART_HD state begin(gart::index_t i) const {
    state s;
    s.direction = gart::pixel_ray(view, order.at(i)).direction;
    return s;
  }
  GART_HD gart::primary_ray ray_of(gart::index_t, state const& s) const { return {s.direction}; }
  GART_HD bool on_hit(state& s, gart::hit const& h) const {
    ++s.hits;
    s.transmittance *= 1.0f - h.alpha;
    return s.transmittance >= transmittance_min;
  }
  GART_HD void end(gart::index_t i, state const& s) const { hits[order.address(order.at(i))] = s.hits; }
};

template <class By, gart::execution E>
void trace(benchmark::State& state, E& exec) {
  gart_bench::frame<E, By> frame(exec);
  frame.prepare();
  gart::buffer<gart::u32, E> hits(exec, frame.pixels());
  gart::pixel_order const order{frame.view.width, frame.view.height};
  count_hits const program{{}, frame.view, order, frame.options.transmittance_min, hits.data()};
  gart_bench::measure(state, exec, [&] { frame.traced.trace("trace", order.launch_size(), program); });
  double sum = 0;
  for (gart::u32 const n : hits.to_host()) sum += n;
  state.counters["hits_per_ray"] = sum / static_cast<double>(frame.pixels());
  state.counters["hits"] = benchmark::Counter(sum, benchmark::Counter::kIsIterationInvariantRate);
}

}  // namespace

GART_BENCH("trace/bvh", trace<gart_bench::by_bvh>)
GART_BENCH("trace/tiles/4", trace<gart_bench::by_tiles<4>>)
GART_BENCH("trace/tiles/8", trace<gart_bench::by_tiles<8>>)
GART_BENCH("trace/tiles/16", trace<gart_bench::by_tiles<16>>)
