#pragma once
/// \file
/// The backward pass by primitive. A team takes a tile; its lanes take the primitives of the tile's list in turn. A
/// lane walks the pixels that the primitive's box and the tile share. There it reads the record of the forward pass and
/// sums the gradient in registers. It adds the sum to the Gaussian once. Rays and their SH bases are computed once a
/// tile, into scratch. This is the plain form, for tiles of any size. backward/packet_gather.hpp computes the same on a
/// host, backward/matrix_gather.hpp on a device.
///
/// The slot tells whether it is a hit (backward/hit_slot.hpp). The function that the forward pass used evaluates t,
/// offset and alpha again, so they are the same bits.

#include <gart/backward/depth.hpp>
#include <gart/backward/gather_configuration.hpp>
#include <gart/backward/record_slots.hpp>
#include <gart/backward/terms.hpp>
#include <gart/math/hit_gradient.hpp>
#include <gart/math/sh.hpp>
#include <gart/render/composite.hpp>
#include <gart/scene/gaussians.hpp>
#include <gart/tiles/tile_map.hpp>

namespace gart { inline namespace GART_ISA {

/// A row of the ordered sums: SH gradient, padded to quads, then moments.
template <int ShDegree>
struct pair_gradient {
  static constexpr int sh_quads = (3 * sh_basis<ShDegree>::size + 3) / 4;  ///< of the SH gradient
  static constexpr int quads = sh_quads + moment_stride / 4;               ///< of a row
};

/// The tile kernel of the gather, in its plain form.
template <gather_configuration C>
struct gather_kernel {
  using response_type = typename C::response;                                   ///< of the Gaussians
  using entry_type = typename C::entry;                                         ///< of the hit buffer
  static constexpr bool recomputed = C::validity == slot_validity::recomputed;  ///< whether hits are decided again
  static constexpr int block_size = 64,                                         ///< lanes of a team
      min_blocks = C::terms::geometry ? 8 : 10;                                 ///< teams a multiprocessor holds
  /// SH functions.
  static constexpr int bands = sh_basis<C::sh_degree>::size;
  static constexpr int sh_stride = 3 * bands;  ///< floats of a Gaussian's coefficients
  using grid_type = tile_grid<C::tile_size>;   ///< the image's tiles
  /// A slot as it is read.
  using slot_type = std::conditional_t<C::terms::depth, entry_with_depth<entry_type>, entry_type>;

  static constexpr bool central = C::rays::central;  ///< whether all rays begin at the frame's origin

  /// The values of a pixel that a lane needs: direction and (colour . gradient), gradient, SH basis. Where possible,
  /// records are an odd number of 16-byte words apart. Lanes on neighbouring pixels then read different banks.
  struct pixel_data {
    /// Of degree 0 it is a constant.
    static constexpr int basis_quads = !C::terms::color || C::sh_degree == 0 ? 0 : (bands + 3) / 4;
    quad direction_total,  ///< direction, colour . gradient
        gradient;          ///< gradient, error
    /// SH functions of the direction.
    quad basis[basis_quads];
    quad last;  ///< t and place of the ray's last hit, where validity is recomputed; the depth's gradient, where there
                /// is one; and what makes the words odd in number
    quad origin[central ? 0 : 1];                       ///< of the ray, where it has one
    quad spread[(basis_quads + !central) % 2 ? 1 : 0];  ///< room, where the words would be even in number
  };
  /// What a team shares.
  struct scratch {
    pixel_data pixels[grid_type::pixels];  ///< of the tile
  };

  typename C::rays rays;  ///< of the view
  grid_type grid;         ///< of the view
  tile_map_view map;      ///< the tiles' lists
  /// [N]: boxes, and where their slots begin.
  footprint_slots const* ranges = nullptr;
  entry_type const* slots = nullptr;  ///< the hit buffer
  /// [N], in the view's frame.
  ray_gaussian const* records = nullptr;
  int active_degree = C::sh_degree;       ///< bands above it have no gradient
  float const* color = nullptr;           ///< [H][W][3]
  float const* color_gradient = nullptr;  ///< [H][W][3]
  float const* error = nullptr;           ///< [H][W], or null: none is attributed
  float* sh_gradient = nullptr;           ///< atomic: [N][K][3]
  float* moments_out = nullptr;           ///< atomic: [N][moment_stride]
  u64 const* pair_offsets = nullptr;      ///< ordered: first row of each primitive
  quad* rows = nullptr;                   ///< ordered: [pairs][pair_gradient::quads]
  last_hit const* last = nullptr;         ///< recomputed: [H][W]
  float near = 0;                         ///< hits lie at t > near
  /// What depth needs, where it has a gradient.
  depth_image depth;

  /// Gathers the tile of a team.
  GART_KERNEL void operator()(auto const& team) const {
    u32 const tile = team.tile();
    u32 const first = map.offsets[tile], count = map.offsets[tile + 1] - first;
    if (count == 0) return;
    pixel_box const area = grid.tile(tile);
    scratch& s = team.scratch();
    team.for_each(area.area(), [&](index_t p) {
      u32 const x = area.x0 + p % area.width(), y = area.y0 + p / area.width();
      load_pixel(s.pixels[p], {static_cast<int>(x), static_cast<int>(y)});
    });
    team.barrier();
    team.for_each(count, [&](index_t k) { gather(s, area, map.primitives[first + k]); });
    team.barrier();
  }

  /// Adds the sums of a primitive's walk of a tile to the Gaussian, or to its row.
  GART_KERNEL GART_INLINE void finish(footprint_slots const& range, pixel_box const& area, u32 id,
                                      float const (&sh_sum)[sh_stride],
                                      float const (&moment_sum)[moment_stride]) const {
    if constexpr (C::terms::color) add_color_sums(range, area, id, 0, sh_sum);
    if constexpr (C::terms::geometry) add_moment_sums(range, area, id, moment_sum);
  }

 protected:
  /// `sums`, an array of N, are floats [first, first + N) of the colour's.
  GART_KERNEL GART_INLINE void add_color_sums(footprint_slots const& range, pixel_box const& area, u32 id, int first,
                                              auto const& sums) const {
    constexpr int N = std::extent_v<std::remove_cvref_t<decltype(sums)>>;
    int const active = 3 * sh_coefficients(active_degree) - first;
    if constexpr (C::sums == gather_sums::atomic) {
      C::policy::atomic_add_row(sh_gradient + static_cast<std::size_t>(sh_stride) * id + first, sums, active);
    } else if constexpr (N % 4 == 0 || N == sh_stride) {
      quad* const out = row_of(range, area, id) + first / 4;
      GART_UNROLL
      for (int q = 0; q < (N + 3) / 4; ++q) {
        quad four{};
        GART_UNROLL
        for (int i = 0; i < 4; ++i) four.v[i] = 4 * q + i < N && 4 * q + i < active ? sums[4 * q + i] : 0.0f;
        out[q] = four;
      }
    } else {
      float* const out = reinterpret_cast<float*>(row_of(range, area, id)) + first;
      GART_UNROLL
      for (int i = 0; i < N; ++i) out[i] = i < active ? sums[i] : 0.0f;
    }
  }
  /// The same with the moments.
  GART_KERNEL GART_INLINE void add_moment_sums(footprint_slots const& range, pixel_box const& area, u32 id,
                                               float const (&sums)[moment_stride]) const {
    if constexpr (C::sums == gather_sums::atomic) {
      C::policy::atomic_add_row(moments_out + static_cast<std::size_t>(moment_stride) * id, sums, moment_count);
    } else {
      quad* const out = row_of(range, area, id) + pair_gradient<C::sh_degree>::sh_quads;
      GART_UNROLL
      for (int q = 0; q < moment_stride / 4; ++q)
        out[q] = {{sums[4 * q], sums[4 * q + 1], sums[4 * q + 2], sums[4 * q + 3]}};
    }
  }

  /// The values of pixel `at` that the lanes need.
  GART_HD void load_pixel(pixel_data& out, pixel const& at) const {
    std::size_t const a = 3 * (static_cast<std::size_t>(at.y) * rays.view.width + at.x);
    auto const r = pixel_ray(rays, at);
    vec3 const d = r.direction;
    if constexpr (!central) out.origin[0] = {{r.origin.x, r.origin.y, r.origin.z, 0}};
    vec3 const c(color[a], color[a + 1], color[a + 2]);
    vec3 const g(color_gradient[a], color_gradient[a + 1], color_gradient[a + 2]);
    out.direction_total = {{d.x, d.y, d.z, c.x * g.x + c.y * g.y + c.z * g.z}};
    out.gradient = {{g.x, g.y, g.z, error ? error[a / 3] : 0.0f}};
    if constexpr (recomputed) {
      last_hit const end = last[a / 3];
      out.last = {{end.t, bits_to_float(end.place), 0, 0}};
    }
    if constexpr (C::terms::depth) {
      out.direction_total.v[3] += depth.total(a / 3);
      out.last.v[2] = depth.gradient(a / 3);
    }
    if constexpr (pixel_data::basis_quads > 0) {
      sh_basis<C::sh_degree> const basis(d);
      GART_UNROLL
      for (int k = 0; k < 4 * pixel_data::basis_quads; ++k) out.basis[k / 4].v[k % 4] = k < bands ? basis.y[k] : 0.0f;
    }
  }

  /// A primitive over its cell of a tile.
  GART_KERNEL void gather(scratch const& s, pixel_box const& area, u32 id) const {
    footprint_slots const range = ranges[id];
    float sh_sum[sh_stride] = {};
    float moment_sum[moment_stride] = {};
    lane_data const data(*this, id);
    pixel_box const cell = cell_in(range, area);
    u32 const first = static_cast<u32>(range.offset) + tile_offset(range, cell);
    u32 const width = cell.width(), last_slot = cell.area() - 1;
    u32 const skip = area.width() - width;
    u32 p = (cell.y0 - area.y0) * area.width() + (cell.x0 - area.x0);
    u32 column = 0;
    // Read two ahead: the work between hides the latency of memory.
    slot_type next = slot_at(first, 0), after = slot_at(first, last_slot > 0 ? 1 : 0);
    for (u32 k = 0; k <= last_slot; ++k) {
      slot_type const entry = next;
      next = after;
      after = slot_at(first, k + 2 < last_slot ? k + 2 : last_slot);
      pixel_data const& at = s.pixels[p];
      ray_peak r[1];
      peaks_at(r, data, [&](int) -> pixel_data const& { return at; });
      if (holds(at, entry, first + k, r[0], data)) {
        if constexpr (C::terms::color) add_color(at, entry, sh_sum);
        if constexpr (C::terms::geometry) add_moments(at, entry, r[0], data, true, moment_sum);
      }
      ++p;
      if (++column == width) column = 0, p += skip;
    }
    finish(range, area, id, sh_sum, moment_sum);
  }

  /// Slot k from that number on.
  GART_HD GART_INLINE slot_type slot_at(std::size_t first, std::size_t k) const {
    if constexpr (C::terms::depth)
      return {{(slots + first)[k]}, (depth.slots + first)[k]};
    else
      return (slots + first)[k];
  }

  /// The values of its Gaussian that a lane keeps: colour alone needs nothing but the slots.
  struct no_data {
    /// Reads nothing.
    GART_HD no_data(gather_kernel const&, u32) {}
  };
  /// The Gaussian in the view's frame.
  struct record_data {
    ray_gaussian gaussian;  ///< read once a primitive
    /// Of Gaussian `id`.
    GART_HD record_data(gather_kernel const& k, u32 id) : gaussian(k.records[id]) {}
  };
  /// The ones of the two that the terms need.
  using lane_data = std::conditional_t<C::terms::geometry || recomputed, record_data, no_data>;

  /// The Gaussian's values for the rays of N pixels at once.
  template <int N, class F>
  GART_HD GART_INLINE void peaks_at(ray_peak (&out)[N], lane_data const& data, F&& pixel_of) const {
    if constexpr (std::is_same_v<lane_data, record_data>)
      evaluate_all(out, [&](int i) {
        quad const d = pixel_of(i).direction_total;
        if constexpr (central) {
          return approach_to(data.gaussian, primary_ray{{d.v[0], d.v[1], d.v[2]}});
        } else {
          quad const o = pixel_of(i).origin[0];
          return approach_to(data.gaussian, ray{{o.v[0], o.v[1], o.v[2]}, {d.v[0], d.v[1], d.v[2]}});
        }
      });
  }
  /// Whether the slot of that number is a hit.
  GART_HD GART_INLINE bool holds(pixel_data const& at, entry_type const& entry, u32 number, ray_peak const& r,
                                 lane_data const& data) const {
    if constexpr (recomputed)
      return static_cast<int>(is_hit(data.gaussian, r, near)) &
             static_cast<int>(!before(at.last.v[0], float_to_bits(at.last.v[1]), r.t, number));
    else
      return entry.written();
  }

  /// One hit: its pixel, its slot.
  GART_HD GART_INLINE void add_color(pixel_data const& at, entry_type const& entry, float (&sh_sum)[sh_stride]) const {
    quad const g = at.gradient;
    sh_basis<C::sh_degree> basis;
    if constexpr (C::sh_degree == 0) basis = sh_basis<C::sh_degree>(vec3(0.0f));
    GART_UNROLL
    for (int q = 0; q < pixel_data::basis_quads; ++q) {
      quad const four = at.basis[q];
      GART_UNROLL
      for (int i = 0; i < 4; ++i)
        if (4 * q + i < bands) basis.y[4 * q + i] = four.v[i];
    }
    float const w = entry.weight();
    vec3 const cg(entry.clamped(0) ? 0.0f : w * g.v[0], entry.clamped(1) ? 0.0f : w * g.v[1],
                  entry.clamped(2) ? 0.0f : w * g.v[2]);
    GART_UNROLL
    for (int b = 0; b < bands; ++b) {
      sh_sum[3 * b] += basis.y[b] * cg.x;
      sh_sum[3 * b + 1] += basis.y[b] * cg.y;
      sh_sum[3 * b + 2] += basis.y[b] * cg.z;
    }
  }
  /// Adds a hit's moments to the sums; nothing where `hit` is false.
  GART_HD GART_INLINE void add_moments(pixel_data const& at, slot_type const& entry, ray_peak const& r,
                                       lane_data const& data, bool hit, float (&moment_sum)[moment_stride]) const {
    quad const g = at.gradient;
    vec3 const opaque = entry.color();
    float opaque_g = opaque.x * g.v[0] + opaque.y * g.v[1] + opaque.z * g.v[2];
    if constexpr (C::terms::depth) opaque_g += entry.depth * at.last.v[2];
    float const alpha = estimated_hit_alpha<response_type>(data.gaussian, r.d2);
    float const by_alpha = alpha_gradient(opaque_g, at.direction_total.v[3], alpha);
    moments_of<float> m;
    if constexpr (C::terms::depth)
      m = hit_moments_with_depth<response_type>(data.gaussian, r, by_alpha, entry.weight() * at.last.v[2], hit);
    else
      m = hit_moments<response_type>(data.gaussian, r, by_alpha, hit);
    GART_UNROLL
    for (int i = 0; i < error_place; ++i) moment_sum[i] += m.v[i];
    moment_sum[error_place] += hit ? entry.weight() * g.v[3] : 0.0f;
  }

  /// The pair's row of the ordered sums.
  GART_HD GART_INLINE quad* row_of(footprint_slots const& range, pixel_box const& area, u32 id) const {
    pixel_box const tiles = tiles_of<C::tile_size>(range);
    u32 const past = (range.columns_past(area.x1) + C::tile_size - 1) / C::tile_size;
    u64 const pair = pair_offsets[id] + (area.y0 / C::tile_size - tiles.y0) * tiles.width() +
                     (area.x0 / C::tile_size + past - tiles.x0);
    return rows + pair * pair_gradient<C::sh_degree>::quads;
  }
};

/// The ordered sums: quad q of primitive i over its rows, in order. One index a quad, quads of a primitive together.
template <int ShDegree, class Terms>
struct sum_pairs {
  using row = pair_gradient<ShDegree>;  ///< what is added up
  /// [N]: first row of each primitive.
  span<u64 const> pair_offsets;
  u64 pairs;  ///< rows in all
  /// [pairs][row::quads].
  quad const* rows;
  /// [N][K][3], overwritten.
  float* sh_gradient;
  /// [N][moment_stride], overwritten.
  float* moments_out;
  /// Index: primitive times row::quads, plus q.
  GART_KERNEL void operator()(index_t index) const {
    index_t const i = index / row::quads, q = index % row::quads;
    bool const is_color = q < row::sh_quads;
    if (is_color ? !Terms::color : !Terms::geometry) return;
    u64 const last = i + 1 < pair_offsets.size() ? pair_offsets[i + 1] : pairs;
    quad sum{};
    for (u64 pair = pair_offsets[i]; pair < last; ++pair) {
      quad const four = rows[pair * row::quads + q];
      for (int k = 0; k < 4; ++k) sum.v[k] += four.v[k];
    }
    constexpr int sh_stride = 3 * sh_basis<ShDegree>::size;
    for (int k = 0; k < 4; ++k) {
      if (!is_color)
        moments_out[static_cast<std::size_t>(moment_stride) * i + 4 * (q - row::sh_quads) + k] = sum.v[k];
      else if (static_cast<int>(4 * q) + k < sh_stride)
        sh_gradient[static_cast<std::size_t>(sh_stride) * i + 4 * q + k] = sum.v[k];
    }
  }
};

}}  // namespace gart::GART_ISA
