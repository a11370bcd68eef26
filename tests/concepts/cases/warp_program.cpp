// A program that says it is one for warps, and misspells what the warps read.
// expects: P::row_floats
#include <gart/exec/parallel.hpp>
#include <gart/trace/tile_tracer.hpp>

struct flat : gart::ray_program_base {
  static constexpr bool has_warps = true, uses_slots = false;
#ifdef GART_WHOLE
  static constexpr int row_floats = 3;
#else
  static constexpr int row_float = 3;
#endif
  using ray_type = gart::primary_ray;
  using cell = gart::no_cell;
  struct state {};
  gart::pixel_order order;
  float const* colors = nullptr;
  bool active(gart::index_t) const { return true; }
  gart::pixel at(gart::index_t i) const { return order.at(i); }
  state begin(gart::index_t) const { return {}; }
  gart::primary_ray ray_of(gart::index_t, state const&) const { return {}; }
  bool on_hit(state&, gart::hit const&) const { return true; }
  void end(gart::index_t, state const&) const {}
  float const* rows_from() const { return colors; }
  int row_floats_read() const { return 3; }
  gart::vec3 shade(state const&, float const* row) const { return {row[0], row[1], row[2]}; }
  bool add(state&, float, float, gart::vec3 const&, gart::u32) const { return true; }
};

void trace(gart::serial_exec& exec, gart::tile_tracer<gart::serial_exec>& tracer) {
  tracer.trace(exec, "flat", 32, flat{});
}
