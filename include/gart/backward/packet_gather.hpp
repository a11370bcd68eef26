#pragma once
// The gather on a host: as gather_kernel (backward/gather.hpp), with the pixels of a tile in packets, a lane a pixel
// (math/lanes.hpp), and a Gaussian's SH sums a lane a band. Sums are of the same terms in another order.

#include <gart/backward/gather.hpp>
#include <gart/backward/packet_slots.hpp>

#if !defined(__CUDACC__)

namespace gart {

template <class Gather>
struct packet_gather;

template <int ShDegree, class Response, class Terms, class Entry, int Size, gather_sums Sums, slot_validity Validity,
          execution E>
struct packet_gather<gather_kernel<ShDegree, Response, Terms, Entry, Size, Sums, Validity, E>> {
  using gather_type = gather_kernel<ShDegree, Response, Terms, Entry, Size, Sums, Validity, E>;
  static constexpr bool recomputed = gather_type::recomputed;
  static constexpr int bands = gather_type::bands, sh_stride = gather_type::sh_stride;
  static constexpr int packets = Size * Size / lane_count;
  static constexpr int band_groups = (bands + lane_count - 1) / lane_count;

  struct packet_data {
    packet_block block;
    vec3_of<lanes> direction, gradient;
    lanes total, last_t;  // colour . gradient; the ray's last hit
    lane_words last_place;
    lanes bands_of[lane_count][band_groups];  // the SH basis, a pixel after another
  };
  struct scratch {
    packet_data data[packets];
  };

  gather_type gather;

  template <class Team>
  void operator()(Team const& team) const {
    u32 const tile = team.tile();
    u32 const first = gather.map.offsets[tile], last = gather.map.offsets[tile + 1];
    if (first == last) return;
    pixel_box const area = gather.grid.tile(tile);
    scratch& s = team.scratch();
    int p = 0;
    for (int y = area.y0; y < area.y0 + Size; y += packet_block::height)
      for (int x = area.x0; x < area.x0 + Size; x += packet_block::width) load(s.data[p++], area, {x, y});
    u32 const* const list = gather.map.primitives.data();
    for (u32 k = first; k < last && k < first + ahead; ++k) expect(area, list[k]);
    for (u32 k = first; k < last; ++k) {
      if (k + 2 * ahead < last) prefetch(&gather.ranges[list[k + 2 * ahead]]);
      if (k + ahead < last) expect(area, list[k + ahead]);
      sum(s, area, list[k]);
    }
  }

 private:
  // Pixels beyond the image are given the gradient zero and no hit.
  void load(packet_data& out, pixel_box const& area, packet_block const& block) const {
    out.block = block, out.direction = pixel_directions(gather.view, block);
    for (int l = 0; l < lane_count; ++l) {
      pixel const at{block.x + packet_block::column(l), block.y + packet_block::row(l)};
      bool const inside = at.x < area.x1 && at.y < area.y1;
      std::size_t const a = static_cast<std::size_t>(at.y) * gather.view.width + at.x;
      float total = 0;
      for (int k = 0; k < 3; ++k) {
        float const g = inside ? gather.color_gradient[3 * a + k] : 0.0f;
        total += inside ? gather.color[3 * a + k] * g : 0.0f;
        out.gradient[k].v[l] = g;
      }
      out.total.v[l] = total;
      last_hit const end = recomputed && inside ? gather.last[a] : last_hit{};
      out.last_t.v[l] = end.t, out.last_place[l] = end.place;
    }
    sh_basis<ShDegree, lanes> const basis(out.direction);
    for (int l = 0; l < lane_count; ++l)
      for (int k = 0; k < band_groups * lane_count; ++k)
        out.bands_of[l][k / lane_count].v[k % lane_count] = k < bands ? basis.y[k].v[l] : 0.0f;
  }

  static constexpr u32 ahead = 4;  // Gaussians whose slots are fetched while one is summed up

  // What will be read and added to for a Gaussian: its slots lie anywhere in the buffer. Inlined: to a compiler a call
  // that does nothing but fetch does nothing.
  GART_INLINE void expect(pixel_box const& area, u32 id) const {
    lt_range const range = gather.ranges[id];
    pixel_box const cell = intersect(range.box, area);
    char const* const slots = reinterpret_cast<char const*>(gather.slots + range.offset + tile_offset(range.box, cell));
    for (std::size_t byte = 0; byte < cell.area() * sizeof(Entry); byte += 64) prefetch_to_l2(slots + byte);
    prefetch(&gather.records[id]);
    if constexpr (Sums == gather_sums::atomic) {
      if constexpr (Terms::color)
        for (int k = 0; k < sh_stride; k += 16)
          prefetch_to_write(gather.sh_gradient + static_cast<std::size_t>(sh_stride) * id + k);
      if constexpr (Terms::geometry)
        prefetch_to_write(gather.moments_out + static_cast<std::size_t>(moment_stride) * id);
    }
  }

  void sum(scratch const& s, pixel_box const& area, u32 id) const {
    lt_range const range = gather.ranges[id];
    pixel_box const cell = intersect(range.box, area);
    ray_gaussian const& g = gather.records[id];
    lanes sh_sum[2][3][band_groups];  // of even and of odd lanes: additions to one sum wait for each other
    lanes moment_sum[moment_count];
    for (auto& half : sh_sum)
      for (auto& channel : half)
        for (lanes& group : channel) group = 0.0f;
    for (lanes& m : moment_sum) m = 0.0f;

    for (packet_data const& at : s.data) {
      if (!at.block.overlaps(cell)) continue;
      packet_slots const slots(range, cell, at.block);
      response_of<lanes> const r = evaluate<Response>(g, primary_ray_of<lanes>{at.direction});
      lane_mask hit = slots.inside;
      if constexpr (recomputed)
        hit &= is_hit(g, r, gather.near) &
               ((r.t < at.last_t) | ((r.t == at.last_t) & at_most(slots.places(), at.last_place)));
      else
        hit &= slots.written(gather.slots);
      if (!any(hit)) continue;

      packet_entries const e = slots.template read<Terms::geometry>(gather.slots, hit);
      // Geometry first: its steps wait for each other, and those of colour fill the time to the next packet's.
      if constexpr (Terms::geometry) {
        lanes const alpha = hit_alpha<Response>(g, r.d2);
        moments_of<lanes> const m =
            hit_moments<Response>(g, r, alpha_gradient(dot(e.opaque, at.gradient), at.total, alpha));
        for (int i = 0; i < moment_count; ++i) moment_sum[i] += select(hit, m.v[i], 0.0f);
      }
      if constexpr (Terms::color) {
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

    float sh[sh_stride], moments[16];
    for (int b = 0; b < band_groups; ++b)
      write_in_turns(sh + 3 * lane_count * b, sh_stride - 3 * lane_count * b, sh_sum[0][0][b] + sh_sum[1][0][b],
                     sh_sum[0][1][b] + sh_sum[1][1][b], sh_sum[0][2][b] + sh_sum[1][2][b]);
    sums_of(moment_sum, moments);
    gather.finish(range.box, area, id, sh, reinterpret_cast<float const(&)[moment_stride]>(moments));
  }

  static lanes dot(vec3_of<lanes> const& a, vec3_of<lanes> const& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
};

}  // namespace gart

#endif
