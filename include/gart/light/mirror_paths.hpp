#pragma once
/// \file
/// A view with mirrors and shadows in it, and the gradients of its Gaussians. These are Gaussians before a surface,
/// Gaussians that a mirror shows, and Gaussians that throw a shadow on a mesh. A ray goes through the middle of each
/// pixel, and on from mirrors alone. Any other surface ends it with what it emits and what the lights give it, through
/// the Gaussians in between.
///
///   mirror_paths<E> paths(exec);
///   paths.set_scene(scene);
///   paths.set_model(gaussians.view(), sh_degree);
///   paths.forward(view, options, path_options, color);
///   paths.backward(by_color, gradients.view());
///
/// With mirror_pixels::mirrors it traces the pixels alone that meet a mirror first: a trainer shows the others. The
/// trainer's loss sees both in one image (forward). The trainer then takes the gradient out of the pixels of mirrors
/// (take_out). Before the optimizer's step it adds what that gradient comes to (backward, with_what::there_is).
/// train/learned/mirrors.hpp trains so.
///
/// A path from segment k on has L_k = C_k + T_k B_k. C and T are what a segment's Gaussians add and let through. B_k is
/// what shines at its end, plus b_k L_(k + 1) at a mirror of colour b_k. At a rough surface the sum of T_l E_l over the
/// lights l is added instead. E_l is what light l gives through its shadow ray. T_l is what the Gaussians along that
/// ray let through. Segments and shadow rays are batches of rays (rays/ray_tracer.hpp), whose contexts have the
/// gradients by C and T. A Gaussian whose largest response crosses a surface goes from one segment to the next. This
/// step has no gradient. Nor has the shadow of meshes on a Gaussian: a factor scales the Gaussian's colour and the
/// colour's gradient alike.
///
/// Of path_options it reads bounces, shadows (none or per-gaussian), ambient, relight and the seed. The seed draws one
/// point of each light that has a size.
/// Memory: 100 bytes a pixel and segment, 60 more a light, what contexts hold, and the gradients of a second model.
/// Errors: invalid_argument as ray_tracer and path_tracer throw it, for shadows per hit, decoded colours and calls out
/// of order.

#include <gart/algorithm/exclusive_scan.hpp>
#include <gart/light/mirror_kernels.hpp>
#include <gart/light/placed_scene.hpp>
#include <gart/rays/ray_tracer.hpp>

#include <memory>
#include <vector>

namespace gart { inline namespace GART_ISA {

/// Which pixels are traced.
enum class mirror_pixels { all, mirrors };
/// What becomes of gradients that there are.
enum class with_what { nothing, there_is };

/// Views with mirrors, and their gradients.
template <execution E, class Response = generalized_gaussian<>>
class mirror_paths {
 public:
  /// Allocates nothing; `exec` must outlive it.
  explicit mirror_paths(E& exec)
      : exec_(&exec),
        placed_(exec),
        tracer_(exec),
        all_paths_(exec),
        paths_(exec),
        all_ends_(exec),
        ends_(exec),
        traced_(exec),
        places_(exec),
        pixels_(exec),
        shadows_(exec),
        factors_(exec),
        shaded_(exec),
        by_seen_(exec),
        by_color_(exec),
        by_transmittance_(exec) {}

  /// Meshes, of which mirrors count, and what is not seen through.
  void set_scene(light::scene const& scene) {
    light::require_scene(scene);
    placed_.set(scene);
  }
  /// The Gaussians, whose arrays must stay; again where they have changed.
  void set_model(gaussians_view<float const> model, int active_degree) {
    model_ = model, active_degree_ = active_degree;
  }

  /// To `color`, [H][W][3] in memory of the policy: pixels that are not traced stay as they are.
  void forward(camera const& view, render_options const& options, light::path_options const& paths, float* color,
               mirror_pixels which = mirror_pixels::all) {
    require_camera(view);
    require(paths);
    cast(view, options);
    light_kernels::scene_view const& scene = placed_.stand_at(view.position);
    give_model(scene, view.position, paths);
    index_t const n = choose(scene, which);
    int const bounces = paths.bounces;
    segments_.clear();
    for (int k = 0; n > 0 && k <= bounces; ++k) {
      auto& s = *segments_.emplace_back(std::make_unique<segment>(*exec_, n));
      render_options alone = options;
      alone.background = vec3(0.0f);
      if (k > 0) {
        alone.near = 1e-6f;
        parallel_for(*exec_, "light/triangles", n, light_kernels::end_segments{scene, paths_.data(), ends_.data()});
      }
      if (k < bounces) send_shadows(s, scene, view.position, alone, paths.seed, static_cast<u32>(k));
      parallel_for(*exec_, "light/mirrors", n,
                   light_kernels::follow_mirrors{scene, paths_.data(), ends_.data(), options.background, alone.near,
                                                 s.origins.data(), s.directions.data(), s.t_max.data(), s.share.data(),
                                                 s.behind.data(), k == bounces});
      for (light_batch const& l : s.lights)
        parallel_for(*exec_, "light/mirrors", n,
                     light_kernels::add_light{l.context.transmittance.data(), l.radiance.data(), s.behind.data()});
      s.context = tracer_.forward(s.rays(view.position), alone);
    }
    for (std::size_t k = segments_.size(); k-- > 0;) {
      segment& s = *segments_[k];
      parallel_for(*exec_, "light/mirrors", n,
                   light_kernels::blend_segment{s.context.color.data(), s.context.transmittance.data(), s.share.data(),
                                                k + 1 < segments_.size() ? segments_[k + 1]->seen.data() : nullptr,
                                                s.behind.data(), s.seen.data()});
    }
    if (n > 0)
      parallel_for(*exec_, "light/mirrors", n,
                   light_kernels::put_pixels{pixels_.data(), segments_[0]->seen.data(), color});
  }

  /// From dL/d colour of the last forward, [H][W][3], to dL/d Gaussians. `gradients` has their number and at least the
  /// degree that is evaluated. `with` says whether the result is added to what is there, or takes its place.
  void backward(span<float const> by_color, gaussians_view<float> gradients, with_what with = with_what::nothing) {
    require_begun(by_color.size(), "mirror_paths.backward");
    index_t const n = static_cast<index_t>(pixels_.size());
    if (with == with_what::nothing) zero(gradients);
    if (n == 0) return;
    by_seen_.resize(n), by_color_.resize(std::size_t{3} * n), by_transmittance_.resize(n);
    parallel_for(*exec_, "light/mirrors", n,
                 light_kernels::get_pixels{pixels_.data(), by_color.data(), by_seen_.data()});
    for (auto const& each : segments_) {
      segment& s = *each;
      for (light_batch& l : s.lights) {
        parallel_for(*exec_, "light/mirrors", n,
                     light_kernels::light_gradient{by_seen_.data(), l.radiance.data(), s.context.transmittance.data(),
                                                   by_transmittance_.data()});
        add_gradients(l, {.transmittance = by_transmittance_}, gradients);
      }
      parallel_for(*exec_, "light/mirrors", n,
                   light_kernels::split_gradient{s.context.transmittance.data(), s.share.data(), s.behind.data(),
                                                 by_seen_.data(), by_color_.data(), by_transmittance_.data()});
      add_gradients(s, {.color = by_color_, .transmittance = by_transmittance_}, gradients);
    }
  }
  /// Zero at the pixels that the last forward traced, of [H][W][3] or [H][W].
  void take_out(span<float> image) {
    bool const plane = image.size() == size_;
    require_begun(image.size() * (plane ? 3 : 1), "mirror_paths.take_out");
    parallel_for(*exec_, "light/mirrors", static_cast<index_t>(pixels_.size()),
                 light_kernels::clear_pixels{pixels_.data(), plane ? std::size_t{1} : std::size_t{3}, image.data()});
  }
  /// Pixels that the last forward traced.
  index_t traced() const { return static_cast<index_t>(pixels_.size()); }

 private:
  struct batch {
    batch(E& exec, index_t n)
        : origins(exec, std::size_t{3} * n), directions(exec, std::size_t{3} * n), t_max(exec, n), context(exec) {}
    ray_batch rays(vec3d const& frame) const { return {frame, origins, directions, t_max}; }
    buffer<float, E> origins, directions, t_max;
    batch_context<E> context;
  };
  struct light_batch : batch {  // of one light
    light_batch(E& exec, index_t n) : batch(exec, n), radiance(exec, n) {}
    buffer<vec3, E> radiance;
  };
  struct segment : batch {
    segment(E& exec, index_t n) : batch(exec, n), share(exec, n), behind(exec, n), seen(exec, n) {}
    buffer<vec3, E> share, behind, seen;
    std::vector<light_batch> lights;
  };

  void require_begun(std::size_t size, char const* call) const {
    if (size_ == 0) throw invalid_argument(std::string(call) + ": there is no view; call forward first");
    if (size != 3 * size_)
      throw invalid_argument(std::string(call) + ": the gradient has " + std::to_string(size) +
                             " numbers, and the view has " + std::to_string(size_) + " pixels of three");
  }
  static void require(light::path_options const& paths) {
    light::require_path_options(paths);
    if (paths.shadows == light::shadow_kind::per_hit)
      throw invalid_argument("path_options.shadows is per-hit, which has no gradients: set none or per-gaussian");
    if (paths.linear)
      throw invalid_argument("path_options.linear is set: colours that are decoded have no gradients; leave it unset");
  }
  // The Gaussians to the tracer, in the shadow of meshes where that is wanted.
  void give_model(light_kernels::scene_view const& scene, vec3d const& frame, light::path_options const& paths) {
    shades_ = paths.shadows == light::shadow_kind::per_gaussian && scene.light_count > 0;
    first_band_ = paths.relight;
    gaussians_view<float const> given = model_;
    if (shades_) {
      factors_.resize(model_.count), shaded_.resize(std::size_t{model_.count} * model_.sh_stride());
      parallel_for(*exec_, "light/shade", model_.count,
                   light_kernels::shade_gaussians{
                       scene, model_.mean, frame, {paths.ambient, paths.relight}, paths.seed, 1, factors_.data()});
      parallel_for(*exec_, "light/shade", model_.count,
                   light_kernels::shade_coefficients{model_.sh, factors_.data(), sh_coefficients(model_.sh_degree),
                                                     first_band_, shaded_.data()});
      given.sh = shaded_.data();
    }
    tracer_.set_scene(given, active_degree_);
  }
  // Before the paths go on from where a segment ends.
  void send_shadows(segment& s, light_kernels::scene_view const& scene, vec3d const& frame,
                    render_options const& options, u64 seed, u32 step) {
    index_t const n = static_cast<index_t>(paths_.size());
    render_options whole = options;
    whole.max_hits = 0;
    shadows_.resize(n);
    u32 const lights = scene.light_count + (scene.around.texels ? 1 : 0);
    for (u32 l = 0; l < lights; ++l) {
      light_batch& to = s.lights.emplace_back(*exec_, n);
      parallel_for(*exec_, "light/shadows", n,
                   light_kernels::aim_at_light{scene, paths_.data(), ends_.data(), shadows_.data(), l, 1, 0, seed, 0,
                                               step, true});
      parallel_for(*exec_, "light/shadows", n,
                   light_kernels::batch_shadows{shadows_.data(), options.near, to.origins.data(), to.directions.data(),
                                                to.t_max.data(), to.radiance.data()});
      to.context = tracer_.forward(to.rays(frame), whole);
    }
  }
  // From dL/d what a batch saw, added to that of the Gaussians.
  void add_gradients(batch& of, output_gradients const& by, gaussians_view<float> gradients) {
    if (!of_batch_ || of_batch_->sh_degree() != gradients.sh_degree)
      of_batch_ = std::make_unique<gaussians<E>>(*exec_, 0, gradients.sh_degree);
    of_batch_->resize_keep(model_.count);
    of_batch_->zero();
    tracer_.backward(of.context, by, of_batch_->view());
    if (shades_)
      parallel_for(*exec_, "light/shade", model_.count,
                   light_kernels::unshade_gradient{factors_.data(), sh_coefficients(gradients.sh_degree), first_band_,
                                                   of_batch_->view().sh});
    add(gradients, of_batch_->view());
  }
  void cast(camera const& view, render_options const& options) {
    pixel_order const order{view.width, view.height};
    index_t const n = order.launch_size();
    size_ = static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height);
    all_paths_.resize(n), all_ends_.resize(n);
    visit_camera(view, [&]<class M>(M const& model) {
      parallel_for(*exec_, "light/cast", n,
                   light_kernels::cast_paths<M>{
                       model, order, {}, options.near, options.background, 0, 0, false, all_paths_.data()});
    });
    parallel_for(*exec_, "light/triangles", n,
                 light_kernels::end_segments{placed_.stand_at(view.position), all_paths_.data(), all_ends_.data()});
  }
  // The pixels that are traced, and their paths, one after the other.
  index_t choose(light_kernels::scene_view const& scene, mirror_pixels which) {
    index_t const n = static_cast<index_t>(all_ends_.size());
    traced_.resize(n), places_.resize(std::size_t{n} + 1);
    parallel_for(*exec_, "light/mirrors", n,
                 light_kernels::find_mirrors{scene, all_paths_.data(), all_ends_.data(), which == mirror_pixels::all,
                                             traced_.data()});
    span<u32> const places = places_.view();
    exclusive_scan(*exec_, span<u32 const>(traced_), places.subspan(0, n), places.subspan(n, 1));
    u32 count = 0;
    exec_->copy_out(&count, places_.data() + n, sizeof count);
    paths_.resize(count), ends_.resize(count), pixels_.resize(count);
    parallel_for(*exec_, "light/mirrors", n,
                 light_kernels::take_pixels{all_paths_.data(), all_ends_.data(), traced_.data(), places_.data(),
                                            paths_.data(), ends_.data(), pixels_.data()});
    return count;
  }
  void zero(gaussians_view<float> const& g) {
    for_each_array(
        [&](parameter_array const& a, float* values) {
          exec_->zero(values, std::size_t{a.width(g.sh_degree)} * g.count * sizeof(float));
        },
        g);
  }
  void add(gaussians_view<float> const& to, gaussians_view<float> const& from) {
    for_each_array(
        [&](parameter_array const& a, float* sums, float const* more) {
          parallel_for(*exec_, "light/add", static_cast<index_t>(std::size_t{a.width(to.sh_degree)} * to.count),
                       light_kernels::add_floats{more, sums});
        },
        to, from);
  }

  E* exec_;
  light_kernels::placed_scene<E> placed_;
  ray_tracer<E, Response> tracer_;
  gaussians_view<float const> model_;
  int active_degree_ = 0;
  bool shades_ = false, first_band_ = false;          // Gaussians, of the last forward
  buffer<light_kernels::path, E> all_paths_, paths_;  // of the view, and those that are traced
  buffer<light_kernels::path_hit, E> all_ends_, ends_;
  buffer<u32, E> traced_, places_, pixels_;
  buffer<light_kernels::shadow_ray, E> shadows_;
  buffer<vec3, E> factors_;  // [N], of Gaussians in shadow
  buffer<float, E> shaded_;  // their coefficients
  std::vector<std::unique_ptr<segment>> segments_;
  buffer<vec3, E> by_seen_;
  buffer<float, E> by_color_, by_transmittance_;
  std::unique_ptr<gaussians<E>> of_batch_;
  std::size_t size_ = 0;  // pixels of the view
};

}}  // namespace gart::GART_ISA
