// expects: T::lends_footprints
#include <gart/exec/serial.hpp>
#include <gart/trace/tracer.hpp>

struct nothing {
  using response_type = gart::generalized_gaussian<>;
  static constexpr char const* name = "nothing";
  static constexpr int tile_size = 8;
#ifdef GART_WHOLE
  static constexpr bool lends_footprints = false;
#else
  static constexpr bool lends_footprint = false;
#endif
  explicit nothing(gart::serial_exec&) {}
  void prepare(gart::serial_exec&, gart::gaussians_view<float const>, gart::span<gart::ray_gaussian const>,
               gart::camera const&, gart::trace_options const&) {}
  gart::pixel_rays rays() const { return {}; }
  gart::origin_rays rays_with_origins() const { return {}; }
  template <gart::ray_program P>
  void trace(gart::serial_exec&, char const*, gart::index_t, P const&) {}
};
static_assert(gart::tracer<nothing, gart::serial_exec>);
