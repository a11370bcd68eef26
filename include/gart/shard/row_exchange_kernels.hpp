#pragma once
/// \file
/// The kernels of row_exchange.hpp.

#include <gart/backward/gather.hpp>
#include <gart/optim/rows.hpp>
#include <gart/shard/row_selection.hpp>

#include <type_traits>

namespace gart { inline namespace GART_ISA { namespace detail {

// A row travels in two parts: geometry, with the Gaussian's number last, and colours. A rank makes its lists from the
// first while the second is under way.
inline constexpr index_t placing_columns = geometry_columns + 1, placing_width = placing_columns + 1;
static_assert(placing_width % 4 == 0);
// Floats of the colours in a message.
constexpr index_t colors_width(index_t coefficients) { return (coefficients + 3) / 4 * 4; }

// Where the k-th leaving row is written, of `Width` T: those that stay here, to where they arrive.
template <class T, index_t Width>
struct way_out {
  T *out, *in;
  u64 first, count, arrive;  // rows that stay: the first in the list, how many, where the first arrives
  GART_HD T* row(u64 k) const { return k - first < count ? in + (arrive + (k - first)) * Width : out + k * Width; }
};

// Rows, four columns a lane: with single ones the loads in flight limit it, not the bandwidth.
struct pack_placing_body {
  gaussians_view<float const> scene;
  row_owners owners;
  u32 const* list;
  way_out<float, placing_width> to;
  GART_KERNEL void operator()(index_t k, index_t four) const {
    index_t const row = list[k];
    quad values;
    for (index_t c = 0; c < 4; ++c) {
      index_t const column = 4 * four + c;
      values.v[c] = column < placing_columns ? row_element(scene, row, column)
                                             : bits_to_float(static_cast<u32>(owners.global(row)));
    }
    *reinterpret_cast<quad*>(to.row(k) + 4 * four) = values;
  }
};

template <index_t Coefficients>
struct pack_colors_body {
  float const* sh;
  u32 const* list;
  way_out<float, colors_width(Coefficients)> to;
  GART_KERNEL void operator()(index_t k, index_t four) const {
    float const* const from = sh + std::size_t{list[k]} * Coefficients;
    quad values;
    for (index_t c = 0; c < 4; ++c) values.v[c] = 4 * four + c < Coefficients ? from[4 * four + c] : 0.0f;
    *reinterpret_cast<quad*>(to.row(k) + 4 * four) = values;
  }
};

struct unpack_placing_body {
  gaussians_view<float> scene;
  float const* in;
  u32 const* order;
  GART_KERNEL void operator()(index_t k, index_t four) const {
    auto const from = *reinterpret_cast<quad const*>(in + std::size_t{order[k]} * placing_width + 4 * four);
    for (index_t c = 0; c < 4 && 4 * four + c < placing_columns; ++c) row_element(scene, k, 4 * four + c) = from.v[c];
  }
};

template <index_t Coefficients>
struct unpack_colors_body {
  float* sh;
  float const* in;
  u32 const* order;
  GART_KERNEL void operator()(index_t k, index_t four) const {
    auto const from =
        *reinterpret_cast<quad const*>(in + std::size_t{order[k]} * colors_width(Coefficients) + 4 * four);
    for (index_t c = 0; c < 4 && 4 * four + c < Coefficients; ++c)
      sh[std::size_t{k} * Coefficients + 4 * four + c] = from.v[c];
  }
};

struct single {
  float v[1];
};

// A Gaussian's sums, in pieces of four floats where both widths are multiples of four. In pairs colour gradients come
// first, then moments.
template <index_t Coefficients>
struct sums_layout {
  static constexpr index_t lane = Coefficients % 4 == 0 && moment_stride % 4 == 0 ? 4 : 1;  // floats of a piece
  using piece = std::conditional_t<lane == 4, quad, single>;
  static constexpr index_t coefficients = Coefficients / lane, moments = moment_stride / lane,
                           width = coefficients + moments;  // in pieces
  static piece const* pieces(float const* p) { return reinterpret_cast<piece const*>(p); }
  static piece* pieces(float* p) { return reinterpret_cast<piece*>(p); }
};

// Either kind of sums, `Width` pieces a row.
template <class Piece, index_t Width>
struct pack_sums_body {
  Piece const* sums;
  u32 const* order;
  way_out<Piece, Width> to;
  GART_KERNEL void operator()(index_t k, index_t column) const {
    to.row(order[k])[column] = sums[std::size_t{k} * Width + column];
  }
};

// Finished gradients of geometry, instead of moments. They are a row's columns, the error in its place among moments,
// and last the opacity's gradient.
static_assert(error_place == geometry_columns && moment_stride == geometry_columns + 2);

// A row's k-th finished gradient: an element of `gradients`, or of `errors`.
template <class T>
GART_HD T& finished_element(gaussians_view<T> gradients, T* errors, index_t row, index_t k) {
  return k < geometry_columns ? row_element(gradients, row, k)
         : k == error_place   ? errors[row]
                              : gradients.opacity[row];
}

struct pack_finished_body {
  gaussians_view<float const> gradients;
  float const* moments;
  u32 const* order;
  way_out<float, moment_stride> to;
  GART_KERNEL void operator()(index_t k, index_t four) const {
    quad values;
    for (index_t c = 0; c < 4; ++c) {
      index_t const place = 4 * four + c;
      values.v[c] = place == error_place ? moments[std::size_t{k} * moment_stride + error_place]
                                         : finished_element<float const>(gradients, nullptr, k, place);
    }
    *reinterpret_cast<quad*>(to.row(order[k]) + 4 * four) = values;
  }
};

// The arrival position of the row.
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

// One kind of a row's sums, `Width` pieces, which begin at `From` in pairs. They are added over views and over the
// ranks that traced a view, in order, or pair by pair. Rows that no unit had are zero. Take receives take(row, first
// float of the piece, piece).
template <index_t Coefficients, index_t From, index_t Width, class Take>
struct add_sums_body {
  using layout = sums_layout<Coefficients>;
  using piece = typename layout::piece;
  returned_unit const* units;
  index_t count;
  piece const* in;
  u64 const* places;  // places of each row's pairs; null where sums have no fixed order
  u32 const* pairs;
  piece const* pairs_in;
  piece const* before;  // added to, or null
  float share;          // factor of the sum
  Take take;
  GART_KERNEL void operator()(index_t row, index_t column) const {
    piece total = before ? before[std::size_t{row} * Width + column] : piece{}, view{};
    auto const add = [](piece& sum, piece const& x) {
      for (index_t c = 0; c < layout::lane; ++c) sum.v[c] += x.v[c];
    };
    for (index_t u = 0; u < count; ++u) {
      if (u > 0 && units[u].view != units[u - 1].view) add(total, view), view = {};
      u32 const place = units[u].place_of[row];
      if (place == not_sent) continue;
      u64 const k = units[u].first + place;
      if (!places || pairs[k] == 0)
        add(view, in[k * Width + column]);
      else
        for (u32 p = 0; p < pairs[k]; ++p) add(view, pairs_in[(places[k] + p) * layout::width + From + column]);
    }
    add(total, view);
    for (index_t c = 0; c < layout::lane; ++c) total.v[c] *= share;
    take(row, column * layout::lane, total);
  }
};

// Writes the sums to [rows][floats].
struct keep_sums {
  float* out;
  index_t floats;  // a row
  GART_KERNEL void operator()(index_t row, index_t first, auto const& sum) const {
    *reinterpret_cast<std::remove_cvref_t<decltype(sum)>*>(out + std::size_t{row} * floats + first) = sum;
  }
};

// Packs finished gradients of a row, four places a lane. Each is the sum over units, each a whole view, times the
// share. Errors are not scaled, and are added one by one, in the order of rounds.
struct add_finished_body {
  returned_unit const* units;
  index_t count;
  float const* in;
  gaussians_view<float> gradients;
  float* errors;  // null where not needed
  bool adds;      // to the gradients that are there
  float share;
  GART_KERNEL void operator()(index_t row, index_t four) const {
    quad total{};
    for (index_t c = 0; c < 4; ++c)
      if (index_t const place = 4 * four + c; place == error_place ? errors != nullptr : adds)
        total.v[c] = finished_element(gradients, errors, row, place);
    for (index_t u = 0; u < count; ++u) {
      u32 const place = units[u].place_of[row];
      if (place == not_sent) continue;
      auto const one = *reinterpret_cast<quad const*>(in + (units[u].first + place) * moment_stride + 4 * four);
      for (index_t c = 0; c < 4; ++c) total.v[c] += one.v[c];
    }
    for (index_t c = 0; c < 4; ++c) {
      index_t const place = 4 * four + c;
      if (place != error_place)
        finished_element(gradients, errors, row, place) = total.v[c] * share;
      else if (errors)
        errors[row] = total.v[c];
    }
  }
};

}}}  // namespace gart::GART_ISA::detail
