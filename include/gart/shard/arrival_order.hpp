#pragma once
/// \file
/// For rows that arrived from all ranks: the position of each, in the order of the Gaussians' numbers. Rows arrive by
/// rank, and from each rank by number. Each block of numbers (comm/row_owners.hpp) is one run; runs are put in the
/// order of their blocks. Three launches and a scan over blocks; 12 bytes a block.

#include <gart/algorithm/exclusive_scan.hpp>
#include <gart/comm/row_owners.hpp>
#include <gart/exec/buffer.hpp>
#include <gart/shard/row_exchange_kernels.hpp>

namespace gart { inline namespace GART_ISA {

namespace detail {

// The first and past-the-last places of each block's run; both are zero where no row of a block arrived.
struct runs_kernel {
  float const* in;
  index_t count, block;
  u32 *first, *past;
  GART_KERNEL void operator()(index_t k) const {
    u32 const mine = block_of(k);
    if (k == 0 || block_of(k - 1) != mine) first[mine] = k;
    if (k + 1 == count || block_of(k + 1) != mine) past[mine] = k + 1;
  }
  GART_HD u32 block_of(index_t k) const {
    return float_to_bits(in[std::size_t{k} * placing_width + placing_columns]) / block;
  }
};

struct run_lengths_kernel {
  u32 const *first, *past;
  u32* lengths;
  GART_KERNEL void operator()(index_t b) const { lengths[b] = past[b] - first[b]; }
};

// Puts runs in the order of their blocks.
struct run_order_kernel {
  runs_kernel runs;
  u64 const* begin;  // of each block's run, in block order
  u32* order;
  GART_KERNEL void operator()(index_t k) const {
    u32 const mine = runs.block_of(k);
    order[begin[mine] + (k - runs.first[mine])] = k;
  }
};

}  // namespace detail

/// Finds the order, and keeps it.
template <execution E>
class arrival_order {
 public:
  /// No rows yet.
  explicit arrival_order(E& exec) : exec_(&exec), order_(exec), runs_(exec) {}

  /// Finds the order of `n` rows of placing_width floats at `in`. Other ranks have at most a block more rows than this
  /// one. `begin` is memory for a scan.
  void find(float const* in, index_t n, index_t rows, row_owners const& owners, buffer<u64, E>& begin) {
    order_.resize(n);
    std::size_t const mine = (u64{rows} + owners.block - 1) / owners.block + 1,
                      blocks = mine * static_cast<std::size_t>(owners.ranks);
    runs_.resize(3 * blocks), begin.resize(blocks);
    runs_.zero();
    u32 *const first = runs_.data(), *const past = first + blocks, *const lengths = past + blocks;
    detail::runs_kernel const runs{in, n, owners.block, first, past};
    parallel_for(*exec_, "exchange/order", n, runs);
    parallel_for(*exec_, "exchange/order", static_cast<index_t>(blocks),
                 detail::run_lengths_kernel{first, past, lengths});
    exclusive_scan(*exec_, span<u32 const>(lengths, blocks), begin.view());
    parallel_for(*exec_, "exchange/order", n, detail::run_order_kernel{runs, begin.data(), order_.data()});
  }

  /// The positions, [rows], until the next find.
  u32 const* data() const { return order_.data(); }

 private:
  E* exec_;
  buffer<u32, E> order_, runs_;
};

}}  // namespace gart::GART_ISA
