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

template <int ShDegree, class Terms, class Entry, int Size, execution E>
struct gather_kernel {
  static constexpr int block_size = 64;
  static constexpr int bands = sh_basis<ShDegree>::size;
  static constexpr int sh_stride = 3 * bands;
  using grid_type = tile_grid<Size>;

  // One column a pixel: lanes of a warp on neighbouring pixels read neighbouring banks.
  struct scratch {
    float direction[3][grid_type::pixels];
    float gradient[3][grid_type::pixels];
    float total[grid_type::pixels];  // colour of the pixel, background included, . gradient
    float basis[bands][grid_type::pixels];
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
  float* sh_gradient = nullptr;
  float* moments_out = nullptr;

  template <class Team>
  GART_HD void operator()(Team const& team) const {
    u32 const tile = team.tile();
    u32 const first = map.offsets[tile], count = map.offsets[tile + 1] - first;
    if (count == 0) return;
    pixel_box const area = grid.tile(tile);
    scratch& s = team.scratch();
    team.for_each(area.area(), [&](index_t p) { load_pixel(s, area, p); });
    team.barrier();
    team.for_each(count, [&](index_t k) { gather(s, area, map.primitives[first + k]); });
    team.barrier();
  }

 private:
  GART_HD void load_pixel(scratch& s, pixel_box const& area, index_t p) const {
    pixel const at{static_cast<int>(area.x0 + p % area.width()), static_cast<int>(area.y0 + p / area.width())};
    std::size_t const a = 3 * (static_cast<std::size_t>(at.y) * view.width + at.x);
    vec3 const d = pixel_ray(view, at).direction;
    sh_basis<ShDegree> const basis(d);
    float total = 0;
    for (int c = 0; c < 3; ++c) {
      s.direction[c][p] = d[c];
      s.gradient[c][p] = color_gradient[a + c];
      total += color[a + c] * color_gradient[a + c];
    }
    s.total[p] = total;
    GART_UNROLL
    for (int k = 0; k < bands; ++k) s.basis[k][p] = basis.y[k];
  }

  GART_KERNEL void gather(scratch const& s, pixel_box const& area, u32 id) const {
    lt_range const range = ranges[id];
    pixel_box const cell = intersect(range.box, area);
    Entry const* slot = slots + range.offset + tile_offset(range.box, cell);
    ray_gaussian const g = records[id];
    float const* coefficients = sh + static_cast<std::size_t>(sh_stride) * id;
    int const active = sh_coefficients(active_degree);
    float sh_sum[sh_stride] = {};
    float moment_sum[moment_stride] = {};
    for (u32 y = cell.y0; y < cell.y1; ++y)
      for (u32 x = cell.x0; x < cell.x1; ++x, ++slot) {
        Entry const entry = *slot;
        float const before = transmittance_of(entry);
        if (!written(before)) continue;
        u32 const p = (y - area.y0) * area.width() + (x - area.x0);
        response const r = evaluate(g, primary_ray{{s.direction[0][p], s.direction[1][p], s.direction[2][p]}});
        float const alpha = hit_alpha(g, r), weight = before * alpha;
        vec3 c(0.5f);
        GART_UNROLL
        for (int k = 0; k < bands; ++k) {
          if (k == active) break;
          float const basis = s.basis[k][p];
          for (int i = 0; i < 3; ++i) c[i] += basis * coefficients[3 * k + i];
        }
        vec3 const pixel_gradient(s.gradient[0][p], s.gradient[1][p], s.gradient[2][p]);
        if constexpr (Terms::color) {
          vec3 const cg = color_gradient_of(c, pixel_gradient, weight);
          GART_UNROLL
          for (int k = 0; k < bands; ++k) {
            if (k == active) break;
            float const basis = s.basis[k][p];
            sh_sum[3 * k] += basis * cg.x;
            sh_sum[3 * k + 1] += basis * cg.y;
            sh_sum[3 * k + 2] += basis * cg.z;
          }
        }
        if constexpr (Terms::geometry) {
          vec3 const seen = clamped_color(c);
          float const color_g = seen.x * pixel_gradient.x + seen.y * pixel_gradient.y + seen.z * pixel_gradient.z;
          float const behind = s.total[p] - (entry.r * pixel_gradient.x + entry.g * pixel_gradient.y + entry.b * pixel_gradient.z);
          moments const m = hit_moments(g, r, alpha_gradient(before, color_g, behind, alpha));
          GART_UNROLL
          for (int i = 0; i < moment_count; ++i) moment_sum[i] += m.v[i];
        }
      }
    if constexpr (Terms::color)
      E::atomic_add_row(sh_gradient + static_cast<std::size_t>(sh_stride) * id, sh_sum, 3 * active);
    if constexpr (Terms::geometry)
      E::atomic_add_row(moments_out + static_cast<std::size_t>(moment_stride) * id, moment_sum, moment_count);
  }
};

}  // namespace gart
