// expects: typename T::response or named 'response'
#include <gart/scene/traits.hpp>

struct mine {
  static constexpr int sh_degree = 2;
#ifdef GART_WHOLE
  using response = gart::generalized_gaussian<>;
#else
  using kernel = gart::generalized_gaussian<>;
#endif
};
static_assert(gart::scene_requirements<mine>);
