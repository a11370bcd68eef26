#pragma once
/// \file
/// Which rank has which Gaussian: by blocks of numbers, dealt out in turn. Gaussian number g (64 bits in the scene, 32
/// in a rank's own rows) lies in block g / block. Its rank is g / block % ranks, its row
///   g / block / ranks * block + g % block
/// there. So rows of a rank are in the order of their numbers. Gaussians appended to the scene are appended to the
/// ranks' arrays. Growth balances itself, and nothing is ever dealt out anew.

#include <gart/core/macros.hpp>
#include <gart/core/types.hpp>

namespace gart {

/// Which rows one rank owns. By default it is the only rank and owns all.
struct row_owners {
  static constexpr index_t default_block = 4096;  ///< rows
  int ranks = 1, rank = 0;                        ///< in all, and which one this is
  index_t block = default_block;                  ///< rows that stay together

  /// The owner of Gaussian g.
  GART_HD constexpr int owner(u64 g) const { return static_cast<int>(g / block % static_cast<u64>(ranks)); }
  /// Whether this rank has it.
  GART_HD constexpr bool owns(u64 g) const { return ranks == 1 || owner(g) == rank; }
  /// Its row there.
  GART_HD constexpr index_t local(u64 g) const {
    return static_cast<index_t>(ranks == 1 ? g : g / block / static_cast<u64>(ranks) * block + g % block);
  }
  /// The number of a row of this rank's.
  GART_HD constexpr u64 global(index_t row) const {
    return ranks == 1 ? u64{row}
                      : (u64{row / block} * static_cast<u64>(ranks) + static_cast<u64>(rank)) * block + row % block;
  }
  /// How many of the first `total` Gaussians rank r has.
  GART_HD constexpr index_t owned(u64 total, int r) const {
    u64 const blocks = total / block, rest = total % block, turn = blocks % static_cast<u64>(ranks);
    u64 const whole = blocks / static_cast<u64>(ranks) + (static_cast<u64>(r) < turn);
    return static_cast<index_t>(whole * block + (static_cast<u64>(r) == turn ? rest : 0));
  }
  /// How many of them this rank has.
  GART_HD constexpr index_t owned(u64 total) const { return owned(total, rank); }
  /// f(number of the first, how many, first row) for each run of numbers that this rank has, of `total`.
  template <class F>
  constexpr void for_each_run(u64 total, F const& f) const {
    if (ranks == 1) {
      if (total != 0) f(u64{0}, total, u64{0});
      return;
    }
    u64 const step = u64{block} * static_cast<u64>(ranks);
    for (u64 first = u64{block} * static_cast<u64>(rank), row = 0; first < total; first += step, row += block)
      f(first, total - first < block ? total - first : u64{block}, row);
  }
};

}  // namespace gart
