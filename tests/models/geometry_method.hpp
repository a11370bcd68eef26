#pragma once
// The hybrid method the other way round: geometry by primitive, from the hit buffer; colour by pixel, as the rays are
// traced again.

#include <gart/backward/gradient_methods.hpp>

namespace gart_test {

struct geometry_method : gart::gradient_method_base {
  static constexpr char const* name = "geometry";
  static constexpr gart::slot_validity validity = gart::slot_validity::recomputed;
  template <int Size>
  using record = gart::record_slots<gart::hit_entry, Size>;
  using gather = gart::terms<gart::term::geometry>;
  using scatter = gart::terms<gart::term::color>;
  using fallback = gart::pixel_method;
};
static_assert(gart::gradient_method<geometry_method>);

}  // namespace gart_test
