#pragma once
/// \file
/// The execution policy: a queue on which kernels run, and the memory they run in.
///
/// A policy is the first argument of everything that computes. It offers
///   static constexpr char const* name;   "serial", "openmp", "cuda"
///   static constexpr bool device;        memory is not the host's
///   static constexpr kernel_form form;   which form it runs of a kernel that has several
///   void* allocate(bytes); void deallocate(void*, bytes);      stream-ordered; throws out_of_memory
///   void copy_in(dst, host_src, bytes); void copy_out(host_dst, src, bytes);
///   void copy(dst, src, bytes); void zero(p, bytes);
///   void fill(p, byte, bytes);                                 every byte set to one value
///   void synchronize();
///   void begin_stage(label); void end_stage();                 brackets of a timed stage, nested (see stage.hpp)
///   template <class T> static T atomic_add(T*, T);             in kernels: returns the old value
///   template <int N> static void atomic_add_row(float* row, float const (&values)[N], int n);
///       in kernels: row[0..n) += values as one row. Values past n are zero. A row of a multiple of 4 floats is aligned
///       to 16 bytes, and no other function adds to it in the same launch
///   static void fence();                   in kernels: what was written before is seen by who sees what comes after
///   profiler profile; memory_use memory;
///   std::size_t free_bytes();              memory that can still be had; 0: not known
/// A policy whose memory is the host's (host_execution) also offers what algorithms and kernels of hosts ask for:
///   void* workspace(bytes);                a block lent to the algorithm that runs; the next call lends it again
///   int threads();                         how many an algorithm may split an array over
///   template <class F> static void exclusively(void const* what, F f);
///       in kernels: calls f while no other thread is in a call for the same `what`. f itself makes no such call
/// and one of a device (device_execution)
///   int multiprocessors();                 by which kernels that stay on the device are launched
/// A policy whose host may run ahead of it also offers begin_copy_out and end_copy_out (exec/early_copy.hpp).
/// copy_out waits for the data; all else is ordered on the queue. The source of copy_in may be reused on return.
/// end_stage never throws, because it runs in a destructor.
///
/// Kernels are named, trivially copyable functors. An index kernel has void operator()(index_t). A tile kernel names
/// `using scratch = struct {...}` and takes a team (see parallel.hpp). Their bodies are GART_KERNEL (core/macros.hpp).

#include <gart/core/types.hpp>
#include <gart/exec/profile.hpp>

#include <concepts>
#include <type_traits>

namespace gart {

/// The forms of a kernel that has several. The plain one is right everywhere and runs one lane after another. Another
/// has its lanes in a host's vector registers (math/lanes.hpp). The third has the lanes of a warp, which step together
/// and share its matrix units.
enum class kernel_form { plain, packet, warp };

/// A policy.
template <class E>
concept execution = requires(E& e, void* p, void const* q, std::size_t n, float* f, float const (&row)[4], u32* words,
                             u64* counts) {
  { E::name } -> std::convertible_to<char const*>;
  { E::device } -> std::convertible_to<bool>;
  { E::form } -> std::convertible_to<kernel_form>;
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
  { E::atomic_add(words, u32{1}) } -> std::same_as<u32>;
  { E::atomic_add(counts, u64{1}) } -> std::same_as<u64>;
  E::atomic_add_row(f, row, 4);
  E::fence();
  { e.profile } -> std::convertible_to<profiler&>;
  { e.memory } -> std::convertible_to<memory_use&>;
  { e.free_bytes() } -> std::convertible_to<std::size_t>;
};

/// A policy whose memory is the host's.
template <class E>
concept host_execution = execution<E> && !E::device && requires(E & e, void const* what, std::size_t n, void (&f)()) {
  { e.workspace(n) } -> std::same_as<void*>;
  { e.threads() } -> std::convertible_to<int>;
  E::exclusively(what, f);
};

/// A policy of a device.
template <class E>
concept device_execution = execution<E> && E::device && requires(E& e) {
  { e.multiprocessors() } -> std::convertible_to<int>;
};

/// A kernel over tiles.
template <class K>
concept tile_kernel = std::is_trivially_copyable_v<K> && requires {
  typename K::scratch;
};

/// A kernel over indices.
template <class K>
concept index_kernel = std::is_trivially_copyable_v<K> && !tile_kernel<K> && requires(K const& k, index_t i) {
  k(i);
};

/// Runs `tiles` teams. On a device each has at most `lanes` lanes, a hint and a multiple of 32 (cuda_launch.cuh has the
/// limits). On a host it has one.
struct tile_range {
  index_t tiles = 0;   ///< teams
  index_t lanes = 64;  ///< of a team, at most
};

}  // namespace gart
