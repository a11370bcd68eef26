// expects: t.trace(e
#include <gart/exec/serial.hpp>
#include <gart/trace/tracer.hpp>

struct nothing : gart::tracer_base {
  using response_type = gart::generalized_gaussian<>;
  static constexpr char const* name = "nothing";
  explicit nothing(gart::serial_exec&) {}
  void prepare(gart::serial_exec&, gart::gaussians_view<float const>, gart::span<gart::ray_gaussian const>,
               gart::camera const&, gart::trace_options const&) {}
  gart::pixel_rays rays() const { return {}; }
  gart::origin_rays rays_with_origins() const { return {}; }
#ifdef GART_WHOLE
  template <gart::ray_program P>
  void trace(gart::serial_exec&, char const*, gart::index_t, P const&) {}
#endif
};
static_assert(gart::tracer<nothing, gart::serial_exec>);
