#pragma once
// The gather on a host: as gather_kernel (backward/gather.hpp), with the pixels of a tile in packets, a lane a pixel
// (math/lanes.hpp), and a Gaussian's SH sums a lane a band. Sums are of the same terms in another order.

#include <gart/backward/gather.hpp>
#include <gart/trace/packet_walk.hpp>

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
    lane_ints last_place;
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
    for (u32 k = first; k < last; ++k) sum(s, area, gather.map.primitives[k]);
  }

 private:
  // Pixels beyond the image are given the gradient zero and no hit.
  void load(packet_data& out, pixel_box const& area, packet_block const& block) const {
    out.block = block;
    for (int l = 0; l < lane_count; ++l) {
      pixel const at{block.x + packet_block::column(l), block.y + packet_block::row(l)};
      bool const inside = at.x < area.x1 && at.y < area.y1;
      std::size_t const a = static_cast<std::size_t>(at.y) * gather.view.width + at.x;
      vec3 const d = pixel_ray(gather.view, at).direction;
      float total = 0;
      for (int k = 0; k < 3; ++k) {
        float const g = inside ? gather.color_gradient[3 * a + k] : 0.0f;
        total += inside ? gather.color[3 * a + k] * g : 0.0f;
        out.direction[k].v[l] = d[k], out.gradient[k].v[l] = g;
      }
      out.total.v[l] = total;
      last_hit const end = recomputed && inside ? gather.last[a] : last_hit{};
      out.last_t.v[l] = end.t, out.last_place[l] = signed_order(end.place);
    }
    sh_basis<ShDegree, lanes> const basis(out.direction);
    for (int l = 0; l < lane_count; ++l)
      for (int k = 0; k < band_groups * lane_count; ++k)
        out.bands_of[l][k / lane_count].v[k % lane_count] = k < bands ? basis.y[k].v[l] : 0.0f;
  }

  void sum(scratch const& s, pixel_box const& area, u32 id) const {
    lt_range const range = gather.ranges[id];
    pixel_box const cell = intersect(range.box, area);
    u32 const first = static_cast<u32>(range.offset) + tile_offset(range.box, cell);
    Entry const* const slots = gather.slots + first;
    ray_gaussian const& g = gather.records[id];
    lanes sh_sum[3][band_groups];
    lanes moment_sum[moment_count];
    for (auto& channel : sh_sum)
      for (lanes& group : channel) group = 0.0f;
    for (lanes& m : moment_sum) m = 0.0f;

    for (packet_data const& at : s.data) {
      if (!at.block.overlaps(cell)) continue;
      lane_ints const x = lane_columns() + every_lane(at.block.x - cell.x0);
      lane_ints const y = lane_rows() + every_lane(at.block.y - cell.y0);
      lane_mask hit = (x >= 0) & (x < every_lane(cell.x1 - cell.x0)) & (y >= 0) & (y < every_lane(cell.y1 - cell.y0));
      response_of<lanes> const r = evaluate<Response>(g, primary_ray_of<lanes>{at.direction});
      lane_ints const slot = y * every_lane(static_cast<int>(cell.width())) + x;
      if constexpr (recomputed) {
        lane_ints const place = slot + every_lane(signed_order(first));
        lane_mask const reached = (r.t < at.last_t) | ((r.t == at.last_t) & (place <= at.last_place));
        hit &= is_hit(g, r, gather.near) & reached;
      } else {
        for (int l = 0; l < lane_count; ++l)
          if (hit[l] && !slots[slot[l]].written()) hit[l] = 0;
      }
      if (!any(hit)) continue;

      vec3_of<lanes> opaque(0.0f, 0.0f, 0.0f);
      for (u32 left = bits_of(hit); left; left &= left - 1) {
        int const l = __builtin_ctz(left);
        Entry const entry = slots[slot[l]];
        [[maybe_unused]] float const w = entry.weight();
        if constexpr (Terms::geometry) {
          vec3 const c = entry.color();
          for (int k = 0; k < 3; ++k) opaque[k].v[l] = c[k];
        }
        if constexpr (Terms::color)
          for (int c = 0; c < 3; ++c) {
            lanes const cg = entry.clamped(c) ? 0.0f : w * at.gradient[c].v[l];
            for (int b = 0; b < band_groups; ++b) sh_sum[c][b] += at.bands_of[l][b] * cg;
          }
      }
      if constexpr (Terms::geometry) {
        lanes const alpha = hit_alpha<Response>(g, r.d2);
        moments_of<lanes> const m =
            hit_moments<Response>(g, r, alpha_gradient(dot(opaque, at.gradient), at.total, alpha));
        for (int i = 0; i < moment_count; ++i) moment_sum[i] += select(hit, m.v[i], 0.0f);
      }
    }
    flush(range.box, area, id, sh_sum, moment_sum);
  }

  void flush(pixel_box const& box, pixel_box const& area, u32 id, lanes const (&sh)[3][band_groups],
             lanes const (&moment)[moment_count]) const {
    float sh_sum[sh_stride], moment_sum[moment_stride] = {};
    for (int b = 0; b < bands; ++b)
      for (int c = 0; c < 3; ++c) sh_sum[3 * b + c] = sh[c][b / lane_count].v[b % lane_count];
    for (int i = 0; i < moment_count; ++i) moment_sum[i] = sum_of(moment[i]);
    gather.finish(box, area, id, sh_sum, moment_sum);
  }

  // As a signed number of the same order.
  static int signed_order(u32 place) { return static_cast<int>(place ^ 0x80000000u); }
  static lanes dot(vec3_of<lanes> const& a, vec3_of<lanes> const& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
  static lane_ints lane_columns() {
    lane_ints r;
    for (int l = 0; l < lane_count; ++l) r[l] = packet_block::column(l);
    return r;
  }
  static lane_ints lane_rows() {
    lane_ints r;
    for (int l = 0; l < lane_count; ++l) r[l] = packet_block::row(l);
    return r;
  }
};

}  // namespace gart

#endif
