// A term that is computed twice.
// expects: gather::geometry
#include <gart/backward/strategies.hpp>

struct twice : gart::strategy_base {
  static constexpr char const* name = "twice";
  template <int Size>
  using record = gart::record_slots<gart::hit_entry, Size>;
  using gather = gart::terms<gart::color, gart::geometry>;
#ifdef GART_WHOLE
  using scatter = gart::terms<>;
#else
  using scatter = gart::terms<gart::geometry>;
#endif
};
static_assert(gart::strategy<twice>);
