// A program whose rays have no pixels, traced by tiles.
// expects: p.at(i)
#include <gart/exec/parallel.hpp>
#include <gart/trace/tile_tracer.hpp>

struct count : gart::ray_program_base {
  using ray_type = gart::primary_ray;
  struct state {};
  gart::pixel_order order;
  bool active(gart::index_t) const { return true; }
#ifdef GART_WHOLE
  gart::pixel at(gart::index_t i) const { return order.at(i); }
#endif
  state begin(gart::index_t) const { return {}; }
  gart::primary_ray ray_of(gart::index_t, state const&) const { return {}; }
  bool on_hit(state&, gart::hit const&) const { return true; }
  void end(gart::index_t, state const&) const {}
};

void trace(gart::serial_exec& exec, gart::tile_tracer<gart::serial_exec>& tracer) {
  tracer.trace(exec, "count", 32, count{});
}
