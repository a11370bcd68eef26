// A term that is computed twice.
// expects: gather::geometry
#include <gart/backward/gradient_methods.hpp>

struct twice : gart::gradient_method_base {
  static constexpr char const* name = "twice";
  template <int Size>
  using record = gart::record_slots<gart::hit_entry, Size>;
  using gather = gart::terms<gart::term::color, gart::term::geometry>;
#ifdef GART_WHOLE
  using scatter = gart::terms<>;
#else
  using scatter = gart::terms<gart::term::geometry>;
#endif
};
static_assert(gart::gradient_method<twice>);
