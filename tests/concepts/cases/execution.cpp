// expects: E::fence()
#include <gart/exec/host_memory.hpp>

struct mine : gart::host_memory {
  static constexpr char const* name = "mine";
  static int threads() { return 1; }
  template <class T>
  static T atomic_add(T* p, T v) {
    T const old = *p;
    *p = old + v;
    return old;
  }
  template <int N>
  static void atomic_add_row(float* row, float const (&values)[N], int n) {
    for (int i = 0; i < n; ++i) row[i] += values[i];
  }
#ifdef GART_WHOLE
  static void fence() {}
#endif
  template <class F>
  static void exclusively(void const*, F&& f) {
    f();
  }
};
static_assert(gart::host_execution<mine>);
