#pragma once
// The forward ray program for packets (trace/packet_walk.hpp): composite, a lane a pixel, with the same bits.

#include <gart/render/composite.hpp>
#include <gart/trace/packet_walk.hpp>

#if !defined(__CUDACC__)

namespace gart {

template <int ShDegree, class Record>
struct packet_composite {
  static constexpr int channels = 3;  // colour before the clamp
  using note = typename Record::cell;
  using scalar = composite<ShDegree, Record>;
  struct state {
    packet_block block;
    lane_mask inside;
    vec3_of<lanes> directions;
    sh_basis<ShDegree, lanes> basis;
    vec3_of<lanes> color;
    lanes transmittance, depth, last_t;
    lane_ints hits;
    u32 last_place[lane_count];
  };

  scalar program;

  static pixel pixel_of(packet_block const& b, int lane) {
    return {b.x + packet_block::column(lane), b.y + packet_block::row(lane)};
  }

  state begin(packet_block const& block) const {
    last_hit const none;
    state s{block, {}, {}, {}, {0.0f, 0.0f, 0.0f}, 1.0f, 0.0f, none.t, {}, {}};
    for (int l = 0; l < lane_count; ++l) {
      pixel const at = pixel_of(block, l);
      vec3 const d = pixel_ray(program.view, at).direction;
      s.inside[l] = program.order.inside(at) ? -1 : 0;
      for (int k = 0; k < 3; ++k) s.directions[k].v[l] = d[k];
    }
    s.basis = sh_basis<ShDegree, lanes>(s.directions);
    return s;
  }

  void shade(state const& s, u32 id, pixel_box const& tile, lanes (&out)[channels], note& cell) const {
    constexpr std::size_t stride = 3 * sh_basis<ShDegree>::size;
    vec3_of<lanes> const c = s.basis.unclamped(program.sh + stride * id, sh_coefficients(program.active_degree));
    out[0] = c.x, out[1] = c.y, out[2] = c.z;
    cell = program.record.cell_of(id, tile);
  }

  lane_mask on_hits(state& s, lane_mask now, packet_hits<packet_composite> const& h) const {
    vec3_of<lanes> const unclamped(h.shade[0], h.shade[1], h.shade[2]);
    vec3_of<lanes> color = s.color;
    lanes depth = s.depth, transmittance = s.transmittance;
    vec3_of<lanes> const c = clamped_color(unclamped), opaque = opaque_color(c, s.color, s.transmittance);
    lanes const weight = blend(h.alpha, h.t, c, color, depth, transmittance);
    for (int k = 0; k < 3; ++k) s.color[k] = select(now, color[k], s.color[k]);
    s.depth = select(now, depth, s.depth), s.transmittance = select(now, transmittance, s.transmittance);
    s.hits -= now;
    s.last_t = select(now, h.t, s.last_t);
    if constexpr (Record::any)
      for (u32 left = bits_of(now); left; left &= left - 1) {
        int const l = __builtin_ctz(left);
        s.last_place[l] = program.record.place_of(h.notes[h.row[l]], pixel_of(s.block, l));
        program.record(h.notes[h.row[l]], pixel_of(s.block, l), {opaque.x.v[l], opaque.y.v[l], opaque.z.v[l]},
                       weight.v[l], {unclamped.x.v[l], unclamped.y.v[l], unclamped.z.v[l]});
      }
    return (s.transmittance >= lanes(program.options.transmittance_min)) &
           (s.hits != every_lane(static_cast<int>(program.options.max_hits)));
  }

  void end(state const& s) const {
    for (int l = 0; l < lane_count; ++l) {
      if (!s.inside[l]) continue;
      typename scalar::state one;
      one.at = pixel_of(s.block, l);
      one.color = {s.color.x.v[l], s.color.y.v[l], s.color.z.v[l]};
      one.transmittance = s.transmittance.v[l], one.depth = s.depth.v[l], one.hits = static_cast<u32>(s.hits[l]);
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

}  // namespace gart

#endif
