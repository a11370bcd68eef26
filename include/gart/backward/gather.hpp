#pragma once
// The backward pass by primitive: a team takes a tile, its lanes take the primitives of the tile's list in turn. A lane
// walks the pixels that the primitive's box and the tile share, reads what the forward pass recorded there, sums the
// gradient in registers and adds it to the Gaussian once. Rays and their SH bases are computed once a tile, into scratch.
//
// Whether a slot is a hit is told by the slot itself (backward/record_lt.hpp); its t, offset and alpha are evaluated again
// by the function the forward pass used, so they are the same bits.

#include <gart/backward/record_lt.hpp>
#include <gart/backward/terms.hpp>
#include <gart/math/hit_gradient.hpp>
#include <gart/math/sh.hpp>
#include <gart/scene/gaussians.hpp>
#include <gart/tiles/tile_map.hpp>

namespace gart {

// 16 bytes, moved as one.
struct alignas(16) quad {
  float v[4];
};

// Where a lane's sums go: added to the Gaussian atomically, or kept as one row a (primitive, tile) pair, in primitive-major
// order, for sum_pairs to add up in that order: the same bits in every run.
enum class gather_sums { atomic, ordered };

// A row of the ordered sums: SH gradient, padded to quads, then moments.
template <int ShDegree>
struct pair_row {
  static constexpr int sh_quads = (3 * sh_basis<ShDegree>::size + 3) / 4;
  static constexpr int quads = sh_quads + moment_stride / 4;
};

template <int ShDegree, class Terms, class Entry, int Size, gather_sums Sums, execution E>
struct gather_kernel {
  static constexpr int block_size = 64;
  static constexpr int bands = sh_basis<ShDegree>::size;
  static constexpr int sh_stride = 3 * bands;
  using grid_type = tile_grid<Size>;

  // What a lane needs of a pixel: direction and (colour . gradient), gradient, SH basis. Records are an odd number of
  // 16-byte words apart where they can be, so that lanes on neighbouring pixels read different banks.
  struct pixel_data {
    static constexpr int basis_quads = (bands + 3) / 4;
    quad direction_total, gradient;
    quad basis[basis_quads];
    quad spread[basis_quads % 2 ? 0 : 1];
  };
  struct scratch {
    pixel_data pixels[grid_type::pixels];
  };

  camera view;
  grid_type grid;
  tile_map_view map;
  lt_range const* ranges = nullptr;
  Entry const* slots = nullptr;
  ray_gaussian const* records = nullptr;
  float const* sh = nullptr;
  int active_degree = ShDegree;
  float const* color = nullptr;           // [H][W][3]
  float const* color_gradient = nullptr;  // [H][W][3]
  float* sh_gradient = nullptr;              // atomic: [N][K][3]
  float* moments_out = nullptr;              // atomic: [N][moment_stride]
  u64 const* pair_offsets = nullptr;         // ordered: first row of each primitive
  quad* rows = nullptr;                      // ordered: [pairs][pair_row::quads]

  template <class Team>
  GART_HD void operator()(Team const& team) const {
    u32 const tile = team.tile();
    u32 const first = map.offsets[tile], count = map.offsets[tile + 1] - first;
    if (count == 0) return;
    pixel_box const area = grid.tile(tile);
    scratch& s = team.scratch();
    team.for_each(area.area(), [&](index_t p) { load_pixel(s.pixels[p], area, p); });
    team.barrier();
    team.for_each(count, [&](index_t k) { gather(s, area, map.primitives[first + k]); });
    team.barrier();
  }

 private:
  GART_HD void load_pixel(pixel_data& out, pixel_box const& area, index_t p) const {
    pixel const at{static_cast<int>(area.x0 + p % area.width()), static_cast<int>(area.y0 + p / area.width())};
    std::size_t const a = 3 * (static_cast<std::size_t>(at.y) * view.width + at.x);
    vec3 const d = pixel_ray(view, at).direction;
    sh_basis<ShDegree> const basis(d);
    vec3 const c(color[a], color[a + 1], color[a + 2]);
    vec3 const g(color_gradient[a], color_gradient[a + 1], color_gradient[a + 2]);
    out.direction_total = {{d.x, d.y, d.z, c.x * g.x + c.y * g.y + c.z * g.z}};
    out.gradient = {{g.x, g.y, g.z, 0}};
    GART_UNROLL
    for (int k = 0; k < 4 * pixel_data::basis_quads; ++k) out.basis[k / 4].v[k % 4] = k < bands ? basis.y[k] : 0.0f;
  }

  // The coefficients in use; those above the active degree as zero, so that the loops over bands are straight.
  GART_HD void load_coefficients(float (&c)[sh_stride], u32 id) const {
    float const* from = sh + static_cast<std::size_t>(sh_stride) * id;
    int const active = 3 * sh_coefficients(active_degree);
    if constexpr (sh_stride % 4 == 0) {
      GART_UNROLL
      for (int k = 0; k < sh_stride; k += 4) {
        quad q{};
        if (k < active) q = *reinterpret_cast<quad const*>(from + k);
        GART_UNROLL
        for (int i = 0; i < 4; ++i) c[k + i] = k + i < active ? q.v[i] : 0.0f;
      }
    } else {
      GART_UNROLL
      for (int k = 0; k < sh_stride; ++k) c[k] = k < active ? from[k] : 0.0f;
    }
  }

  GART_HD void gather(scratch const& s, pixel_box const& area, u32 id) const {
    lt_range const range = ranges[id];
    pixel_box const cell = intersect(range.box, area);
    Entry const* slot = slots + range.offset + tile_offset(range.box, cell);
    ray_gaussian const g = records[id];
    float coefficients[sh_stride];
    load_coefficients(coefficients, id);
    float sh_sum[sh_stride] = {};
    float moment_sum[moment_stride] = {};
    u32 const width = cell.width(), slots_here = cell.area();
    u32 const skip = area.width() - width;
    u32 p = (cell.y0 - area.y0) * area.width() + (cell.x0 - area.x0);
    u32 column = 0;
    for (u32 k = 0; k < slots_here; ++k) {
      Entry const entry = slot[k];
      pixel_data const& at = s.pixels[p];
      ++p;
      if (++column == width) column = 0, p += skip;
      float const before = transmittance_of(entry);
      if (!written(before)) continue;
      quad const direction_total = at.direction_total, pixel_gradient = at.gradient;
      response const r = evaluate(g, primary_ray{{direction_total.v[0], direction_total.v[1], direction_total.v[2]}});
      float const alpha = hit_alpha(g, r), weight = before * alpha;
      float basis[4 * pixel_data::basis_quads];
      GART_UNROLL
      for (int q = 0; q < pixel_data::basis_quads; ++q) {
        quad const four = at.basis[q];
        GART_UNROLL
        for (int i = 0; i < 4; ++i) basis[4 * q + i] = four.v[i];
      }
      vec3 c(0.5f);
      GART_UNROLL
      for (int b = 0; b < bands; ++b) {
        c.x += basis[b] * coefficients[3 * b];
        c.y += basis[b] * coefficients[3 * b + 1];
        c.z += basis[b] * coefficients[3 * b + 2];
      }
      vec3 const dl(pixel_gradient.v[0], pixel_gradient.v[1], pixel_gradient.v[2]);
      if constexpr (Terms::color) {
        vec3 const cg = color_gradient_of(c, dl, weight);
        GART_UNROLL
        for (int b = 0; b < bands; ++b) {
          sh_sum[3 * b] += basis[b] * cg.x;
          sh_sum[3 * b + 1] += basis[b] * cg.y;
          sh_sum[3 * b + 2] += basis[b] * cg.z;
        }
      }
      if constexpr (Terms::geometry) {
        vec3 const seen = clamped_color(c);
        float const color_g = seen.x * dl.x + seen.y * dl.y + seen.z * dl.z;
        float const behind = direction_total.v[3] - (entry.r * dl.x + entry.g * dl.y + entry.b * dl.z);
        moments const m = hit_moments(g, r, alpha_gradient(before, color_g, behind, alpha));
        GART_UNROLL
        for (int i = 0; i < moment_count; ++i) moment_sum[i] += m.v[i];
      }
    }
    if constexpr (Sums == gather_sums::atomic) {
      if constexpr (Terms::color)
        E::atomic_add_row(sh_gradient + static_cast<std::size_t>(sh_stride) * id, sh_sum, 3 * sh_coefficients(active_degree));
      if constexpr (Terms::geometry)
        E::atomic_add_row(moments_out + static_cast<std::size_t>(moment_stride) * id, moment_sum, moment_count);
    } else {
      store_row(range.box, area, id, sh_sum, moment_sum);
    }
  }

  GART_HD void store_row(pixel_box const& box, pixel_box const& area, u32 id, float const (&sh_sum)[sh_stride],
                         float const (&moment_sum)[moment_stride]) const {
    using row = pair_row<ShDegree>;
    pixel_box const tiles = tiles_of<Size>(box);
    u64 const pair = pair_offsets[id] + (area.y0 / Size - tiles.y0) * tiles.width() + (area.x0 / Size - tiles.x0);
    quad* const out = rows + pair * row::quads;
    if constexpr (Terms::color) {
      int const active = 3 * sh_coefficients(active_degree);
      GART_UNROLL
      for (int q = 0; q < row::sh_quads; ++q) {
        quad four{};
        GART_UNROLL
        for (int i = 0; i < 4; ++i) four.v[i] = 4 * q + i < sh_stride && 4 * q + i < active ? sh_sum[4 * q + i] : 0.0f;
        out[q] = four;
      }
    }
    if constexpr (Terms::geometry) {
      GART_UNROLL
      for (int q = 0; q < moment_stride / 4; ++q)
        out[row::sh_quads + q] = {{moment_sum[4 * q], moment_sum[4 * q + 1], moment_sum[4 * q + 2], moment_sum[4 * q + 3]}};
    }
  }
};

// The ordered sums: quad q of primitive i over its rows, in order. One index a quad, quads of a primitive together.
template <int ShDegree, class Terms>
struct sum_pairs {
  using row = pair_row<ShDegree>;
  span<u64 const> pair_offsets;
  u64 pairs;
  quad const* rows;
  float* sh_gradient;
  float* moments_out;
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

}  // namespace gart
