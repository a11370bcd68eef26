// A policy that is of a device by a flag alone.
// expects: e.multiprocessors()
#include <gart/exec/serial.hpp>

struct mine : gart::serial_exec {
  static constexpr bool device = true;
#ifdef GART_WHOLE
  int multiprocessors() const { return 1; }
#endif
};
static_assert(gart::device_execution<mine>);
