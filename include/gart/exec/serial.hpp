#pragma once
/// \file
/// One thread, in index order: the policy whose results repeat bit for bit.

#include <gart/exec/host_memory.hpp>

namespace gart { inline namespace GART_ISA {

/// A policy: one thread.
class serial_exec : public host_memory {
 public:
  static constexpr char const* name = "serial";  ///< of the policy
  /// One.
  static constexpr int threads() { return 1; }

  /// Adds v, returns the old value.
  template <class T>
  static T atomic_add(T* p, T v) {
    T const old = *p;
    *p = old + v;
    return old;
  }
  /// Calls f.
  template <class F>
  static void exclusively(void const* /*what*/, F&& f) {
    f();
  }
  /// row[0..n) += values.
  template <int N>
  static void atomic_add_row(float* row, float const (&values)[N], int n) {
    for (int i = 0; i < n; ++i) row[i] += values[i];
  }
  /// Nothing to wait for.
  static void fence() {}
};
static_assert(host_execution<serial_exec>);

}}  // namespace gart::GART_ISA
