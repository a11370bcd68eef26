#pragma once
/// \file
/// Sorts keys, ascending, by their low `key_bits` bits, and moves each value with its key. Stable: equal keys keep
/// their order, so every policy gives the same permutation.
///
/// keys: n of u32 or u64, sorted in place. values: n of u32, permuted in place. key_bits: 0 to the bits of a key. Each
/// 8 bits cost a pass, so pass no more than the keys use. Whole buffers may end in other memory, which saves a copy.
/// Memory: a second copy of keys and values, from the policy's workspace (hosts) or its pool (CUDA). Once the largest
/// size has been seen, nothing is allocated. n = 0 is legal. Errors: invalid_argument for key_bits or a short span.
/// Method: least significant digit radix sort, one histogram a block of the array, scattered digit by digit, block by
/// block. A pass whose digit is the same in all keys is skipped.

#include <gart/algorithm/exclusive_scan.hpp>
#include <gart/exec/buffer.hpp>

#include <array>
#include <utility>

namespace gart {

/// What keys may be.
template <class K>
concept sort_key = std::same_as<K, u32> || std::same_as<K, u64>;

/// Compiled into gart::cuda.
template <sort_key K>
void sort_pairs(cuda_exec& exec, span<K> keys, span<u32> values, int key_bits);
/// Compiled into gart::cuda.
template <device_execution E, sort_key K>
void sort_pairs(E& exec, buffer<K, E>& keys, buffer<u32, E>& values, int key_bits);

}  // namespace gart

namespace gart { inline namespace GART_ISA {

namespace detail {

inline void require_sort(std::size_t keys, std::size_t values, int key_bits, int max_bits) {
  require_size("sort_pairs", "values", values, keys);
  if (key_bits < 0 || key_bits > max_bits)
    throw invalid_argument("sort_pairs: `key_bits` is " + std::to_string(key_bits) + ", must be 0 to " +
                           std::to_string(max_bits) + ", the bits of a key");
}

}  // namespace detail

/// On a host.
template <host_execution E, sort_key K>
void sort_pairs(E& exec, span<K> keys, span<u32> values, int key_bits) {
  constexpr int digit_bits = 8;
  constexpr std::size_t digits = std::size_t{1} << digit_bits;
  using histogram = std::array<std::size_t, digits>;

  detail::require_sort(keys.size(), values.size(), key_bits, static_cast<int>(8 * sizeof(K)));
  std::size_t const n = keys.size();
  if (n < 2 || key_bits == 0) return;
  stage_scope scope(exec, "sort_pairs");

  std::size_t const blocks = detail::host_blocks(exec, n);
  auto* const bins =
      static_cast<histogram*>(exec.workspace(blocks * sizeof(histogram) + n * (sizeof(K) + sizeof(u32))));
  K *from = keys.data(), *to = reinterpret_cast<K*>(bins + blocks);
  u32 *from_values = values.data(), *to_values = reinterpret_cast<u32*>(to + n);

  for (int shift = 0; shift < key_bits; shift += digit_bits) {
    int const bits = key_bits - shift < digit_bits ? key_bits - shift : digit_bits;
    K const mask = (K{1} << bits) - 1;
    detail::for_blocks(exec, blocks, [=](std::size_t b) {
      histogram count{};
      for (std::size_t i = detail::block_begin(n, blocks, b); i < detail::block_begin(n, blocks, b + 1); ++i)
        ++count[(from[i] >> shift) & mask];
      bins[b] = count;
    });

    std::size_t offset = 0;
    bool one_digit = false;
    for (std::size_t d = 0; d < digits; ++d) {
      std::size_t const before = offset;
      for (std::size_t b = 0; b < blocks; ++b) offset += std::exchange(bins[b][d], offset);
      one_digit = one_digit || offset - before == n;
    }
    if (one_digit) continue;

    detail::for_blocks(exec, blocks, [=](std::size_t b) {
      histogram place = bins[b];
      for (std::size_t i = detail::block_begin(n, blocks, b); i < detail::block_begin(n, blocks, b + 1); ++i) {
        std::size_t const slot = place[(from[i] >> shift) & mask]++;
        to[slot] = from[i];
        to_values[slot] = from_values[i];
      }
    });
    std::swap(from, to);
    std::swap(from_values, to_values);
  }
  if (from != keys.data()) {
    exec.copy(keys.data(), from, n * sizeof(K));
    exec.copy(values.data(), from_values, n * sizeof(u32));
  }
}
/// The same of whole buffers.
template <host_execution E, sort_key K>
void sort_pairs(E& exec, buffer<K, E>& keys, buffer<u32, E>& values, int key_bits) {
  sort_pairs(exec, keys.view(), values.view(), key_bits);
}

}}  // namespace gart::GART_ISA
