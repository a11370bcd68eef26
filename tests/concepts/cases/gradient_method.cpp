// expects: S::scatter or named 'scatter'
#include <gart/backward/gradient_methods.hpp>

struct colors : gart::gradient_method_base {
  static constexpr char const* name = "colors";
  template <int Size>
  using record = gart::record_slots<gart::hit_entry, Size>;
  using gather = gart::terms<gart::term::color>;
#ifdef GART_WHOLE
  using scatter = gart::terms<gart::term::geometry>;
#else
  using scatters = gart::terms<gart::term::geometry>;
#endif
};
static_assert(gart::gradient_method<colors>);
