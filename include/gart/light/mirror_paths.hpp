#pragma once
/// \file
/// A view with mirrors in it, and the gradients of its Gaussians: those before a mirror and those that it shows.
/// Nothing is drawn at random: a ray goes through the middle of each pixel, and on from mirrors alone. Any other
/// surface ends it with what it emits.
///
///   mirror_paths<E> paths(exec);
///   paths.set_scene(scene);
///   paths.set_model(gaussians.view(), sh_degree);
///   paths.forward(view, options, bounces, color);
///   paths.backward(by_color, gradients.view());
///
/// Or of the pixels alone that meet a mirror first: a trainer shows the others. Its loss sees both in one image
/// (forward), takes the gradient out of the pixels of mirrors (take_out), and adds what it comes to before the
/// optimizer's step (backward, with_what::there_is). train/learned/mirrors.hpp trains so.
///
/// With C and T what a segment's Gaussians add and let through, and b a mirror's colour, a path from segment k on has
///   L_k = C_k + T_k B_k,   B_k = b_k L_(k + 1) at a mirror, else what shines there;
/// each segment is a batch of rays (rays/ray_tracer.hpp), whose context has the gradients by its C and its T. Where a
/// Gaussian's largest response crosses a mirror, it goes from one segment to the next: a step that has no gradient.
///
/// Memory: 100 bytes a pixel and segment, what contexts hold, and the gradients of a second model.
/// Errors: invalid_argument as ray_tracer, path_tracer and calls out of order have it.

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
    model_ = model;
    tracer_.set_scene(model, active_degree);
  }

  /// To `color`, [H][W][3] in memory of the policy: pixels that are not traced stay as they are.
  void forward(camera const& view, render_options const& options, int bounces, float* color,
               mirror_pixels which = mirror_pixels::all) {
    require_camera(view);
    cast(view, options);
    light_kernels::scene_view const& scene = placed_.stand_at(view.position);
    index_t const n = choose(scene, which);
    segments_.clear();
    for (int k = 0; n > 0 && k <= bounces; ++k) {
      auto& s = *segments_.emplace_back(std::make_unique<segment>(*exec_, n));
      render_options alone = options;
      alone.background = vec3(0.0f);
      if (k > 0) {
        alone.near = 1e-6f;
        parallel_for(*exec_, "light/triangles", n, light_kernels::end_segments{scene, paths_.data(), ends_.data()});
      }
      parallel_for(*exec_, "light/mirrors", n,
                   light_kernels::follow_mirrors{scene, paths_.data(), ends_.data(), options.background, alone.near,
                                                 s.origins.data(), s.directions.data(), s.t_max.data(), s.share.data(),
                                                 s.behind.data(), k == bounces});
      s.context = tracer_.forward({view.position, s.origins, s.directions, s.t_max}, alone);
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

  /// From dL/d colour, [H][W][3] of the last forward, to dL/d Gaussians, of their number and at least the degree that
  /// is evaluated. There are gradients that it is added to, or it takes their place.
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
      parallel_for(*exec_, "light/mirrors", n,
                   light_kernels::split_gradient{s.context.transmittance.data(), s.share.data(), s.behind.data(),
                                                 by_seen_.data(), by_color_.data(), by_transmittance_.data()});
      output_gradients by;
      by.color = by_color_, by.transmittance = by_transmittance_;
      if (!of_segment_ || of_segment_->sh_degree() != gradients.sh_degree)
        of_segment_ = std::make_unique<gaussians<E>>(*exec_, 0, gradients.sh_degree);
      of_segment_->resize_keep(model_.count);
      of_segment_->zero();
      tracer_.backward(s.context, by, of_segment_->view());
      add(gradients, of_segment_->view());
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
  struct segment {
    segment(E& exec, index_t n)
        : origins(exec, std::size_t{3} * n),
          directions(exec, std::size_t{3} * n),
          t_max(exec, n),
          share(exec, n),
          behind(exec, n),
          seen(exec, n),
          context(exec) {}
    buffer<float, E> origins, directions, t_max;
    buffer<vec3, E> share, behind, seen;
    batch_context<E> context;
  };

  void require_begun(std::size_t size, char const* call) const {
    if (size_ == 0) throw invalid_argument(std::string(call) + ": there is no view; call forward first");
    if (size != 3 * size_)
      throw invalid_argument(std::string(call) + ": the gradient has " + std::to_string(size) +
                             " numbers, and the view has " + std::to_string(size_) + " pixels of three");
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
  buffer<light_kernels::path, E> all_paths_, paths_;  // of the view, and those that are traced
  buffer<light_kernels::path_hit, E> all_ends_, ends_;
  buffer<u32, E> traced_, places_, pixels_;
  std::vector<std::unique_ptr<segment>> segments_;
  buffer<vec3, E> by_seen_;
  buffer<float, E> by_color_, by_transmittance_;
  std::unique_ptr<gaussians<E>> of_segment_;
  std::size_t size_ = 0;  // pixels of the view
};

}}  // namespace gart::GART_ISA
