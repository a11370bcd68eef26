// expects: R::slope(x)
#include <gart/math/response.hpp>

// (1 - |p|^2 / 9)^2 within three standard deviations.
struct bump {
  static constexpr int degree = 2;
  template <class F>
  static F response(F d2) {
    return (F(1.0f) - d2 / F(9.0f)) * (F(1.0f) - d2 / F(9.0f));
  }
  template <class F>
  static F estimated_response(F d2) {
    return response(d2);
  }
  static float cutoff(float ratio) { return 9.0f * (1.0f - gart::square_root(gart::reciprocal(ratio))); }
#ifdef GART_WHOLE
  template <class F>
  static F slope(F d2) {
    return F(4.0f) / (F(9.0f) - d2);
  }
#endif
};
static_assert(gart::response_function<bump>);
