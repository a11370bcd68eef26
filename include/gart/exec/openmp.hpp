#pragma once
// All cores through OpenMP. Built without OpenMP it runs on one thread.

#include <gart/exec/host_memory.hpp>

#include <atomic>
#if defined(_OPENMP)
#include <omp.h>
#endif

namespace gart {

class openmp_exec : public host_memory {
 public:
  static constexpr char const* name = "openmp";

  // threads = 0: as many as OpenMP gives (OMP_NUM_THREADS, or the cores).
  explicit openmp_exec(int threads = 0) : threads_(threads > 0 ? threads : default_threads()) {}
  int threads() const { return threads_; }

  template <class T>
  static T atomic_add(T* p, T v) {
    return std::atomic_ref<T>(*p).fetch_add(v, std::memory_order_relaxed);
  }

 private:
  static int default_threads() {
#if defined(_OPENMP)
    return omp_get_max_threads();
#else
    return 1;
#endif
  }
  int threads_;
};

}  // namespace gart
