#pragma once
/// \file
/// A Gaussian as one row of floats across the parameter arrays, in the order of their table
/// (scene/parameter_table.hpp). Columns: 0-2 mean, 3-5 log_scale, 6-9 quaternion, 10 opacity, 11.. sh. One launch over
/// (row, column), coalesced on a device, moves, copies or clears whole Gaussians.

#include <gart/comm/row_owners.hpp>
#include <gart/exec/concepts.hpp>
#include <gart/math/ray_gaussian.hpp>
#include <gart/math/widened.hpp>
#include <gart/optim/adam.hpp>
#include <gart/scene/gaussians.hpp>

#include <vector>

namespace gart { inline namespace GART_ISA {

/// mean, log_scale and quaternion: what places and shapes a Gaussian, and comes first in a row.
inline constexpr index_t geometry_columns = 10;

/// Floats of a Gaussian.
inline index_t row_width(int sh_degree) {
  index_t sum = 0;
  for_each_array([&](parameter_array const& a, float const*) { sum += a.width(sh_degree); },
                 gaussians_view<float const>{});
  return sum;
}

/// An element of a row.
template <class T>
GART_HD GART_INLINE T& row_element(gaussians_view<T> const& g, index_t row, index_t column) {
  T* element = nullptr;
  index_t first = 0;  // column of an array
  for_each_array(
      [&](parameter_array const& a, T* values) {
        index_t const width = a.width(g.sh_degree);
        if (column >= first) element = values + std::size_t{row} * width + (column - first);
        first += width;
      },
      g);
  return *element;
}

/// The largest opacity that a view shows a Gaussian with. `filter`: the narrowest filter of any training view at each
/// Gaussian (train/min_pixel_filter.hpp), or null.
GART_HD inline float opacity_shown(gaussians_view<float const> const& g, index_t row, float const* filter) {
  float const own = sigmoid(g.opacity[row]);
  if (!filter) return own;
  float const* const s = g.log_scale + std::size_t{3} * row;
  return own * largest_share_left(vec3(s[0], s[1], s[2]), filter[row]);
}

/// Whether a Gaussian is alive: its largest visible opacity is above the least, and all its geometry is finite. No ray
/// meets a Gaussian that every view's filter makes too faint, so no gradient would bring it back.
GART_HD inline bool is_alive(gaussians_view<float const> const& g, index_t row, float least_opacity,
                             float const* filter) {
  bool alive = is_finite(g.opacity[row]) && opacity_shown(g, row, filter) > least_opacity;
  for (index_t c = 0; c < geometry_columns; ++c) alive = alive && is_finite(row_element(g, row, c));
  return alive;
}

namespace detail {

// Width: 0 where it is not known when compiled, which costs a division an element.
template <class Body, index_t Width>
struct row_kernel {
  static constexpr index_t rows_per_tile = 64;
  struct scratch {};
  Body body;
  index_t rows, given_width;

  GART_KERNEL void operator()(auto const& team) const {
    index_t const width = Width ? Width : given_width;
    index_t const first = team.tile() * rows_per_tile;
    index_t const count = rows - first < rows_per_tile ? rows - first : rows_per_tile;
    team.for_each(count * width, [&](index_t e) { body(first + e / width, e % width); });
  }
};

template <index_t Width, execution E, class Body>
void launch_rows(E& exec, char const* label, index_t rows, index_t width, Body const& body) {
  if (rows == 0) return;
  using kernel = row_kernel<Body, Width>;
  index_t const tiles = rows / kernel::rows_per_tile + (rows % kernel::rows_per_tile != 0);
  parallel_for(exec, label, tile_range{tiles, 256}, kernel{body, rows, width});
}

}  // namespace detail

///@{
/// Calls body(row, column) for every element of `rows` rows of `width`, a compile-time constant or not. Works on a tile
/// of rows at a time, so more than 2^32 elements are possible.
template <execution E, class Body>
void for_each_column(E& exec, char const* label, index_t rows, index_t width, Body const& body) {
  detail::launch_rows<0>(exec, label, rows, width, body);
}
template <index_t Width, execution E, class Body>
void for_each_column(E& exec, char const* label, index_t rows, Body const& body) {
  static_assert(Width > 0);
  detail::launch_rows<Width>(exec, label, rows, Width, body);
}
///@}
/// The same of Gaussians of that degree.
template <execution E, class Body>
void for_each_element(E& exec, char const* label, index_t rows, int sh_degree, Body const& body) {
  for_each_column(exec, label, rows, row_width(sh_degree), body);
}

namespace detail {

struct copy_row_body {
  gaussians_view<float> model;
  u32 const *from, *to;
  GART_KERNEL void operator()(index_t k, index_t column) const {
    row_element(model, to[k], column) = row_element(model, from[k], column);
  }
};

struct take_row_body {
  gaussians_view<float const> from;
  gaussians_view<float> to;
  u32 const* origin;
  GART_KERNEL void operator()(index_t row, index_t column) const {
    row_element(to, row, column) = row_element(from, origin[row], column);
  }
};

struct clear_moments_body {
  gaussians_view<float> first, second;
  u32 const* rows;
  row_owners owners;
  GART_KERNEL void operator()(index_t k, index_t column) const {
    if (!owners.owns(rows[k])) return;
    index_t const row = owners.local(rows[k]);
    row_element(first, row, column) = row_element(second, row, column) = 0;
  }
};

struct number_rows {
  u32* rows;
  u32 first;
  GART_KERNEL void operator()(index_t i) const { rows[i] = first + i; }
};

// The marked rows in order; place[i]: how many are before row i.
struct list_rows {
  u32 const* marked;
  u64 const* place;
  u32* rows;
  GART_KERNEL void operator()(index_t i) const {
    if (marked[i]) rows[place[i]] = i;
  }
};

}  // namespace detail

/// Sets Adam's moments of these Gaussians, by number, to zero, for those that are here.
template <execution E>
void clear_moments(E& exec, optimizer_state<E>& state, span<u32 const> rows, row_owners const& owners) {
  for_each_element(exec, "clear_moments", static_cast<index_t>(rows.size()), state.first.sh_degree(),
                   detail::clear_moments_body{state.first.view(), state.second.view(), rows.data(), owners});
}

/// The rows of a scene for densification: here all of them. sharded_rows (shard/sharded_rows.hpp) serves several ranks,
/// which call its members together.
template <execution E>
class all_rows {
 public:
  virtual ~all_rows() = default;
  virtual row_owners owners() const { return {}; }             ///< this rank has all
  virtual bool spread() const { return false; }                ///< whether other ranks have some
  virtual index_t total(index_t here) { return here; }         ///< Gaussians of the scene, of which `here` are here
  virtual index_t here(index_t total) const { return total; }  ///< Gaussians here among so many
  /// Gathers one element of each Gaussian, by number, from those of the rows here.
  virtual void gather(E&, buffer<u32, E>&) {}
  /// Copies Gaussian from[k] over to[k], by numbers; `from` and `to` have none in common.
  virtual void copy(E& exec, gaussians<E>& model, span<u32 const> from, span<u32 const> to) {
    for_each_element(exec, "copy_rows", static_cast<index_t>(from.size()), model.sh_degree(),
                     detail::copy_row_body{model.view(), from.data(), to.data()});
  }
  /// Copies Gaussian origin[g] of `from` to g of `to`, by numbers; `to` has as many as `origin`.
  virtual void take(E& exec, gaussians<E> const& from, gaussians<E>& to, span<u32 const> origin) {
    for_each_element(exec, "take_rows", static_cast<index_t>(origin.size()), from.sh_degree(),
                     detail::take_row_body{from.view(), to.view(), origin.data()});
  }
  /// Gathers `width` sums of each run of so many Gaussians, in host memory, from all ranks in order.
  virtual std::vector<double> sums_of_runs(std::vector<double> const& mine, index_t /*run*/, std::size_t /*width*/) {
    return mine;
  }
};

/// The rows of a single rank.
template <execution E>
all_rows<E>& whole_scene() {
  static all_rows<E> rows;
  return rows;
}

/// The report of a densification. Where the count changed, gradients and other per-Gaussian buffers have a new size.
struct density_change {
  index_t relocated = 0, added = 0, removed = 0;  ///< Gaussians
  /// Whether any Gaussian changed.
  bool any() const { return relocated || added || removed; }
};

}}  // namespace gart::GART_ISA
