#pragma once
// The execution policy: a queue on which kernels run, and the memory they run in.
//
// A policy is the first argument of everything that computes. It offers
//   static constexpr char const* name;   "serial", "openmp", "cuda"
//   static constexpr bool device;        memory is not the host's
//   void* allocate(bytes); void deallocate(void*, bytes);      stream-ordered; throws out_of_memory
//   void copy_in(dst, host_src, bytes); void copy_out(host_dst, src, bytes);
//   void copy(dst, src, bytes); void zero(p, bytes);
//   void fill(p, byte, bytes);                                 every byte set to one value
//   void synchronize();
//   void begin_stage(label); void end_stage();                 brackets of a timed stage, nested (see stage.hpp)
//   template <class T> static T atomic_add(T*, T);             in kernels: returns the old value
//   template <int N> static void atomic_add_row(float* row, float const (&values)[N], int n);
//       in kernels: row[0..n) += values as one row; values past n are zero; a row of a multiple of 4 floats is aligned
//       to 16 bytes, and no other function adds to it in the same launch
//   template <class F> static void exclusively(void const* what, F f);
//       in kernels, of host policies: calls f while no other thread is in a call for the same `what`; in f there
//       is no call of it
//   static void fence();                   in kernels: what was written before is seen by who sees what comes after
//   profiler profile; memory_use memory;
// copy_out waits for the data; all else is ordered on the queue. The source of copy_in may be reused on return.
// end_stage never throws, because it runs in a destructor.
//
// Kernels are named, trivially copyable functors: void operator()(index_t) for an index kernel; a tile kernel names
// `using scratch = struct {...}` and takes a team (see parallel.hpp).

#include <gart/core/types.hpp>
#include <gart/exec/profile.hpp>

#include <concepts>
#include <type_traits>

namespace gart {

template <class E>
concept execution = requires(E& e, void* p, void const* q, std::size_t n, float* f) {
  { E::name } -> std::convertible_to<char const*>;
  { E::device } -> std::convertible_to<bool>;
  { e.allocate(n) } -> std::same_as<void*>;
  e.deallocate(p, n);
  e.copy_in(p, q, n);
  e.copy_out(p, q, n);
  e.copy(p, q, n);
  e.zero(p, n);
  e.fill(p, static_cast<unsigned char>(0), n);
  e.synchronize();
  e.begin_stage("");
  e.end_stage();
  { E::atomic_add(f, 1.0f) } -> std::same_as<float>;
  { e.profile } -> std::convertible_to<profiler&>;
  { e.memory } -> std::convertible_to<memory_use&>;
};

template <class E>
concept host_execution = execution<E> && !E::device;

template <class K>
concept tile_kernel = std::is_trivially_copyable_v<K> && requires {
  typename K::scratch;
};

template <class K>
concept index_kernel = std::is_trivially_copyable_v<K> && !tile_kernel<K> && requires(K const& k, index_t i) {
  k(i);
};

// `tiles` teams; each has at most `lanes` lanes on a device (a hint, a multiple of 32; see cuda_launch.cuh for the most
// that a kernel accepts) and one on a host.
struct tile_range {
  index_t tiles = 0;
  index_t lanes = 64;
};

}  // namespace gart
