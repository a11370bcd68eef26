#pragma once
/// \file
/// Rays among actors that move, exact: each ray sees each actor as it stands at the ray's own time.
///
///   actor_tracer<E> tracer(exec);
///   tracer.set({street, car}, {instance_track({0}), {{0.0, 0.1}, {{1, axes, here}, {1, axes, there}}}});
///   tracer.trace(rays, options, {.color = color, .median = range});          // rays.times: [R]
///   auto const context = tracer.forward(rays, options, {.color = color});
///   tracer.backward(context, {by_color, by_depth}, {by_models, by_keys}, {.directions = by_direction});
///
/// Each model has a tree in its own frame, built once, whatever moves. A batch is moved into each actor's frame
/// (actors/moved_rays.hpp) and its hits there are listed (rays/ray_tracer.hpp). The lists are merged in order
/// (actors/merged_hits.hpp), and composited as a batch's. Gaussians are numbered actor after actor. Actors that all
/// stand at the world's origin, in its axes, give the bits of one scene of all Gaussians.
///
/// Memory beside the trees: 32 bytes a hit of all actors, 44 a ray. A context has 24 a hit, 20 a ray and 8 a ray and
/// actor. Cost: what a batch costs, two traces of lists, for each actor, whether rays meet it or not. Then the sort of
/// the hits. Backward costs the moved rays again and, by model, the sort and sums of gradient_form::primitive. Features
/// are not shown here. Errors: invalid_argument as rays/ray_batch.hpp and instances/instance_track.hpp have it, and for
/// times that a track does not cover.

#include <gart/actors/actor_gradient.hpp>
#include <gart/actors/merged_hits.hpp>
#include <gart/instances/instance_set.hpp>
#include <gart/rays/ray_tracer.hpp>

#include <deque>

namespace gart { inline namespace GART_ISA {

/// Where gradients go, in memory of the policy; empty or null where they are not wanted. All are overwritten.
struct actor_gradients {
  span<gaussians_view<float> const> models = {};  ///< of each, of its size and degree: summed over its actors
  /// [keys of all tracks][6], track after track: dL/d position in world units, then dL/dw. Here w is a small turn of
  /// the key's pose about its position.
  float* keys = nullptr;
};

/// An actor's part of it: its hits, and how rays met it.
template <execution E>
struct listed_actor {
  actor_view view;         ///< as the batch saw it
  buffer<u64, E> offsets;  ///< [R + 1]: of each ray's hits
  u64 base = 0;            ///< place of the first
  u64 count = 0;           ///< hits
};

/// What a forward pass leaves for its backward pass. The rays and models are read again: their memory must stay.
template <execution E>
struct actor_context {
  /// Nothing yet.
  explicit actor_context(E& exec)
      : color(exec), transmittance(exec), depth(exec), ids(exec), entries(exec), depths(exec) {}

  ray_batch rays;                                ///< that were traced
  render_options options;                        ///< by which
  void const* tracer = nullptr;                  ///< whose it is
  u64 scene = 0;                                 ///< its number of the scene
  buffer<float, E> color, transmittance, depth;  ///< what was seen
  buffer<u32, E> ids;                            ///< of the hits, by place (actors/merged_hits.hpp)
  buffer<hit_entry, E> entries;                  ///< by place
  buffer<float, E> depths;                       ///< by place
  std::vector<listed_actor<E>> actors;           ///< each
};

/// Traces batches of rays among actors.
template <execution E, class Response = generalized_gaussian<>>
class actor_tracer {
 public:
  /// Allocates nothing; `exec` must outlive it.
  explicit actor_tracer(E& exec)
      : exec_(&exec), steps_(exec), moved_(exec), merged_(exec), back_(exec), spare_(exec, 0, 0) {}

  /// Models, whose arrays must stay, and who moves where; again where either has changed. What was made of a model that
  /// is the same stays.
  void set(std::vector<gaussians_view<float const>> models, std::vector<instance_track> actors) {
    if (actors.empty()) throw invalid_argument("actor_tracer.set: there are no actors: a scene needs at least one");
    std::size_t count = 0;
    for (std::size_t a = 0; a < actors.size(); ++a) {
      require_track(actors[a], models.size(), "actors[" + std::to_string(a) + "]");
      count += models[actors[a].poses[0].model].count;
    }
    require_count(count);
    for (std::size_t m = 0; m < models.size(); ++m) {
      if (m == tracers_.size()) tracers_.emplace_back(*exec_);
      tracers_[m].set_scene(models[m], models[m].sh_degree);
    }
    models_ = std::move(models), actors_ = std::move(actors), ++number_;
    firsts_.assign(1, 0), first_steps_.assign(1, 0);
    std::vector<track_step> all;
    for (instance_track const& track : actors_) {
      std::vector<track_step> const own = track.steps();
      all.insert(all.end(), own.begin(), own.end());
      first_steps_.push_back(static_cast<u32>(all.size()));
      firsts_.push_back(firsts_.back() + models_[track.poses[0].model].count);
    }
    steps_.assign(all);
    host_steps_ = std::move(all);
  }

  /// What the rays see, to the targets that are wanted.
  void trace(ray_batch const& rays, render_options const& options, batch_targets const& out) {
    require_no_features(out);
    merge(rays, options, nullptr);
    parallel_for(
        *exec_, "actors/forward", rays.count(),
        actor_kernels::composite_merged<keep_none>{merged_.view(), program<keep_none>(rays, options, out, {})});
  }
  /// Their hits, exact and complete: up to the end of the ray, or to where options end it.
  hit_table<E> list(ray_batch const& rays, render_options const& options) {
    merge(rays, options, nullptr);
    hit_table<E> out(*exec_);
    out.list(*exec_, rays.count(), options.transmittance_min, options.max_hits, false,
             [&](char const* label, hit_writer const& to) {
               parallel_for(*exec_, label, rays.count(),
                            actor_kernels::list_merged{merged_.view(), {{}, batch_rays(rays), to}});
             });
    return out;
  }
  /// What the rays see, and what backward() needs of it.
  actor_context<E> forward(ray_batch const& rays, render_options const& options, batch_targets const& out = {}) {
    require_no_features(out);
    actor_context<E> context(*exec_);
    merge(rays, options, &context.actors);
    context.rays = rays, context.options = options, context.tracer = this, context.scene = number_;
    index_t const n = rays.count();
    context.color.resize(std::size_t{3} * n), context.transmittance.resize(n), context.depth.resize(n);
    context.ids.resize(merged_.count()), context.entries.resize(merged_.count());
    context.depths.resize(merged_.count());
    exec_->copy(context.ids.data(), merged_.ids().data(), sizeof(u32) * merged_.count());
    batch_targets seen = out;
    seen.color = context.color.data(), seen.transmittance = context.transmittance.data();
    seen.depth = context.depth.data();
    parallel_for(*exec_, "actors/forward", n,
                 actor_kernels::composite_merged<keep_by_place>{
                     merged_.view(),
                     program<keep_by_place>(rays, options, seen, {context.entries.data(), context.depths.data()})});
    auto const copy = [&](float* to, buffer<float, E> const& from) {
      if (to) exec_->copy(to, from.data(), from.size() * sizeof(float));
    };
    copy(out.color, context.color), copy(out.transmittance, context.transmittance), copy(out.depth, context.depth);
    return context;
  }

  /// From dL/d what the rays saw to models, keys and rays. May be called again.
  void backward(actor_context<E> const& context, output_gradients const& by, actor_gradients const& to,
                ray_gradient_targets const& of_rays = {}) {
    stage_scope stage(*exec_, "actors backward");
    require_gradients(context, by, to);
    back_.begin(context.rays, context.color.data(), context.depth.data(), context.transmittance.data(), by, of_rays);
    std::vector<bool> written(models_.size(), false);
    u32 first_key = 0;
    for (std::size_t a = 0; a < actors_.size(); ++a) {
      listed_actor<E> const& seen = context.actors[a];
      u32 const m = actors_[a].poses[0].model, keys = static_cast<u32>(actors_[a].poses.size());
      gaussians_view<float> const target = to.models.empty() ? gaussians_view<float>{} : to.models[m];
      bool const again = target.mean && written[m];
      if (again && (spare_.size() != target.count || spare_.sh_degree() != target.sh_degree))
        spare_ = gaussians<E>(*exec_, target.count, target.sh_degree);
      back_.add(seen.view,
                {seen.offsets.data(), seen.base, firsts_[a], context.ids.data(), context.entries.data(),
                 context.depths.data()},
                seen.count, models_[m], context.options.alpha_min, again ? spare_.view() : target,
                to.keys ? to.keys + std::size_t{6} * first_key : nullptr, keys);
      if (again) add(target);
      written[m] = true, first_key += keys;
    }
    back_.end();
    for (std::size_t m = 0; m < to.models.size(); ++m)
      if (to.models[m].mean && !written[m])
        for_each_array(
            [&](parameter_array const& a, float* values) {
              exec_->zero(values, sizeof(float) * a.width(to.models[m].sh_degree) * to.models[m].count);
            },
            to.models[m]);
  }

  /// Whose Gaussian `id` is: of an actor, in place of an instance.
  instance_gaussian of(u32 id) const {
    auto const next = std::upper_bound(firsts_.begin(), firsts_.end(), id);
    return {static_cast<u32>(next - firsts_.begin() - 1), id - *(next - 1)};
  }
  /// Who moves where.
  std::vector<instance_track> const& actors() const { return actors_; }

 private:
  color_rows colors(u32 m) const { return {models_[m].sh, models_[m].sh_degree, models_[m].sh_degree}; }
  template <class Keep>
  static batch_composite<Keep> program(ray_batch const& rays, render_options const& options, batch_targets const& out,
                                       Keep const& keep) {
    // Colours of hits are there.
    return {{}, batch_rays(rays), {}, options, out, keep};
  }

  // All actors' hits, in order.
  void merge(ray_batch const& rays, render_options const& options, std::vector<listed_actor<E>>* keep) {
    stage_scope stage(*exec_, "actors");
    if (number_ == 0) throw invalid_argument("actor_tracer: there are no actors; call actor_tracer.set first");
    require_batch(rays);
    require_options(options);
    require_rays(*exec_, rays, options.near);
    require_times(*exec_, rays, actors_);
    float time = 0;
    if (rays.count() > 0 && !rays.times.empty()) exec_->copy_out(&time, rays.times.data(), sizeof time);
    merged_.begin(rays.count());
    for (std::size_t a = 0; a < actors_.size(); ++a) {
      actor_view const view = view_of(a, rays, time);
      u32 const m = actors_[a].poses[0].model;
      render_options own = options;
      own.near = options.near / static_cast<float>(view.scale);
      moved_.move(*exec_, rays, view);
      hit_table<E> list = tracers_[m].list(moved_.batch(), own);
      u64 const base = merged_.count(), count = list.ids.size();
      merged_.append(*exec_, list, moved_.batch(), colors(m), view.scale, firsts_[a]);
      if (keep) keep->push_back({view, std::move(list.offsets), base, count});
    }
    merged_.sort(*exec_);
  }
  // `time`: of the first ray, about which the others' lie.
  actor_view view_of(std::size_t a, ray_batch const& rays, float time) const {
    instance_track const& track = actors_[a];
    actor_view out{host_steps_.data() + first_steps_[a],
                   first_steps_[a + 1] - first_steps_[a],
                   track.moves() ? &time : nullptr,
                   track.poses[0].scale,
                   rays.frame,
                   vec3d(0.0)};
    out.origin = out.frame_at(out.at(0));
    out.steps = steps_.data() + first_steps_[a], out.times = track.moves() ? rays.times.data() : nullptr;
    return out;
  }
  // To gradients that another actor of the model has written.
  void add(gaussians_view<float> const& to) {
    for_each_array(
        [&](parameter_array const& a, float const* from, float* sums) {
          parallel_for(*exec_, "actors/add", to.count * static_cast<index_t>(a.width(to.sh_degree)),
                       instance_kernels::add_numbers{from, true, sums});
        },
        std::as_const(spare_).view(), to);
  }

  static void require_no_features(batch_targets const& out) {
    if (out.channels.any())
      throw invalid_argument("actor_tracer: batch_targets.channels asks for features, which it does not show");
  }
  void require_gradients(actor_context<E> const& context, output_gradients const& by, actor_gradients const& to) const {
    auto const refuse = [](std::string const& what) { throw invalid_argument("actor_tracer.backward: " + what); };
    if (context.tracer != this) refuse("the context is of another tracer");
    if (context.scene != number_) refuse("actor_tracer.set was called since forward(); call forward() again");
    gart::require_gradients(by, context.rays.count(), "actor_tracer.backward");
    if (by.channels.any()) refuse("output_gradients.channels is of features, which it does not show");
    if (!to.models.empty() && to.models.size() != models_.size())
      refuse("actor_gradients.models has " + std::to_string(to.models.size()) + " models, and there are " +
             std::to_string(models_.size()));
    for (std::size_t m = 0; m < to.models.size(); ++m)
      if (to.models[m].mean &&
          (to.models[m].count != models_[m].count || to.models[m].sh_degree != models_[m].sh_degree))
        refuse("actor_gradients.models[" + std::to_string(m) +
               "] must have the number and the SH degree of the model's Gaussians");
  }

  E* exec_;
  std::vector<gaussians_view<float const>> models_;
  std::vector<instance_track> actors_;
  u64 number_ = 0;                   // of the scene; 0: none
  std::vector<u32> firsts_{0};       // [actors + 1]: Gaussian among all
  std::vector<u32> first_steps_{0};  // [actors + 1]
  std::vector<track_step> host_steps_;
  buffer<track_step, E> steps_;
  std::deque<ray_tracer<E, Response>> tracers_;  // of the models
  moved_rays<E> moved_;
  merged_hits<E> merged_;
  actor_gradient<E, Response> back_;
  gaussians<E> spare_;
};

}}  // namespace gart::GART_ISA
