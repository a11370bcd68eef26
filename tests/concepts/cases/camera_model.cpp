// expects: m.bounds(value)
#include <gart/camera/model.hpp>

struct blind_bounds {
  gart::footprint operator()(gart::ellipsoid const&) const { return {}; }
};
struct no_filter {
  float sigma_at(gart::vec3 const&) const { return 0; }
  gart::filter_at at(gart::vec3 const&) const { return {}; }
  gart::vec3 from_camera(gart::gaussian_parameters const& g) const { return g.mean; }
};
struct blind : gart::camera_base {
  template <class F>
  gart::primary_ray_of<F> ray(F u, F v) const {
    return gart::each_lane(u, v, [](float, float) { return gart::vec3(0, 0, 1); });
  }
#ifdef GART_WHOLE
  blind_bounds bounds(float) const { return {}; }
#endif
  no_filter filter(float) const { return {}; }
  gart::camera_fault fault() const { return {}; }
};
static_assert(gart::camera_model<blind>);
