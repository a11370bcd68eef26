// expects: p.expect(s, cell)
#include <gart/trace/packet_program.hpp>

#include <array>

using gart::lane_mask, gart::lanes, gart::packet_block, gart::u32;

struct depths {
  using cell = gart::packet_cell;
  using shaded = std::array<lanes, 0>;
  struct state {
    gart::vec3_of<lanes> directions;
    lane_mask inside;
    lanes depth;
  };
  state begin(packet_block const&) const {
    state s;
    s.inside = gart::lanes_of(1);
    return s;
  }
#ifdef GART_WHOLE
  gart::lane_words expect(state const&, cell const&) const { return gart::every_lane(0); }
#endif
  void fetch(u32) const {}
  shaded shade(state const&, u32) const { return {}; }
  lane_mask on_hit(state& s, lane_mask rays, lanes t, lanes, shaded const&, gart::lane_words) const {
    s.depth = t;
    return rays;
  }
  void end(state const&) const {}
};
static_assert(gart::packet_program<depths>);
