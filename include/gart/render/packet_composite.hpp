#pragma once
// The forward ray program for packets (trace/packet_walk.hpp): composite, a lane a pixel, with the same bits.

#include <gart/render/composite.hpp>
#include <gart/trace/packet_walk.hpp>

#if !defined(__CUDACC__)

namespace gart::inline GART_ISA {

template <int ShDegree, class Record>
struct packet_composite {
  using note = typename Record::note;
  using shaded = vec3_of<lanes>;  // colour before the clamp
  using scalar = composite<ShDegree, Record>;
  struct state {
    packet_block block;
    lane_mask inside;
    vec3_of<lanes> directions;
    sh_basis<ShDegree, lanes> basis;
    vec3_of<lanes> color;
    lanes transmittance, depth, last_t;
    lane_words hits, last_place;
  };

  scalar program;

  static pixel pixel_of(packet_block const& b, int lane) {
    return {b.x + packet_block::column(lane), b.y + packet_block::row(lane)};
  }

  state begin(packet_block const& block) const {
    last_hit const none;
    state s{block, {}, {}, {}, {0.0f, 0.0f, 0.0f}, 1.0f, 0.0f, none.t, {}, {}};
    u32 inside = 0;
    for (int l = 0; l < lane_count; ++l) {
      inside |= (program.order.inside(pixel_of(block, l)) ? 1u : 0u) << l;
    }
    s.inside = lanes_of(inside);
    s.directions = pixel_directions(program.rays, block);
    s.basis = sh_basis<ShDegree, lanes>(s.directions);
    return s;
  }

  GART_INLINE note expect(state const& s, packet_cell const& cell) const {
    return program.record.expect(cell, s.block);
  }
  GART_INLINE void fetch(u32 id) const {
    constexpr std::size_t stride = 3 * sh_basis<ShDegree>::size;
    float const* const row = program.sh + stride * id;
    for (std::size_t k = 0; k < stride; k += 16) prefetch(row + k);
  }

  GART_INLINE shaded shade(state const& s, u32 id) const {
    constexpr std::size_t stride = 3 * sh_basis<ShDegree>::size;
    return s.basis.unclamped(program.sh + stride * id, sh_coefficients(program.active_degree));
  }

  GART_INLINE lane_mask on_hit(state& s, lane_mask now, lanes t, lanes alpha, shaded const& unclamped,
                               note const& at) const {
    vec3_of<lanes> const c = clamped_color(unclamped), opaque = opaque_color(c, s.color, s.transmittance);
    // A hit of no alpha leaves a ray as it is.
    lanes const weight = blend(select(now, alpha, 0.0f), select(now, t, 0.0f), c, s.color, s.depth, s.transmittance);
    lane_words const places = program.record(at, now, opaque, weight, unclamped);
    s.hits += select(now, every_lane(1), every_lane(0));
    s.last_t = select(now, t, s.last_t), s.last_place = select(now, places, s.last_place);
    lane_mask on = s.transmittance >= lanes(program.options.transmittance_min);
    if (program.options.max_hits > 0) on &= ~equal(s.hits, every_lane(program.options.max_hits));
    return on;
  }

  void end(state const& s) const {
    for (int l = 0; l < lane_count; ++l) {
      if (!s.inside[l]) continue;
      typename scalar::state one;
      one.at = pixel_of(s.block, l);
      one.color = {s.color.x.v[l], s.color.y.v[l], s.color.z.v[l]};
      one.transmittance = s.transmittance.v[l], one.depth = s.depth.v[l], one.hits = s.hits[l];
      one.last = {s.last_t.v[l], s.last_place[l]};
      program.end(0, one);
    }
  }
};

// The packets of a ray program, for tracers that have a use for them.
template <int ShDegree, class Record>
packet_composite<ShDegree, Record> packets_of(composite<ShDegree, Record> const& program) {
  return {program};
}

}  // namespace gart::inline GART_ISA

#endif
