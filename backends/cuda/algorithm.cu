// The algorithms on cuda_exec. The one translation unit that includes CUB.
// Scratch is stream-ordered memory of the policy's pool: no waiting, and other buffers may have it between calls.

#include <gart/algorithm/exclusive_scan.hpp>
#include <gart/algorithm/reduce.hpp>
#include <gart/algorithm/segmented_reduce.hpp>
#include <gart/algorithm/sort_pairs.hpp>
#include <gart/exec/buffer.hpp>
#include <gart/exec/cuda_launch.cuh>

#include "check.hpp"

#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_reduce.cuh>
#include <cub/device/device_scan.cuh>

namespace gart {

namespace {

// CUB's two-step protocol: `call` with no memory says how much it wants. `call` must take the same sizes both times.
template <class F>
void run_cub(cuda_exec& exec, char const* label, F const& call) {
  exec.make_current();
  std::size_t bytes = 0;
  detail::check_cuda(call(nullptr, bytes), label);
  buffer<unsigned char, cuda_exec> memory(exec, std::max<std::size_t>(bytes, 1));
  detail::check_cuda(call(memory.data(), bytes), label);
  exec.check_launch(label);
}

template <class T>
struct add_last {
  u32 const* last_in;
  T const* last_out;
  T* total;
  GART_KERNEL void operator()(index_t) const { *total = *last_out + *last_in; }
};

}  // namespace

template <scan_sum T>
void exclusive_scan(cuda_exec& exec, span<u32 const> in, span<T> out, span<std::type_identity_t<T>> total) {
  detail::require_size("exclusive_scan", "out", out.size(), in.size());
  u64 const n = in.size();
  if (n == 0) {
    if (!total.empty()) exec.zero(total.data(), sizeof(T));
    return;
  }
  stage_scope scope(exec, "exclusive_scan");
  run_cub(exec, "exclusive_scan", [&](void* memory, std::size_t& bytes) {
    return cub::DeviceScan::ExclusiveScan(memory, bytes, in.data(), out.data(), ::cuda::std::plus<>{}, T{0}, n,
                                          static_cast<cudaStream_t>(exec.stream()));
  });
  if (!total.empty()) parallel_for(exec, "exclusive_scan total", 1, add_last<T>{&in[n - 1], &out[n - 1], total.data()});
}
template void exclusive_scan<u32>(cuda_exec&, span<u32 const>, span<u32>, span<u32>);
template void exclusive_scan<u64>(cuda_exec&, span<u32 const>, span<u64>, span<u64>);

namespace {

// place(whether the sorted keys lie in the other memory, that memory; the same of the values)
template <class K, class F>
void sort_into(cuda_exec& exec, span<K> keys, span<u32> values, int key_bits, F const& place) {
  detail::require_sort(keys.size(), values.size(), key_bits, static_cast<int>(8 * sizeof(K)));
  u64 const n = keys.size();
  if (n < 2 || key_bits == 0) return;
  stage_scope scope(exec, "sort_pairs");
  buffer<K, cuda_exec> other_keys(exec, n);
  buffer<u32, cuda_exec> other_values(exec, values.size());
  cub::DoubleBuffer<K> key_pair(keys.data(), other_keys.data());
  cub::DoubleBuffer<u32> value_pair(values.data(), other_values.data());
  run_cub(exec, "sort_pairs", [&](void* memory, std::size_t& bytes) {
    return cub::DeviceRadixSort::SortPairs(memory, bytes, key_pair, value_pair, n, 0, key_bits,
                                           static_cast<cudaStream_t>(exec.stream()));
  });
  place(key_pair.Current() != keys.data(), other_keys, value_pair.Current() != values.data(), other_values);
}

}  // namespace

template <sort_key K>
void sort_pairs(cuda_exec& exec, span<K> keys, span<u32> values, int key_bits) {
  sort_into(exec, keys, values, key_bits, [&](bool moved, auto& other_keys, bool values_moved, auto& other_values) {
    if (moved) exec.copy(keys.data(), other_keys.data(), keys.size() * sizeof(K));
    if (values_moved) exec.copy(values.data(), other_values.data(), keys.size() * sizeof(u32));
  });
}
template <device_execution E, sort_key K>
void sort_pairs(E& exec, buffer<K, E>& keys, buffer<u32, E>& values, int key_bits) {
  if (values.size() != keys.size()) return sort_pairs(exec, keys.view(), values.view(), key_bits);
  sort_into(exec, keys.view(), values.view(), key_bits,
            [&](bool moved, auto& other_keys, bool values_moved, auto& other_values) {
              if (moved) std::swap(keys, other_keys);
              if (values_moved) std::swap(values, other_values);
            });
}
template void sort_pairs<u32>(cuda_exec&, span<u32>, span<u32>, int);
template void sort_pairs<u64>(cuda_exec&, span<u64>, span<u32>, int);
template void sort_pairs<cuda_exec, u32>(cuda_exec&, buffer<u32, cuda_exec>&, buffer<u32, cuda_exec>&, int);
template void sort_pairs<cuda_exec, u64>(cuda_exec&, buffer<u64, cuda_exec>&, buffer<u32, cuda_exec>&, int);

template <reducible T>
void reduce(cuda_exec& exec, span<std::type_identity_t<T> const> in, span<T> out, reduction op) {
  detail::require_size("reduce", "out", out.size(), 1);
  stage_scope scope(exec, "reduce");
  auto const run = [&](auto neutral, auto combine) {
    run_cub(exec, "reduce", [&](void* memory, std::size_t& bytes) {
      return cub::DeviceReduce::Reduce(memory, bytes, in.data(), out.data(), static_cast<u64>(in.size()), combine,
                                       neutral, static_cast<cudaStream_t>(exec.stream()));
    });
  };
  switch (op) {
    case reduction::sum:
      return run(detail::sum_of<T>{0}, ::cuda::std::plus<>{});
    case reduction::min:
      return run(detail::neutral_of_min<T>(), detail::lesser{});
    case reduction::max:
      return run(detail::neutral_of_max<T>(), detail::greater{});
  }
}
template void reduce<float>(cuda_exec&, span<float const>, span<float>, reduction);
template void reduce<double>(cuda_exec&, span<double const>, span<double>, reduction);
template void reduce<u32>(cuda_exec&, span<u32 const>, span<u32>, reduction);
template void reduce<u64>(cuda_exec&, span<u64 const>, span<u64>, reduction);

void segmented_reduce(cuda_exec& exec, span<float const> rows, u32 columns, span<u32 const> offsets, span<float> sums) {
  detail::segmented_reduce(exec, rows, columns, offsets, sums);
}
void segmented_reduce(cuda_exec& exec, span<float const> rows, u32 columns, span<u64 const> offsets, span<float> sums) {
  detail::segmented_reduce(exec, rows, columns, offsets, sums);
}

}  // namespace gart
