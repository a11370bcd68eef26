#pragma once
/// \file
/// The forward ray program for packets (trace/packet_walk.hpp): composite, a lane a pixel, with the same bits.

#include <gart/render/composite.hpp>
#include <gart/trace/packet_walk.hpp>

#include <array>

#if !defined(__CUDACC__)

namespace gart { inline namespace GART_ISA {

/// The packet program of composite (trace/packet_program.hpp).
template <int ShDegree, hit_record Record>
struct packet_composite {
  /// A Gaussian's box in the tile, with the data for the record.
  using cell = typename Record::packet_cell;
  using shaded = std::array<lanes, 3>;  ///< colour before the clamp
  /// The rays of a packet on their way.
  struct state : composited_hits<lanes> {
    packet_block block;               ///< whose rays they are
    lane_mask inside;                 ///< lanes whose pixel is of the image
    vec3_of<lanes> directions;        ///< of the rays, unit length
    sh_basis<ShDegree, lanes> basis;  ///< of those directions
  };

  composite<ShDegree, Record> program;  ///< the ray program whose packets these are

  /// The pixel of a lane.
  static pixel pixel_of(packet_block const& b, int lane) {
    return {b.x + packet_block::column(lane), b.y + packet_block::row(lane)};
  }

  /// The state before the first hit.
  state begin(packet_block const& block) const {
    state s;
    s.block = block;
    u32 inside = 0;
    for (int l = 0; l < lane_count; ++l) {
      inside |= (program.order.inside(pixel_of(block, l)) ? 1u : 0u) << l;
    }
    s.inside = lanes_of(inside);
    s.directions = pixel_directions(program.rays, block);
    s.basis = sh_basis<ShDegree, lanes>(s.directions);
    return s;
  }

  /// The places where the record will write the hits of a cell's Gaussian.
  GART_INLINE lane_words expect(state const& s, cell const& from) const { return program.record.expect(from, s.block); }
  /// Asks for the row of coefficients of Gaussian `id`.
  GART_INLINE void fetch(u32 id) const {
    constexpr std::size_t stride = 3 * sh_basis<ShDegree>::size;
    float const* const row = program.sh + stride * id;
    for (std::size_t k = 0; k < stride; k += 16) prefetch(row + k);
  }

  /// The colours of Gaussian `id` along the rays.
  GART_INLINE shaded shade(state const& s, u32 id) const {
    constexpr std::size_t stride = 3 * sh_basis<ShDegree>::size;
    vec3_of<lanes> const c = s.basis.unclamped(program.sh + stride * id, sh_coefficients(program.active_degree));
    return {c.x, c.y, c.z};
  }

  /// Composites a hit of each ray of `now`. The rays that go on.
  GART_INLINE lane_mask on_hit(state& s, lane_mask now, lanes t, lanes alpha, shaded const& unclamped,
                               lane_words places) const {
    vec3_of<lanes> const color{unclamped[0], unclamped[1], unclamped[2]};
    lane_mask on = program.blend_hit(s, now, t, alpha, color, places);
    if (program.options.max_hits > 0) on &= ~equal(s.hits, every_lane(program.options.max_hits));
    return on;
  }

  /// Writes the pixels.
  void end(state const& s) const {
    for (int l = 0; l < lane_count; ++l) {
      if (!s.inside[l]) continue;
      program.write(pixel_of(s.block, l), {{s.color.x.v[l], s.color.y.v[l], s.color.z.v[l]},
                                           s.transmittance.v[l],
                                           s.depth.v[l],
                                           s.hits[l],
                                           s.last_t.v[l],
                                           s.last_place[l]});
    }
  }
};

static_assert(packet_program<packet_composite<3, record_none>>);

/// The packets of a ray program, for tracers that have a use for them.
template <int ShDegree, hit_record Record>
packet_composite<ShDegree, Record> packets_of(composite<ShDegree, Record> const& program) {
  return {program};
}

}}  // namespace gart::GART_ISA

#endif
