#pragma once
/// \file
/// Any rays through a model, on every policy: what they see and their hits. The gradients of both go to the Gaussians
/// and to the rays.
///
///   ray_tracer<E> tracer(exec);
///   tracer.set_scene(scene.view(), sh_degree);                          // again where the Gaussians may have changed
///   tracer.trace(rays, options, {.color = color, .median = range});     // or
///   auto context = tracer.forward(rays, options, {.color = color});     // the same, and what the gradient needs
///   tracer.backward(context, {by_color, by_depth}, gradients.view(), {.directions = by_direction});
///
/// One tree serves all batches until the Gaussians change (rays/world_index.hpp), and several tracers
/// (rays/shared_index.hpp has the rule of threads). Hits, their order and what they add
/// up to are those of an image's pixels. `options.antialias` must be 0, since rays have no pixels to filter by.
/// `options.rows` is not looked at.
///
/// Features (channels/) are shown and differentiated over hit lists: a second trace, and 16 or 40 bytes a hit.
///
/// Memory beside the tree: 64 bytes a Gaussian, with gradients 48 more; 12 bytes a ray, and 32 that a context holds.
/// Hits that are kept by gradient_form::primitive take 32 each, and 16 places at a time a ray. Cost: the tree on the
/// first batch after a change. A batch in another frame than the last one's costs one launch over the Gaussians. Then
/// comes the trace. Checks wait for the policy once a batch. Errors: invalid_argument as rays/ray_batch.hpp has it, and
/// for options that nothing can be traced by. The same for a context of Gaussians that have changed. Also out_of_memory
/// for more than 2^32 hits kept at a time.

#include <gart/backward/finish.hpp>
#include <gart/channels/passes.hpp>
#include <gart/rays/batch_gather.hpp>
#include <gart/rays/batch_lists.hpp>
#include <gart/rays/shared_index.hpp>
#include <gart/render/frame.hpp>

#include <algorithm>

namespace gart { inline namespace GART_ISA {

/// What a forward pass leaves for its backward pass. The rays are read again: their memory must stay.
template <execution E>
struct batch_context {
  /// Nothing yet.
  explicit batch_context(E& exec)
      : color(exec), transmittance(exec), depth(exec), kept(exec), hits(exec), listed(exec) {}

  ray_batch rays;                                ///< that were traced
  render_options options;                        ///< by which
  gradient_form form = gradient_form::scatter;   ///< how gradients of Gaussians are summed
  void const* tracer = nullptr;                  ///< whose it is
  u64 scene = 0;                                 ///< its number of the scene
  buffer<float, E> color, transmittance, depth;  ///< what was seen
  kept_batch<E> kept;                            ///< hits, of gradient_form::primitive
  gaussian_channels channels;                    ///< that could be shown
  buffer<u32, E> hits;                           ///< of each ray, where there are channels
  hit_table<E> listed;                           ///< all hits, where they are wanted
  bool is_listed = false;                        ///< they are there
};

/// Traces batches of rays.
template <execution E, class Response = generalized_gaussian<>>
class ray_tracer {
 public:
  /// Allocates nothing; `exec` must outlive it.
  explicit ray_tracer(E& exec)
      : exec_(&exec),
        index_(exec),
        order_(exec),
        print_(exec),
        gaussians_(exec),
        moments_(exec),
        differentiated_(exec),
        gather_(exec),
        counts_(exec),
        listed_(exec),
        channels_backward_(exec),
        lists_(exec) {}

  /// The Gaussians, of any SH degree, whose arrays must stay; bands above active_degree are not evaluated. Where they
  /// are the same as before, what was made of them is kept.
  void set_scene(gaussians_view<float const> scene, int active_degree) {
    if (scene.sh_degree < 0 || scene.sh_degree > color_rows::most || active_degree < 0 ||
        active_degree > scene.sh_degree)
      throw invalid_argument("ray_tracer.set_scene: the SH degree is not from 0 to 3, or less than what is evaluated");
    u64 const print = print_.of(*exec_, scene);
    if (number_ == 0 || print != scene_print_ || scene.count != scene_.count || active_degree != active_degree_)
      ++number_, index_is_old_ = records_are_old_ = true;
    scene_ = scene, scene_print_ = print, active_degree_ = active_degree, channels_ = {};
  }
  /// What the Gaussians have besides, in arrays that must stay; none until the next call of either.
  void set_channels(gaussian_channels const& channels) {
    require_channels(channels, scene_.count, "ray_tracer.set_channels");
    channels_ = channels;
  }

  /// A tree to trace by where it is that of the Gaussians; null: none. It must stay until another is given.
  void share(shared_index<E, Response> const* tree) { shared_ = tree; }

  /// What the rays see, to the targets that are wanted.
  void trace(ray_batch const& rays, render_options const& options, batch_targets const& out) {
    require_channels(channels_, out.channels, "ray_tracer.trace");
    prepare(rays, options);
    batch_targets seen = out;
    if (out.channels.any() && !out.hits) counts_.resize(rays.count()), seen.hits = counts_.data();
    launch("rays/forward", rays, composite_of<keep_none>(rays, options, seen, {}));
    if (!out.channels.any()) return;
    list(listed_, rays, options, false, {seen.hits, rays.count()});
    sum_channels(*exec_, listed_, channels_, out.channels);
  }

  /// Their hits, exact and complete: up to the end of the ray, or to where options end it.
  hit_table<E> list(ray_batch const& rays, render_options const& options) {
    prepare(rays, options);
    hit_table<E> out(*exec_);
    list(out, rays, options, false);
    return out;
  }

  /// What the rays see, and what backward() needs of it.
  batch_context<E> forward(ray_batch const& rays, render_options const& options, batch_targets const& out = {},
                           gradient_form form = gradient_form::primitive) {
    require_channels(channels_, out.channels, "ray_tracer.forward");
    prepare(rays, options);
    batch_context<E> context(*exec_);
    context.rays = rays, context.options = options, context.form = form;
    context.tracer = this, context.scene = number_, context.channels = channels_;
    index_t const n = rays.count();
    context.color.resize(std::size_t{3} * n), context.transmittance.resize(n), context.depth.resize(n);
    batch_targets seen = out;
    seen.color = context.color.data(), seen.transmittance = context.transmittance.data();
    seen.depth = context.depth.data();
    if (channels_.features.width > 0 && !out.hits) context.hits.resize(n), seen.hits = context.hits.data();
    if (form == gradient_form::primitive)
      keep(context, seen);
    else
      launch("rays/forward", rays, composite_of<keep_none>(rays, options, seen, {}));
    auto const copy = [&](float* to, buffer<float, E> const& from) {
      if (to) exec_->copy(to, from.data(), from.size() * sizeof(float));
    };
    copy(out.color, context.color), copy(out.transmittance, context.transmittance), copy(out.depth, context.depth);
    if (out.channels.any()) {
      list(context.listed, rays, options, true, {seen.hits, n});
      context.is_listed = true;
      sum_channels(*exec_, context.listed, context.channels, out.channels);
    }
    return context;
  }

  /// From dL/d what the rays saw to dL/d the Gaussians and dL/d the rays. Gradients of Gaussians are overwritten, and
  /// are of at least the degree that is evaluated. They are left out where there are no arrays. May be called again.
  void backward(batch_context<E>& context, output_gradients const& by, gaussians_view<float> gradients,
                ray_gradient_targets const& of_rays = {}, channel_gradient_targets const& of_channels = {}) {
    stage_scope stage(*exec_, "rays backward");
    if (context.tracer != this) throw invalid_argument("ray_tracer.backward: the context is of another tracer");
    if (context.scene != number_)
      throw invalid_argument("ray_tracer.backward: the Gaussians have changed since forward(); call it again");
    index_t const n = context.rays.count();
    require_gradients(by, n, "ray_tracer.backward");
    require_channels(context.channels, by.channels, of_channels, n, "ray_tracer.backward");
    bool const of_gaussians = gradients.mean != nullptr;
    if (of_gaussians && (gradients.count != scene_.count || gradients.sh_degree < active_degree_ ||
                         gradients.sh_degree > color_rows::most))
      throw invalid_argument(
          "ray_tracer.backward: the gradients must have the number of the Gaussians and at least the SH degree that is "
          "evaluated");
    stand_at(context.rays.frame, context.options);
    auto const or_null = [](span<float const> s) { return s.empty() ? nullptr : s.data(); };
    differentiated_.resize(n);
    parallel_for(*exec_, "rays/read", n,
                 ray_kernels::gather_rays{batch_rays(context.rays), context.color.data(), context.depth.data(),
                                          context.transmittance.data(), or_null(by.color), or_null(by.depth),
                                          or_null(by.transmittance), differentiated_.data()});
    bool const gathers = of_gaussians && context.form == gradient_form::primitive;
    bool const scatters = of_gaussians && !gathers;
    if (of_gaussians) moments_.resize(std::size_t{moment_stride} * scene_.count);
    if (gathers) gather_(*exec_, context.kept, differentiated_, gaussians_, active_degree_, gradients, moments_);
    if (scatters) {
      moments_.zero();
      exec_->zero(gradients.sh, sizeof(float) * scene_.count * static_cast<std::size_t>(gradients.sh_stride()));
    }
    if (scatters || of_rays.origins || of_rays.directions)
      launch("rays/scatter", context.rays,
             batch_scatter<Response, E>{{},
                                        batch_rays(context.rays),
                                        differentiated_.data(),
                                        colors(),
                                        context.options.transmittance_min,
                                        context.options.max_hits,
                                        gaussians_.data(),
                                        gradients.sh_stride(),
                                        scatters ? gradients.sh : nullptr,
                                        moments_.data(),
                                        of_rays},
             context.options.near);
    if (by.channels.any() || of_channels.any()) differentiate_channels(context, by, of_gaussians, of_rays, of_channels);
    if (of_gaussians) finish_gradients(*exec_, scene_, gaussians_, camera{}, 0, moments_, gradients);
  }

  /// The tree that batches are traced by.
  world_index<E, Response> const& index() const { return shares_ ? shared_->index() : index_; }

 private:
  color_rows colors() const { return {scene_.sh, scene_.sh_degree, active_degree_}; }
  template <class Keep>
  batch_composite<Keep> composite_of(ray_batch const& rays, render_options const& options, batch_targets const& out,
                                     Keep const& keep) const {
    return {{}, batch_rays(rays), colors(), options, out, keep};
  }
  template <class P>
  void launch(char const* label, ray_batch const& rays, P const& program, float near) {
    trace_batch<Response>(*exec_, label, index().seen_from(rays.frame), {gaussians_.data(), scene_.count, near},
                          rays.count(), order_, program);
  }
  template <class P>
  void launch(char const* label, ray_batch const& rays, P const& program) {
    launch(label, rays, program, near_);
  }

  void prepare(ray_batch const& rays, render_options const& options) {
    if (number_ == 0) throw invalid_argument("ray_tracer: there are no Gaussians; call ray_tracer.set_scene first");
    require_batch(rays);
    require_options(options);
    if (options.antialias != 0)
      throw invalid_argument("render_options.antialias must be 0 where a batch is traced: rays have no pixels");
    require_rays(*exec_, rays, options.near);
    near_ = options.near;
    stand_at(rays.frame, options);
    world_view const tree = index().seen_from(rays.frame);
    order_.make(*exec_, rays, tree.tree, tree.shift);
  }
  // The tree over the Gaussians as they are, and the Gaussians in that frame.
  void stand_at(vec3d const& frame, render_options const& options) {
    shares_ = shared_ && shared_->fits(scene_print_, scene_.count, options.alpha_min);
    bool const other_boxes = index_.count() != scene_.count || index_.alpha_min() != options.alpha_min;
    if (!shares_ && (index_is_old_ || other_boxes)) {
      stage_scope stage(*exec_, "rays index");
      if (other_boxes || ++age_ >= options.rebuild_every) {
        index_.build(*exec_, scene_, options.alpha_min, frame);
        age_ = 0;
      } else {
        index_.refit(*exec_, scene_);
      }
      index_is_old_ = false;
    }
    prepare_gaussians(frame, options.alpha_min);
  }
  void prepare_gaussians(vec3d const& frame, float alpha_min) {
    if (!records_are_old_ && frame == frame_ && alpha_min == alpha_min_) return;
    frame_ = frame, alpha_min_ = alpha_min;
    gaussians_.resize(scene_.count);
    parallel_for(*exec_, "rays/preprocess", scene_.count,
                 render_kernels::prepare_gaussians<Response>{scene_, frame, alpha_min, gaussians_.view()});
    records_are_old_ = false;
  }

  // `counts`: of hits, where they are known.
  void list(hit_table<E>& to, ray_batch const& rays, render_options const& options, bool differentiable,
            span<u32 const> counts = {}) {
    lists_(
        *exec_, to, rays, options, differentiable,
        [&](char const* label, auto const& program) { launch(label, rays, program, options.near); }, counts);
  }
  // Adds to the moments and to the gradients of rays.
  void differentiate_channels(batch_context<E>& context, output_gradients const& by, bool of_gaussians,
                              ray_gradient_targets const& of_rays, channel_gradient_targets const& to) {
    if (!context.is_listed) list(context.listed, context.rays, context.options, true);
    context.is_listed = true;
    bool const rays_too = of_rays.origins || of_rays.directions;
    if (by.channels.any() && !by.channels.detached && (of_gaussians || rays_too)) {
      channels_backward_.begin(context.listed);
      weigh_channels(channels_backward_, context.channels, by.channels);
      if (of_gaussians) channels_backward_.add_moments(context.listed, gaussians_, moments_);
      if (rays_too)
        parallel_for(*exec_, "rays/channels", context.rays.count(),
                     ray_kernels::add_channels<Response>{batch_rays(context.rays), context.listed.view(),
                                                         channels_backward_.by_alpha(), channels_backward_.alongs(),
                                                         gaussians_.data(), of_rays});
    }
    pull_channels(*exec_, channels_backward_, context.listed, context.channels, by.channels, to);
  }

  // The forward pass with its hits, once more where there was no room for them.
  void keep(batch_context<E>& context, batch_targets const& out) {
    kept_batch<E>& kept = context.kept;
    index_t const n = context.rays.count();
    kept.offsets.resize(n);
    u64 room = hit_runs<E>::room_for(n, per_ray_);
    for (;;) {
      kept.ids.resize(room), kept.hits.resize(room);
      launch("rays/forward", context.rays,
             composite_of<keep_hits<E>>(context.rays, context.options, out,
                                        {kept.runs.begin(n, room), kept.ids.data(), kept.hits.data()}));
      exclusive_scan(*exec_, span<u32 const>(kept.runs.counts), kept.offsets.view(),
                     kept.runs.used.view().subspan(1, 1));
      u64 used[2];
      exec_->copy_out(used, kept.runs.used.data(), sizeof used);
      kept.taken = used[0], kept.count = used[1];
      if (kept.taken >= 0xffffffffu)
        throw out_of_memory("hit", kept.taken * 44, 0,
                            "more than 2^32 hits of a batch: trace fewer rays at a time, or by gradient_form::scatter");
      if (kept.taken <= room) break;
      room = kept.taken;
    }
    if (n > 0) per_ray_ = static_cast<double>(kept.taken) / n;
  }

  E* exec_;
  gaussians_view<float const> scene_;
  int active_degree_ = 0;
  u64 number_ = 0;       // of the scene; 0: none
  u64 scene_print_ = 0;  // of its parameters
  world_index<E, Response> index_;
  shared_index<E, Response> const* shared_ = nullptr;
  bool shares_ = false;  // the last batch was traced by it
  ray_order<E> order_;   // of the last batch; of as many rays it is one too
  fingerprint<E> print_;
  bool index_is_old_ = true, records_are_old_ = true;
  int age_ = 0;
  float near_ = 0;
  buffer<ray_gaussian, E> gaussians_;  // in frame_, hit from alpha_min_
  vec3d frame_{0.0};
  float alpha_min_ = 0;
  buffer<float, E> moments_;
  buffer<differentiated_ray, E> differentiated_;
  batch_gather<E, Response> gather_;
  gaussian_channels channels_;
  buffer<u32, E> counts_;
  hit_table<E> listed_;
  channel_gradient<E, Response> channels_backward_;
  batch_lists<E> lists_;
  double per_ray_ = 0;  // places that the last batch took to keep hits
};

}}  // namespace gart::GART_ISA
