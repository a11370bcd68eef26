#pragma once
/// \file
/// Paths of light through Gaussians and a scene, on every policy. Each sample of all pixels goes in waves, a segment at
/// a time. Triangles and lights end a segment, and Gaussians are blended along it (light/paths.hpp). Shadow rays are
/// sent to each light, and the surface sends the path on (light/path_kernels.hpp).
///
///   path_tracer<E> tracer(exec);
///   tracer.set_model(gaussians.view(), sh_degree);
///   tracer.set_scene(scene);
///   tracer.begin(view, options, paths);
///   tracer.add(16);
///
/// Where all rays of a sample have one centre and no lens bends them, all pixels share its jitter. Such a sample is the
/// image of a pinhole whose principal point is moved. Devices then find the hits of first segments by tiles
/// (trace/tile_tracer.hpp), which are the same as those by the tree.
///
/// Gaussians alone, without jitter, give the colours of the renderers, bit for bit. From one seed every policy draws
/// the same numbers. What follows from them has the same bits on hosts, and on a device compiled with -fmad=false.
///
/// Samples that are not finite count as black, so that one broken texel or Gaussian does not spoil its pixel.
///
/// Memory: the tree over the Gaussians and 64 bytes each, 12 more for shadows per Gaussian. Also 150 bytes a triangle,
/// 150 bytes a pixel, and the lists of tiles. Cost of a sample: a walk through triangles and one through Gaussians for
/// each segment. Each rough surface costs the same again for each light.
/// Errors: invalid_argument for a camera, options or a scene that cannot be traced, and for calls out of order.

#include <gart/light/path_kernels.hpp>
#include <gart/light/placed_scene.hpp>
#include <gart/math/turn.hpp>
#include <gart/render/frame.hpp>
#include <gart/trace/tile_tracer.hpp>

namespace gart { inline namespace GART_ISA {

/// By what first segments find their hits, where both can.
enum class first_hits { tree, tiles };

/// Traces paths for one picture at a time.
template <execution E, class Response = generalized_gaussian<>>
class path_tracer {
 public:
  /// Allocates nothing; `exec` must outlive it.
  explicit path_tracer(E& exec)
      : exec_(&exec),
        beams_(exec),
        tiles_(exec),
        placed_(exec),
        index_(exec),
        gaussians_(exec),
        factors_(exec),
        paths_(exec),
        ends_(exec),
        shadows_(exec),
        sums_(exec) {}

  /// The Gaussians, whose arrays must stay as they are; bands above active_degree are not evaluated.
  void set_model(gaussians_view<float const> model, int active_degree) {
    if (model.sh_degree < 0 || model.sh_degree > color_rows::most || active_degree < 0 ||
        active_degree > model.sh_degree)
      throw invalid_argument("path_tracer.set_model: the SH degree is not from 0 to 3, or less than what is evaluated");
    model_ = model, active_degree_ = active_degree;
    has_model_ = true, index_is_old_ = factors_are_old_ = true;
    samples_ = pixels_ = 0;
  }
  /// The meshes, materials and lights.
  void set_scene(light::scene const& scene) {
    light::require_scene(scene);
    placed_.set(scene);
    bool const sized = std::any_of(scene.lights.begin(), scene.lights.end(), [](light::light const& l) {
      return l.kind == light::light_kind::sphere || l.kind == light::light_kind::rectangle || l.angle > 0;
    });
    shadow_samples_ = sized ? 8 : 1;
    has_scene_ = true, factors_are_old_ = true;
    samples_ = pixels_ = 0;
  }

  /// The same hits, in another time: of pictures that are begun from here on.
  void find_first(first_hits by) { first_ = by, samples_ = pixels_ = 0; }

  /// A picture anew.
  void begin(camera const& view, render_options const& options, light::path_options const& paths) {
    if (!has_model_) throw invalid_argument("path_tracer.begin: there are no Gaussians; call set_model first");
    if (!has_scene_) throw invalid_argument("path_tracer.begin: there is no scene; call set_scene first");
    require_camera(view);
    require_options(options);
    light::require_path_options(paths);
    if (options.antialias != 0)
      throw invalid_argument("render_options.antialias must be 0 where paths are traced: samples fill the pixels");
    stand_at(view.position, options.alpha_min);
    shade(paths);
    view_ = view, options_ = options, paths_options_ = paths;
    pixels_ = static_cast<index_t>(view.width) * static_cast<index_t>(view.height);
    order_ = {view.width, view.height};
    rays_ = order_.launch_size();
    samples_ = 0;
    paths_.resize(rays_), ends_.resize(rays_), sums_.resize(std::size_t{3} * pixels_);
    sums_.zero();
    is_pinhole_ = view.kind == camera_kind::perspective && view.shutter == shutter_kind::global && !view.lens.any() &&
                  paths.aperture == 0 && paths.blur == 0;
  }
  /// So many samples more a pixel.
  void add(int samples) {
    require_begun("path_tracer.add");
    for (int s = 0; s < samples; ++s) {
      trace(static_cast<u32>(samples_));
      parallel_for(*exec_, "light/sum", rays_, light_kernels::add_samples{paths_.data(), sums_.data()});
      ++samples_;
    }
  }
  /// How many there are.
  int samples() const { return samples_; }
  /// Pixels of the picture.
  index_t pixels() const { return pixels_; }
  /// The sum of the samples, [H][W][3].
  buffer<float, E> const& sums() const { return sums_; }

  /// Their mean, exposed and in a tone, to [H][W][3] in memory of the policy.
  void show(float exposure, light::tone_kind tone, float* to) {
    require_begun("path_tracer.show");
    if (samples_ == 0) throw invalid_argument("path_tracer.show: there is no sample; call add first");
    parallel_for(
        *exec_, "light/show", 3 * pixels_,
        light_kernels::show_samples{sums_.data(), 1.0f / static_cast<float>(samples_), std::exp2(exposure), tone, to});
  }

  /// The layers of rays through the middles of the pixels; targets in memory of the policy.
  void layers(light_kernels::layer_targets const& out) {
    require_begun("path_tracer.layers");
    cast(0, false, 0, 0);
    end_segments();
    trace_batch<Response>(*exec_, "light/layers", index_.seen_from(frame_), {gaussians_.data(), model_.count, 0.0f},
                          rays_, beams_,
                          light_kernels::layer_segment{{}, paths_.data(), ends_.data(), colors(), options_, out});
    parallel_for(*exec_, "light/layers", rays_,
                 light_kernels::add_surface_layers{placed_.stand_at(frame_), paths_.data(), ends_.data(), out});
  }

 private:
  void require_begun(char const* call) const {
    if (pixels_ == 0) throw invalid_argument(std::string(call) + ": there is no picture; call begin first");
  }
  light_kernels::gaussian_colors colors() const {
    auto const& o = paths_options_;
    bool const shades = o.shadows != light::shadow_kind::none;
    return {{model_.sh, model_.sh_degree, active_degree_},
            o.shadows == light::shadow_kind::per_gaussian ? factors_.data() : nullptr,
            shades && o.relight,
            o.linear};
  }
  light_kernels::shadow_rule rule() const { return {paths_options_.ambient, paths_options_.relight}; }

  void stand_at(vec3d const& frame, float alpha_min) {
    placed_.stand_at(frame);
    if (index_is_old_ || index_.alpha_min() != alpha_min) {
      stage_scope stage(*exec_, "light index");
      index_.build(*exec_, model_, alpha_min, frame);
    } else if (frame == frame_) {
      return;
    }
    frame_ = frame, index_is_old_ = false;
    gaussians_.resize(model_.count);
    parallel_for(*exec_, "light/preprocess", model_.count,
                 render_kernels::prepare_gaussians<Response>{model_, frame, alpha_min, gaussians_.view()});
  }
  // Once for a model and a scene: they follow from no view.
  void shade(light::path_options const& paths) {
    if (paths.shadows != light::shadow_kind::per_gaussian) return;
    if (!factors_are_old_ && paths.ambient == shaded_by_.ambient && paths.relight == shaded_by_.relight &&
        paths.seed == shade_seed_)
      return;
    shaded_by_ = {paths.ambient, paths.relight}, shade_seed_ = paths.seed;
    factors_.resize(model_.count);
    parallel_for(*exec_, "light/shade", model_.count,
                 light_kernels::shade_gaussians{placed_.stand_at(frame_), model_.mean, frame_, shaded_by_, paths.seed,
                                                shadow_samples_, factors_.data()});
    factors_are_old_ = false;
  }

  // Each sample is of one moment: their moments fill the exposure evenly.
  // The camera by which.
  camera cast(u32 sample, bool jitter, float aperture, float blur) {
    camera view = view_;
    bool const together = jitter && is_pinhole_;
    if (together) {
      vec2 const at = light_kernels::draws::of(paths_options_.seed, light_kernels::path::no_pixel, sample)
                          .pair(0, light_kernels::draw_pixel);
      view.cx += 0.5f - at.x, view.cy += 0.5f - at.y;
    }
    double const time = (double{light_kernels::unit_interval(light_kernels::reversed(sample))} - 0.5) * double{blur};
    mat3d const rotation(view.rotation);
    vec3 const moved(rotation * (time * vec3d(view.travel)));
    view.rotation = mat3(rotation * turn_of(time * vec3d(view.turn)));
    light_kernels::thin_lens const lens{aperture, paths_options_.focus,
                                        view.kind == camera_kind::perspective || view.kind == camera_kind::orthographic,
                                        view.rotation, moved};
    visit_camera(view, [&]<class M>(M const& model) {
      parallel_for(*exec_, "light/cast", rays_,
                   light_kernels::cast_paths<M>{model, order_, lens, options_.near, options_.background,
                                                paths_options_.seed, sample, jitter && !together, paths_.data()});
    });
    return view;
  }
  void end_segments() {
    parallel_for(*exec_, "light/triangles", rays_,
                 light_kernels::end_segments{placed_.stand_at(frame_), paths_.data(), ends_.data()});
  }
  void trace(u32 sample) {
    light_kernels::scene_view const& scene = placed_.stand_at(frame_);
    auto const& o = paths_options_;
    u32 const bounces = static_cast<u32>(o.bounces);
    // A path that catchers let pass goes on as it is, and comes to this many of them.
    u32 const steps = bounces + 1 + (placed_.catches_shadows() ? 4 : 0);
    u32 const lights = scene.light_count + (scene.around.texels ? 1 : 0);
    camera const view = cast(sample, o.jitter, o.aperture, o.blur);
    if (by_tiles() && (o.jitter || sample == 0))
      tiles_.prepare(*exec_, model_, gaussians_, view, {options_.alpha_min, options_.near, 1, {}});
    for (u32 step = 0; step < steps; ++step) {
      end_segments();
      if (o.shadows == light::shadow_kind::per_hit)
        blend<true>(sample, step);
      else
        blend<false>(sample, step);
      if (placed_.triangles() > 0 && bounces > 0)
        for (u32 l = 0; l < lights; ++l) shadow(l, sample, step);
      parallel_for(*exec_, "light/surfaces", rays_,
                   light_kernels::send_on{scene,
                                          paths_.data(),
                                          ends_.data(),
                                          options_.background,
                                          bounces,
                                          static_cast<u32>(o.roulette_after),
                                          o.firefly,
                                          {o.ambient, false},
                                          o.seed,
                                          sample,
                                          step});
    }
  }
  bool by_tiles() const { return first_ == first_hits::tiles && is_pinhole_ && model_.count > 0; }
  template <bool PerHit>
  void blend(u32 sample, u32 step) {
    light_kernels::segment<PerHit> const program{
        {},     paths_.data(),       ends_.data(), colors(), options_, placed_.stand_at(frame_),
        rule(), paths_options_.seed, sample,       step,     order_};
    if (step == 0 && by_tiles())
      tiles_.trace(*exec_, "light/gaussians", rays_, program);
    else
      trace_batch<Response>(*exec_, "light/gaussians", index_.seen_from(frame_),
                            {gaussians_.data(), model_.count, 0.0f}, rays_, beams_, program);
  }
  void shadow(u32 light, u32 sample, u32 step) {
    shadows_.resize(rays_);
    parallel_for(*exec_, "light/shadows", rays_,
                 light_kernels::aim_at_light{placed_.stand_at(frame_), paths_.data(), ends_.data(), shadows_.data(),
                                             light, static_cast<u32>(paths_options_.bounces), paths_options_.firefly,
                                             paths_options_.seed, sample, step});
    trace_batch<Response>(
        *exec_, "light/transmittance", index_.seen_from(frame_), {gaussians_.data(), model_.count, 0.0f}, rays_, beams_,
        light_kernels::shadow_segment{{}, shadows_.data(), paths_.data(), options_.transmittance_min});
  }

  E* exec_;
  ray_order<E> beams_;                 // of no batch: paths stay in the order of their blocks
  tile_tracer<E, 8, Response> tiles_;  // of first segments
  first_hits first_ = E::device ? first_hits::tiles : first_hits::tree;
  bool is_pinhole_ = false;
  light_kernels::placed_scene<E> placed_;
  gaussians_view<float const> model_;
  int active_degree_ = 0;
  bool has_model_ = false, has_scene_ = false, index_is_old_ = true, factors_are_old_ = true;
  world_index<E, Response> index_;
  buffer<ray_gaussian, E> gaussians_;  // in frame_
  vec3d frame_{0.0};
  buffer<vec3, E> factors_;  // [N], of shadows per Gaussian
  light_kernels::shadow_rule shaded_by_;
  u64 shade_seed_ = 0;
  u32 shadow_samples_ = 1;
  camera view_;
  render_options options_;
  light::path_options paths_options_;
  buffer<light_kernels::path, E> paths_;
  buffer<light_kernels::path_hit, E> ends_;
  buffer<light_kernels::shadow_ray, E> shadows_;
  buffer<float, E> sums_;
  pixel_order order_;
  index_t pixels_ = 0, rays_ = 0;  // rays: of whole blocks of pixels
  int samples_ = 0;
};

}}  // namespace gart::GART_ISA
