#pragma once
/// \file
/// All cores through OpenMP. Built without OpenMP it runs on one thread.

#include <gart/exec/host_memory.hpp>

#include <algorithm>
#include <atomic>
#if defined(_OPENMP)
#include <omp.h>
#endif

namespace gart { inline namespace GART_ISA {

/// A policy: all cores.
class openmp_exec : public host_memory {
 public:
  static constexpr char const* name = "openmp";  ///< of the policy

  /// threads = 0: as many as OpenMP gives (OMP_NUM_THREADS, or the cores).
  explicit openmp_exec(int threads = 0) : threads_(threads > 0 ? threads : default_threads()) {}
  /// How many threads it runs on.
  int threads() const { return threads_; }

  ///@{
  /// As of host_memory. Large blocks are shared out among the threads: one core uses a part of the memory's bandwidth.
  void copy_in(void* dst, void const* src, std::size_t bytes) { copy(dst, src, bytes); }
  void copy_out(void* dst, void const* src, std::size_t bytes) { copy(dst, src, bytes); }
  void copy(void* dst, void const* src, std::size_t bytes) {
    in_parts(bytes, [=](std::size_t from, std::size_t n) {
      std::memcpy(static_cast<char*>(dst) + from, static_cast<char const*>(src) + from, n);
    });
  }
  void zero(void* p, std::size_t bytes) { fill(p, 0, bytes); }
  void fill(void* p, unsigned char byte, std::size_t bytes) {
    in_parts(bytes, [=](std::size_t from, std::size_t n) { std::memset(static_cast<char*>(p) + from, byte, n); });
  }
  ///@}

  /// Adds v, returns the old value.
  template <class T>
  static T atomic_add(T* p, T v) {
#if defined(__cpp_lib_atomic_ref)
    return std::atomic_ref<T>(*p).fetch_add(v, std::memory_order_relaxed);
#else  // libc++ before 19
    T old = *p, sum = old + v;
    while (!__atomic_compare_exchange(p, &old, &sum, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) sum = old + v;
    return old;
#endif
  }
  /// Calls f while no other thread is in a call for the same `what`. One lock from a striped table. x86 has no atomic
  /// float add. A compare-and-swap for each of tens of floats costs more than the rest of a hit.
  template <class F>
  static void exclusively(void const* what, F&& f) {
    auto& lock = row_locks[(reinterpret_cast<std::uintptr_t>(what) >> 4) * 0x9E3779B97F4A7C15ull >> 52];
    while (lock.test_and_set(std::memory_order_acquire)) {
    }
    f();
    lock.clear(std::memory_order_release);
  }
  /// row[0..n) += values, as one row.
  template <int N>
  static void atomic_add_row(float* row, float const (&values)[N], int n) {
    exclusively(row, [&] {
      for (int i = 0; i < n; ++i) row[i] += values[i];
    });
  }
  /// A thread that sees a later write sees all earlier ones.
  static void fence() { std::atomic_thread_fence(std::memory_order_seq_cst); }

 private:
  // f(first, n) for parts of so many bytes, on all threads.
  template <class F>
  void in_parts(std::size_t bytes, F const& f) const {
    constexpr std::size_t part = std::size_t{1} << 20;
#if defined(_OPENMP)
#pragma omp parallel for schedule(static) num_threads(threads_) if (bytes > part)
#endif
    for (std::size_t from = 0; from < bytes; from += part) f(from, std::min(part, bytes - from));
  }

  static inline std::atomic_flag row_locks[4096];
  static int default_threads() {
#if defined(_OPENMP)
    return omp_get_max_threads();
#else
    return 1;
#endif
  }
  int threads_;
};
static_assert(host_execution<openmp_exec>);

}}  // namespace gart::GART_ISA
