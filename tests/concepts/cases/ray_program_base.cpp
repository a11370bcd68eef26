// expects: P::has_packets
#include <gart/trace/ray_program.hpp>

#ifdef GART_WHOLE
struct nearest : gart::ray_program_base {
#else
struct nearest {
#endif
  using ray_type = gart::ray;
  struct state {};
  bool active(gart::index_t) const { return true; }
  state begin(gart::index_t) const { return {}; }
  gart::ray ray_of(gart::index_t, state const&) const { return {}; }
  bool on_hit(state&, gart::hit const&) const { return false; }
  void end(gart::index_t, state const&) const {}
};
static_assert(gart::ray_program<nearest>);
