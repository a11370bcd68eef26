#pragma once
// The hybrid strategy the other way round: geometry by primitive, from the hit buffer; colour by pixel, as the rays are
// traced again.

#include <gart/backward/strategies.hpp>

namespace gart_test {

struct geometry_strategy : gart::strategy_base {
  static constexpr char const* name = "geometry";
  static constexpr gart::slot_validity validity = gart::slot_validity::recomputed;
  template <int Size>
  using record = gart::record_slots<gart::hit_entry, Size>;
  using gather = gart::terms<gart::geometry>;
  using scatter = gart::terms<gart::color>;
  using fallback = gart::pixel_strategy;
};
static_assert(gart::strategy<geometry_strategy>);

}  // namespace gart_test
