// expects: C::form
#include <gart/backward/gather_form.hpp>
#include <gart/exec/serial.hpp>

struct half_colors {
  using policy = gart::serial_exec;
  using response = gart::generalized_gaussian<>;
  using terms = gart::terms<gart::term::color>;
  using entry = gart::half_hit_entry;
  using rays = gart::pixel_rays;
  static constexpr int sh_degree = 1, tile_size = 8;
  static constexpr gart::gather_sums sums = gart::gather_sums::atomic;
  static constexpr gart::slot_validity validity = gart::slot_validity::cleared;
#ifdef GART_WHOLE
  static constexpr gart::kernel_form form = gart::kernel_form::packet;
#endif
};
gart::gather_of<half_colors>* gather = nullptr;
