#pragma once
/// \file
/// The hits of a view's pixels as a table, a ray a pixel, row-major. It takes any tracer and camera, and the pixels'
/// filter. Rows that are not traced have none. Views with one centre are walked in packets on hosts, as images are.

#include <gart/channels/hit_table.hpp>
#include <gart/render/options.hpp>
#include <gart/render/pixels.hpp>
#include <gart/trace/packet_walk.hpp>

#include <array>

namespace gart { inline namespace GART_ISA {

/// The ray program: one kernel for each policy, tracer, response and kind of rays.
template <rays_of_pixels Rays>
struct list_pixels : ray_program_base {
  static constexpr bool has_packets = Rays::central;  ///< it is walked in packets on a host
  using ray_type = typename Rays::ray_type;           ///< from the camera's centre, or from anywhere
  using state = hit_writer::state;                    ///< a ray on its way
  Rays rays;                                          ///< of the view
  pixel_order order;                                  ///< of the view
  hit_writer to;                                      ///< where hits go

  /// Whether ray i is of a pixel of the image.
  GART_HD bool active(index_t i) const { return order.inside(order.at(i)); }
  /// The pixel of ray i.
  GART_HD pixel at(index_t i) const { return order.at(i); }
  /// The state before the first hit.
  GART_HD state begin(index_t i) const { return begin(order.at(i)); }
  /// The same of a pixel.
  GART_HD state begin(pixel p) const {
    auto const own = pixel_ray(rays, p);
    return to.begin(static_cast<u32>(order.address(p)), {origin_of(own), own.direction});
  }
  /// Ray i, in the view's frame.
  GART_HD ray_type ray_of(index_t, state const& s) const {
    if constexpr (Rays::central)
      return {s.own.direction};
    else
      return s.own;
  }
  /// Takes a hit. False: the ray ends.
  GART_HD GART_INLINE bool on_hit(state& s, hit const& h) const { return to.on_hit(s, h); }
  /// Takes the ray.
  GART_HD void end(index_t, state const& s) const { to.end(s); }
};
static_assert(pixel_program<list_pixels<pixel_rays>>);

#if !defined(__CUDACC__)

/// The packet program of list_pixels (trace/packet_program.hpp).
struct packet_list {
  using cell = packet_cell;             ///< with nothing to add
  using shaded = std::array<lanes, 0>;  ///< nothing
  /// The rays of a packet on their way.
  struct state {
    lane_mask inside;                    ///< lanes whose pixel is of the image
    vec3_of<lanes> directions;           ///< of the rays, unit length
    hit_writer::state rays[lane_count];  ///< of lanes inside
  };

  list_pixels<pixel_rays> program;  ///< the ray program whose packets these are

  /// The state before the first hit.
  state begin(packet_block const& block) const {
    state s;
    u32 inside = 0;
    for (int l = 0; l < lane_count; ++l) {
      pixel const p{block.x + packet_block::column(l), block.y + packet_block::row(l)};
      if (!program.order.inside(p)) continue;
      inside |= 1u << l;
      s.rays[l] = program.begin(p);
    }
    s.inside = lanes_of(inside);
    s.directions = pixel_directions(program.rays, block);
    return s;
  }
  /// Which Gaussian it is.
  GART_INLINE lane_words expect(state const&, cell const& from) const { return every_lane(from.id); }
  /// Does nothing.
  GART_INLINE void fetch(u32) const {}
  /// Nothing.
  GART_INLINE shaded shade(state const&, u32) const { return {}; }
  /// Takes a hit of each ray of `now`. The rays that go on.
  GART_INLINE lane_mask on_hit(state& s, lane_mask now, lanes t, lanes alpha, shaded const&, lane_words ids) const {
    u32 on = 0;
    for (u32 left = bits_of(now & s.inside); left; left &= left - 1) {
      int const l = __builtin_ctz(left);
      on |= (program.to.on_hit(s.rays[l], {t.v[l], ids[l], alpha.v[l]}) ? 1u : 0u) << l;
    }
    return lanes_of(on);
  }
  /// Takes the rays.
  void end(state const& s) const {
    for (u32 left = bits_of(s.inside); left; left &= left - 1) program.to.end(s.rays[__builtin_ctz(left)]);
  }
};
static_assert(packet_program<packet_list>);

/// The packets of the ray program, for tracers that have a use for them.
inline packet_list packets_of(list_pixels<pixel_rays> const& program) { return {program}; }

#endif

/// Of a frame that is prepared. `counts`, [H][W], has the hits of each pixel where they are known, zero in rows that
/// are not traced.
template <class Frame, execution E>
void list_hits(Frame& frame, hit_table<E>& out, bool differentiable, span<u32 const> counts = {}) {
  auto const& view = frame.view();
  render_options const& options = frame.options();
  pixel_order const order{view.width, view.height, options.rows};
  frame.with_rays([&]<class Rays>(Rays const& rays) {
    out.list(
        frame.exec(), static_cast<index_t>(view.width) * static_cast<index_t>(view.height), options.transmittance_min,
        options.max_hits, differentiable,
        [&](char const* label, hit_writer const& to) {
          frame.trace(label, order.launch_size(), list_pixels<Rays>{{}, rays, order, to});
        },
        counts);
  });
}

}}  // namespace gart::GART_ISA
