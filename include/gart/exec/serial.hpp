#pragma once
/// \file
/// One thread, in index order: the policy whose results repeat bit for bit.

#include <gart/exec/host_memory.hpp>

namespace gart::inline GART_ISA {

class serial_exec : public host_memory {
 public:
  static constexpr char const* name = "serial";
  static constexpr int threads() { return 1; }

  template <class T>
  static T atomic_add(T* p, T v) {
    T const old = *p;
    *p = old + v;
    return old;
  }
  template <class F>
  static void exclusively(void const* /*what*/, F&& f) {
    f();
  }
  template <int N>
  static void atomic_add_row(float* row, float const (&values)[N], int n) {
    for (int i = 0; i < n; ++i) row[i] += values[i];
  }
  static void fence() {}
};
static_assert(host_execution<serial_exec>);

}  // namespace gart::inline GART_ISA
