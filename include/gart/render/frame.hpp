#pragma once
/// \file
/// A frame: the Gaussians of a scene as one view sees them, 64 bytes each, and a tracer's structure over them. The
/// object between a view and its images, and between a view and its gradients (backward/backward.hpp).
///
///   frame<E, scene_traits<3>, tile_tracer<E>> frame(exec);
///   frame.prepare(scene, view, options);   // once a view, and again when scene, view or options change
///   frame.render({.color = color});        // as often as wanted
///
/// The scene's arrays and the policy must outlive the use of the frame. Cost of prepare: a launch over the Gaussians
/// and the tracer's own preparation; of render: a ray a pixel. Memory: 64 bytes a Gaussian, 16 more where the options
/// have a filter of the pixels, and the tracer's. Errors: invalid_argument for cameras and options that rays cannot be
/// traced by, and for calls that need a prepared frame.

#include <gart/exec/stage.hpp>
#include <gart/render/antialiased.hpp>
#include <gart/render/packet_composite.hpp>
#include <gart/scene/parameters.hpp>
#include <gart/scene/traits.hpp>
#include <gart/trace/tracer.hpp>

#include <optional>
#include <string>

namespace gart { inline namespace GART_ISA {

namespace render_kernels {

template <class Response>
struct prepare_gaussians {
  gaussians_view<float const> scene;
  vec3d frame;
  float alpha_min;
  span<ray_gaussian> gaussians;
  GART_KERNEL void operator()(index_t i) const {
    gaussians[i] = gart::prepare<Response>(load_parameters(scene, i), frame, alpha_min);
  }
};

}  // namespace render_kernels

/// View: a camera, or a model of a program's own (camera/model.hpp).
template <execution E, scene_requirements Traits, class Tracer, class View = camera>
requires tracer<Tracer, E>
class frame {
 public:
  using execution_type = E;                            ///< the policy
  using tracer_type = Tracer;                          ///< what finds the hits
  using response = typename Traits::response;          ///< how the Gaussians fall from their centres
  static constexpr int sh_degree = Traits::sh_degree;  ///< of the coefficients that are stored
  static constexpr int tile_size = Tracer::tile_size;  ///< side of the tiles that footprints are cut into, in pixels
  static_assert(std::is_same_v<typename Tracer::response_type, response>,
                "the tracer finds the hits of another response than the traits name");

  /// Allocates nothing; `exec` must outlive it.
  explicit frame(E& exec) : exec_(&exec), filter_(exec), gaussians_(exec), tracer_(exec) {}

  /// The scene's coefficients are of Traits::sh_degree; bands above active_degree are not evaluated.
  void prepare(gaussians_view<float const> scene, View const& view, render_options const& options = {},
               int active_degree = sh_degree) {
    prepared_ = false;
    if (scene.sh_degree != sh_degree) throw invalid_argument("frame.prepare: the scene has another SH degree");
    require_camera(view);
    require_options(options);
    scene_ = scene, options_ = options, active_degree_ = active_degree;
    view_.emplace(view);
    seen_ = filter_.of(*exec_, scene, view, options.antialias);
    gaussians_.resize(scene.count);
    parallel_for(
        *exec_, "preprocess", scene.count,
        render_kernels::prepare_gaussians<response>{seen_, view.position, options.alpha_min, gaussians_.view()});
    tracer_.prepare(*exec_, seen_, gaussians(), view,
                    trace_options{options.alpha_min, options.near, options.rebuild_every, options.rows});
    prepared_ = true;
    ++preparations_;
  }

  /// The forward pass. `record` takes the record of each hit for a backward pass.
  template <hit_record Record = record_none>
  void render(image_targets const& targets, Record const& record = {}) {
    require_prepared("render");
    pixel_order const order{view_->width, view_->height, options_.rows};
    with_rays([&]<class Rays>(Rays const& rays) {
      trace("forward", order.launch_size(),
            composite<sh_degree, Record, Rays>{{}, rays, order, scene_.sh, active_degree_, options_, targets, record});
    });
  }

  /// Calls f with the rays of the view's pixels, of the type that they have (camera/pixel_rays.hpp).
  template <class F>
  void with_rays(F&& f) const {
    require_prepared("with_rays");
    if constexpr (central_camera<View>)
      f(tracer_.rays());
    else if constexpr (camera_model<View>)
      f(tracer_.rays_with_origins());
    else if (origin_rays const rays = tracer_.rays_with_origins(); rays.origins)
      f(rays);
    else
      f(tracer_.rays());
  }

  /// Any other rays through the Gaussians; tracers by tiles take pixel programs alone.
  template <ray_program P>
  void trace(char const* label, index_t rays, P const& program) {
    require_prepared("trace");
    tracer_.trace(*exec_, label, rays, program);
  }

  /// As they were prepared: throw where nothing was.
  gaussians_view<float const> scene() const { return require_prepared("scene"), scene_; }
  gaussians_view<float const> seen() const { return require_prepared("seen"), seen_; }  ///< through the pixels' filter
  /// The camera or camera model.
  View const& view() const { return require_prepared("view"), *view_; }
  /// The arguments of its preparation.
  render_options const& options() const { return require_prepared("options"), options_; }
  /// Bands above it are not evaluated.
  int active_degree() const { return require_prepared("active_degree"), active_degree_; }
  /// Of the pixels of a view with one centre.
  pixel_rays rays() const { return require_prepared("rays"), tracer_.rays(); }
  /// The Gaussians in the view's frame, [N]; empty before the first prepare.
  span<ray_gaussian const> gaussians() const { return gaussians_; }
  /// With its rays, lists or tree.
  Tracer const& tracer() const { return tracer_; }
  /// The policy.
  E& exec() const { return *exec_; }
  /// The number of its preparation, from 1. Results of another one do not fit.
  u64 preparation() const { return require_prepared("preparation"), preparations_; }

 private:
  void require_prepared(char const* what) const {
    if (!prepared_) throw invalid_argument(std::string("frame.") + what + " needs a view: call frame.prepare first");
  }

  E* exec_;
  antialiased<E> filter_;
  buffer<ray_gaussian, E> gaussians_;
  Tracer tracer_;
  gaussians_view<float const> scene_, seen_;
  std::optional<View> view_;
  render_options options_;
  int active_degree_ = sh_degree;
  bool prepared_ = false;
  u64 preparations_ = 0;
};

}}  // namespace gart::GART_ISA
