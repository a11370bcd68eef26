#pragma once
/// \file
/// The gather on a host does what gather_kernel does (backward/gather.hpp). It takes the pixels of a tile in packets, a
/// lane a pixel (math/lanes.hpp). For a Gaussian's SH sums a lane is a band. Sums are of the same terms in another
/// order.

#include <gart/backward/gather.hpp>
#include <gart/backward/packet_slots.hpp>

#include <new>

namespace gart { inline namespace GART_ISA {

#if defined(__CUDACC__)

/// nvcc's host compiler has no lanes: a host policy there takes the plain form.
template <gather_configuration C>
struct packet_gather : gather_kernel<C> {};

#else

/// The tile kernel by packets.
template <gather_configuration C>
struct packet_gather {
  using gather_type = gather_kernel<C>;                        ///< the plain form, whose members it has
  using response_type = typename C::response;                  ///< of the Gaussians
  using entry_type = typename C::entry;                        ///< of the hit buffer
  static constexpr int block_size = 1;                         ///< a host's team has one lane
  static constexpr bool recomputed = gather_type::recomputed;  ///< whether hits are decided again
  static constexpr int bands = gather_type::bands,             ///< SH functions
      sh_stride = gather_type::sh_stride;                      ///< floats of a Gaussian's coefficients
  static constexpr int Size = C::tile_size,                    ///< side of a tile, in pixels
      packets = Size * Size / lane_count;                      ///< packets of a tile
  /// Lanes' groups that hold the SH functions.
  static constexpr int band_groups = (bands + lane_count - 1) / lane_count;

  /// The needed values of a packet's pixels.
  struct packet_data {
    int x, y;                                       ///< in the tile
    vec3_of<lanes> direction,                       ///< of the rays, unit length
        gradient;                                   ///< of the image
    lanes total,                                    ///< colour . gradient
        error,                                      ///< of the pixel
        last_t;                                     ///< t of the ray's last hit
    lanes depth_gradient[C::terms::depth ? 1 : 0];  ///< of the image, where there is one
    lane_words last_place;                          ///< of the ray's last hit
    lanes bands_of[lane_count][band_groups];        ///< the SH basis, a pixel after another
  };
  /// What a team shares.
  struct scratch {
    packet_data data[packets];  ///< of the tile
  };

  static_assert(Size <= packet_cell::largest_tile);

  gather_type gather;  ///< with the arrays

  /// Gathers the tile of a team.
  void operator()(auto const& team) const {
    u32 const tile = team.tile();
    u32 const first = gather.map.offsets[tile], last = gather.map.offsets[tile + 1];
    if (first == last) return;
    pixel_box const area = gather.grid.tile(tile);
    scratch& s = team.scratch();
    int p = 0;
    for (int y = area.y0; y < area.y0 + Size; y += packet_block::height)
      for (int x = area.x0; x < area.x0 + Size; x += packet_block::width) load(s.data[p++], area, {x, y});
    u32 const* const list = gather.map.primitives.data();
    for (u32 k = first; k < last && k < first + prefetch_distance; ++k) prefetch_slots(area, list[k]);
    for (u32 k = first; k < last; ++k) {
      if (k + 2 * prefetch_distance < last) prefetch(&gather.ranges[list[k + 2 * prefetch_distance]]);
      if (k + prefetch_distance < last) prefetch_slots(area, list[k + prefetch_distance]);
      sum(s, area, list[k]);
    }
  }

 private:
  // Pixels beyond the image are given the gradient zero and no hit.
  void load(packet_data& out, pixel_box const& area, packet_block const& block) const {
    out.x = block.x % Size, out.y = block.y % Size, out.direction = pixel_directions(gather.rays, block);
    for (int l = 0; l < lane_count; ++l) {
      pixel const at{block.x + packet_block::column(l), block.y + packet_block::row(l)};
      bool const inside = at.x < area.x1 && at.y < area.y1;
      std::size_t const a = static_cast<std::size_t>(at.y) * gather.rays.view.width + at.x;
      float total = 0;
      for (int k = 0; k < 3; ++k) {
        float const g = inside ? gather.color_gradient[3 * a + k] : 0.0f;
        total += inside ? gather.color[3 * a + k] * g : 0.0f;
        out.gradient[k].v[l] = g;
      }
      out.total.v[l] = total, out.error.v[l] = inside && gather.error ? gather.error[a] : 0.0f;
      if constexpr (C::terms::depth) {
        out.depth_gradient[0].v[l] = inside ? gather.depth.gradient(a) : 0.0f;
        out.total.v[l] += inside ? gather.depth.total(a) : 0.0f;
      }
      last_hit const end = recomputed && inside ? gather.last[a] : last_hit{};
      out.last_t.v[l] = end.t, out.last_place[l] = end.place;
    }
    sh_basis<C::sh_degree, lanes> const basis(out.direction);
    for (int l = 0; l < lane_count; ++l)
      for (int k = 0; k < band_groups * lane_count; ++k)
        out.bands_of[l][k / lane_count].v[k % lane_count] = k < bands ? basis.y[k].v[l] : 0.0f;
  }

  static constexpr u32 prefetch_distance = 4;  // Gaussians whose slots are fetched while one is summed up

  // Prefetches what will be read and added to for a Gaussian: its slots lie anywhere in the buffer. Inlined: to a
  // compiler a call that does nothing but prefetch does nothing.
  GART_INLINE void prefetch_slots(pixel_box const& area, u32 id) const {
    footprint_slots const range = gather.ranges[id];
    pixel_box const cell = cell_in(range, area);
    char const* const slots = reinterpret_cast<char const*>(gather.slots + range.offset + tile_offset(range, cell));
    for (std::size_t byte = 0; byte < cell.area() * sizeof(entry_type); byte += 64) prefetch_to_l2(slots + byte);
    prefetch(&gather.records[id]);
    if constexpr (C::sums == gather_sums::atomic) {
      if constexpr (C::terms::color)
        for (int k = 0; k < sh_stride; k += 16)
          prefetch_to_write(gather.sh_gradient + static_cast<std::size_t>(sh_stride) * id + k);
      if constexpr (C::terms::geometry)
        prefetch_to_write(gather.moments_out + static_cast<std::size_t>(moment_stride) * id);
    }
  }

  void sum(scratch const& s, pixel_box const& area, u32 id) const {
    footprint_slots const range = gather.ranges[id];
    slot_cell const cell(id, range, area);
    ray_gaussian const& g = gather.records[id];
    lanes sh_sum[2][3][band_groups];  // of even and of odd lanes: two chains of additions hide each other's latency
    lanes moment_sum[moment_count];
    for (auto& half : sh_sum)
      for (auto& channel : half)
        for (lanes& group : channel) group = 0.0f;
#pragma GCC unroll 16
    for (int k = 0; k < moment_count; ++k) moment_sum[k] = 0.0f;

    // All packets are evaluated before the first is summed up. Each is a chain of steps, whose latency the others hide.
    struct {
      ray_peak_of<lanes> r;
      lane_mask hit;
      packet_slots slots;
      packet_data const* at;
    } found[packets];
    int count = 0;
    for (packet_data const& at : s.data) {
      auto& f = found[count];
      if (!cell.bits_inside(at.x, at.y)) continue;
      f.at = &at, f.slots = packet_slots(cell, at.x, at.y);
      ::new (static_cast<void*>(&f.r)) ray_peak_of<lanes>(evaluate(g, primary_ray_of<lanes>{at.direction}));
      f.hit = f.slots.inside;
      if constexpr (recomputed)
        f.hit &= is_hit(g, f.r, gather.near) &
                 ((f.r.t < at.last_t) | ((f.r.t == at.last_t) & at_most(f.slots.places(), at.last_place)));
      else
        f.hit &= f.slots.written(gather.slots);
      count += any(f.hit) ? 1 : 0;
    }
    for (int i = 0; i < count; ++i) {
      packet_data const& at = *found[i].at;
      lane_mask const hit = found[i].hit;
      ray_peak_of<lanes> const& r = found[i].r;
      packet_entries const e = found[i].slots.template read<C::terms::geometry>(gather.slots, hit);
      // Geometry first: colour's work hides the latency of its chain of steps.
      if constexpr (C::terms::geometry) {
        lanes const alpha = estimated_hit_alpha<response_type>(g, r.d2);
        lanes opaque_g = dot(e.opaque, at.gradient);
        if constexpr (C::terms::depth)
          opaque_g += found[i].slots.read_depths(gather.depth.slots, hit) * at.depth_gradient[0];
        lanes const by_alpha = alpha_gradient(opaque_g, at.total, alpha);
        moments_of<lanes> m;
        if constexpr (C::terms::depth)
          m = hit_moments_with_depth<response_type>(g, r, by_alpha, e.weight * at.depth_gradient[0], hit);
        else
          m = hit_moments<response_type>(g, r, by_alpha, hit);
#pragma GCC unroll 16
        for (int k = 0; k < error_place; ++k) moment_sum[k] += m.v[k];
        moment_sum[error_place] += select(hit, e.weight * at.error, 0.0f);
      }
      if constexpr (C::terms::color) {
        alignas(lanes) float cg[3][lane_count];
        for (int c = 0; c < 3; ++c)
          reinterpret_cast<lanes&>(cg[c]) = select(e.clamped[c], 0.0f, e.weight * at.gradient[c]);
#pragma GCC unroll 2
        for (int l = 0; l < lane_count; l += 2)
          for (int odd = 0; odd < 2; ++odd)
            for (int b = 0; b < band_groups; ++b)
              for (int c = 0; c < 3; ++c)
                sh_sum[odd][c][b] = fma(at.bands_of[l + odd][b], lanes(cg[c][l + odd]), sh_sum[odd][c][b]);
      }
    }

    float sh[sh_stride], moment_totals[16];
    for (int b = 0; b < band_groups; ++b)
      write_interleaved(sh + 3 * lane_count * b, sh_stride - 3 * lane_count * b, sh_sum[0][0][b] + sh_sum[1][0][b],
                        sh_sum[0][1][b] + sh_sum[1][1][b], sh_sum[0][2][b] + sh_sum[1][2][b]);
    sums_of(moment_sum, moment_totals);
    if constexpr (C::sums == gather_sums::atomic) {
      // One lock for both rows.
      float* const moments_row = gather.moments_out + static_cast<std::size_t>(moment_stride) * id;
      float* const sh_row = gather.sh_gradient + static_cast<std::size_t>(sh_stride) * id;
      int const active = 3 * sh_coefficients(gather.active_degree);
      C::policy::exclusively(moments_row, [&] {
        if constexpr (C::terms::color)
          for (int i = 0; i < active; ++i) sh_row[i] += sh[i];
        if constexpr (C::terms::geometry)
          for (int i = 0; i < moment_count; ++i) moments_row[i] += moment_totals[i];
      });
    } else {
      gather.finish(range, area, id, sh, reinterpret_cast<float const(&)[moment_stride]>(moment_totals));
    }
  }

  static lanes dot(vec3_of<lanes> const& a, vec3_of<lanes> const& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
};

#endif

}}  // namespace gart::GART_ISA
