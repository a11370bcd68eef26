// expects: S::scatter or named 'scatter'
#include <gart/backward/strategies.hpp>

struct colors : gart::strategy_base {
  static constexpr char const* name = "colors";
  template <int Size>
  using record = gart::record_slots<gart::hit_entry, Size>;
  using gather = gart::terms<gart::color>;
#ifdef GART_WHOLE
  using scatter = gart::terms<gart::geometry>;
#else
  using scatters = gart::terms<gart::geometry>;
#endif
};
static_assert(gart::strategy<colors>);
