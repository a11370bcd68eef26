// expects: p.on_hit(s, h)
#include <gart/trace/ray_program.hpp>

struct nearest : gart::ray_program_base {
  using ray_type = gart::ray;
  struct state {
    float t = 0;
  };
  bool active(gart::index_t) const { return true; }
  state begin(gart::index_t) const { return {}; }
  gart::ray ray_of(gart::index_t, state const&) const { return {}; }
#ifdef GART_WHOLE
  bool on_hit(state& s, gart::hit const& h) const {
#else
  bool onhit(state& s, gart::hit const& h) const {
#endif
      s.t = h.t;
  return false;
} void end(gart::index_t, state const&) const {
}
}
;
static_assert(gart::ray_program<nearest>);
