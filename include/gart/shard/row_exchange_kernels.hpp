#pragma once
/// \file
/// The kernels of row_exchange.hpp.

#include <gart/backward/gather.hpp>
#include <gart/camera/models.hpp>
#include <gart/optim/rows.hpp>
#include <gart/scene/image_rows.hpp>
#include <gart/tiles/footprint_slots.hpp>

namespace gart::inline GART_ISA::detail {

// The box of a row in a view; cost is, by rows of tiles, by how much their pairs are more than those of the row above.
// One row in `every` is counted, for all of them, and with 0 none: many atomic additions to few addresses are slow.
template <class Response, class E, int Size, class Bounds>
struct box_kernel {
  gaussians_view<float const> scene;
  Bounds bounds;
  vec3d frame;
  float alpha_min;
  footprint_slots* boxes;
  u64* cost;
  index_t every;
  GART_KERNEL void operator()(index_t i) const {
    footprint const f = footprint_of<Response>(bounds, load_parameters(scene, i), frame, alpha_min);
    footprint_slots const range(0, f.box, f.seam);
    boxes[i] = range;
    if (every == 0 || i % every != 0 || f.box.empty()) return;
    pixel_box const tiles = tiles_of<Size>(range);
    u64 const pairs = u64{tiles.width()} * every;
    E::atomic_add(cost + tiles.y0, pairs);
    E::atomic_add(cost + tiles.y1, ~pairs + 1);
  }
};

// The part of a box in some rows, as footprints cut it.
GART_HD inline pixel_box cut(pixel_box box, image_rows const& rows) {
  if (box.y0 < rows.first) box.y0 = static_cast<u16>(rows.first);
  if (box.y1 > rows.end) box.y1 = static_cast<u16>(rows.end);
  return box;
}

struct select_kernel {
  footprint_slots const* boxes;
  image_rows rows;
  u32* flags;
  GART_KERNEL void operator()(index_t i) const { flags[i] = !cut(boxes[i].box, rows).empty(); }
};

// The pairs of a box that began above the rows, or begins with them; 0 of others. Of `range`, cut to the rows or not.
template <int Size>
GART_HD inline u32 continued_pairs(footprint_slots range, image_rows const& rows) {
  range.box = cut(range.box, rows);
  return rows.first > 0 && range.box.y0 == rows.first ? tiles_of<Size>(range).area() : 0;
}

// What a row that does not go to a unit has for its place among those that do.
inline constexpr u32 not_sent = ~u32{0};

template <int Size>
struct list_kernel {
  footprint_slots const* boxes;
  image_rows rows;
  u32 const* flags;
  u64 const* places;
  u32 *list, *pairs, *place_of;
  GART_KERNEL void operator()(index_t i) const {
    place_of[i] = flags[i] ? static_cast<u32>(places[i]) : not_sent;
    if (!flags[i]) return;
    list[places[i]] = i, pairs[places[i]] = continued_pairs<Size>(boxes[i], rows);
  }
};

// Rows, and the Gaussian's number behind each.
struct pack_body {
  gaussians_view<float const> scene;
  row_owners owners;
  u32 const* list;
  float* out;
  index_t width;
  GART_KERNEL void operator()(index_t k, index_t column) const {
    index_t const row = list[k];
    out[std::size_t{k} * width + column] =
        column + 1 < width ? row_element(scene, row, column) : bits_to_float(static_cast<u32>(owners.global(row)));
  }
};

struct ids_kernel {
  float const* in;
  index_t width;
  u32 *ids, *order;
  GART_KERNEL void operator()(index_t k) const {
    ids[k] = float_to_bits(in[std::size_t{k} * width + width - 1]), order[k] = k;
  }
};

struct unpack_body {
  gaussians_view<float> scene;
  float const* in;
  index_t width;  // with the number
  u32 const* order;
  GART_KERNEL void operator()(index_t k, index_t column) const {
    row_element(scene, k, column) = in[std::size_t{order[k]} * width + column];
  }
};

// A column of a Gaussian's sums: colour's gradient first, then the moments.
template <index_t Coefficients, class T>
struct sums_view {
  static constexpr index_t width = Coefficients + moment_stride;
  T *sh_gradient, *moments;
  GART_HD T& operator()(index_t row, index_t column) const {
    return column < Coefficients ? sh_gradient[std::size_t{row} * Coefficients + column]
                                 : moments[std::size_t{row} * moment_stride + (column - Coefficients)];
  }
};

template <index_t Coefficients>
struct pack_sums_body {
  sums_view<Coefficients, float const> sums;
  u32 const* order;
  float* out;
  GART_KERNEL void operator()(index_t k, index_t column) const {
    out[std::size_t{order[k]} * sums.width + column] = sums(k, column);
  }
};

// By where the row lay when it came.
template <int Size>
struct count_pairs_kernel {
  footprint_slots const* ranges;
  image_rows rows;
  u32 const* order;
  u32* counts;
  GART_KERNEL void operator()(index_t k) const { counts[order[k]] = continued_pairs<Size>(ranges[k], rows); }
};

template <int ShDegree>
struct pack_pairs_body {
  static constexpr index_t coefficients = 3 * sh_basis<ShDegree>::size, width = coefficients + moment_stride;
  u64 const* pair_offsets;
  quad const* rows;
  u32 const* order;
  u32 const* counts;
  u64 const* places;
  float* out;
  GART_KERNEL void operator()(index_t k, index_t column) const {
    using row = pair_gradient<ShDegree>;
    index_t const from = column < coefficients ? column : 4 * row::sh_quads + (column - coefficients);
    u32 const at = order[k];
    for (u32 p = 0; p < counts[at]; ++p)
      out[(places[at] + p) * width + column] =
          reinterpret_cast<float const*>(rows + (pair_offsets[k] + p) * row::quads)[from];
  }
};

// What has come back from a rank: the sums of its unit, from `first` on among all that came.
struct returned_unit {
  int view;
  u64 first;
  u32 const* place_of;  // of each row of this rank's, in the unit
};

// Columns [from, from + width) of a row's sums: over the ranks that traced a view, in their order, or their pairs one
// after another; and over views. Rows that no unit has had are zero.
struct add_sums_body {
  returned_unit const* units;
  index_t count, stride, from, width;
  float const* in;
  u64 const* places;  // of the pairs of each; null where sums have no fixed order
  u32 const* pairs;
  float const* pairs_in;
  float* out;
  bool adds;    // to what is there
  float share;  // what the sum is multiplied by
  GART_KERNEL void operator()(index_t row, index_t column) const {
    float& to = out[std::size_t{row} * width + column];
    float total = adds ? to : 0, view = 0;
    for (index_t u = 0; u < count; ++u) {
      if (u > 0 && units[u].view != units[u - 1].view) total += view, view = 0;
      u32 const place = units[u].place_of[row];
      if (place == not_sent) continue;
      u64 const k = units[u].first + place;
      if (!places || pairs[k] == 0)
        view += in[k * stride + from + column];
      else
        for (u32 p = 0; p < pairs[k]; ++p) view += pairs_in[(places[k] + p) * stride + from + column];
    }
    to = (total + view) * share;
  }
};

}  // namespace gart::inline GART_ISA::detail
