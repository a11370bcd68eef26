#pragma once
/// \file
/// The hits of a table by Gaussian: sorted, and cut into pieces (channels/hit_pieces.hpp).
/// Memory: 8 bytes a hit and that of the pieces. Cost: a sort of 8 bytes a hit by the bits of a Gaussian's number.

#include <gart/algorithm/sort_pairs.hpp>
#include <gart/channels/channel.hpp>
#include <gart/channels/hit_pieces.hpp>

#include <bit>

namespace gart { inline namespace GART_ISA {

/// The order as kernels read it.
struct gaussian_order_view {
  static constexpr u32 piece_hits = 64;  ///< hits of a piece, at most
  u32 const* ids = nullptr;              ///< [hits], ascending
  u32 const* places = nullptr;           ///< [hits]: of the hits in the table
  u32 const* ends = nullptr;             ///< [Gaussians]: past the last hit, where there is one
  u64 const* offsets = nullptr;          ///< [Gaussians + 1]: first piece of each
  u32 const* firsts = nullptr;           ///< [pieces]: first hit
  index_t pieces = 0;                    ///< of all
  u32 hits = 0;                          ///< in all

  /// Past the last hit of a piece.
  GART_HD GART_INLINE u32 end_of(index_t piece) const {
    u32 const first = firsts[piece], end = ends[ids[first]];
    return end - first < piece_hits ? end : first + piece_hits;
  }
};

namespace channel_kernels {

// In this order a host's lane reads data that lie anywhere. So it prefetches them some hits ahead, in two steps. By
// place: prefetches what lies at a hit's place; by ray: what its ray has.
template <class ByPlace, class ByRay>
GART_HD GART_INLINE void ask_ahead([[maybe_unused]] gaussian_order_view const& order, [[maybe_unused]] u32 k,
                                   [[maybe_unused]] ByPlace const& by_place, [[maybe_unused]] ByRay const& by_ray) {
#if !defined(__CUDACC__)
  constexpr u32 near = 8, far = 16;
  if (k + far < order.hits) by_place(order.places[k + far]);
  if (k + near < order.hits) by_ray(order.places[k + near]);
#endif
}

struct number_hits {
  u32 const* ids;
  u32 *sorted, *places;
  GART_KERNEL void operator()(index_t k) const { sorted[k] = ids[k], places[k] = k; }
};

struct id_of_hit {
  u32 const* ids;
  GART_HD u32 operator()(index_t k) const { return ids[k]; }
};

}  // namespace channel_kernels

/// The order and its memory.
template <execution E>
class gaussian_order {
 public:
  /// Allocates nothing; `exec` must outlive it.
  explicit gaussian_order(E& exec) : ids_(exec), places_(exec), pieces_(exec) {}

  /// Of hits of so many Gaussians, by the Gaussian of each.
  void make(E& exec, span<u32 const> ids, index_t gaussians) {
    index_t const hits = static_cast<index_t>(ids.size());
    ids_.resize(hits), places_.resize(hits);
    parallel_for(exec, "channels/order", hits, channel_kernels::number_hits{ids.data(), ids_.data(), places_.data()});
    sort_pairs(exec, ids_.view(), places_.view(), static_cast<int>(std::bit_width(gaussians)));
    pieces_.cut(exec, "channels/order", channel_kernels::id_of_hit{ids_.data()}, hits, gaussians,
                gaussian_order_view::piece_hits);
  }
  /// For kernels.
  gaussian_order_view view() const {
    return {ids_.data(),
            places_.data(),
            pieces_.ends(),
            pieces_.offsets().data(),
            pieces_.firsts(),
            pieces_.count(),
            static_cast<u32>(ids_.size())};
  }

 private:
  buffer<u32, E> ids_, places_;
  hit_pieces<E> pieces_;
};

}}  // namespace gart::GART_ISA
