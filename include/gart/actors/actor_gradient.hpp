#pragma once
/// \file
/// The backward pass of rays among actors. In an actor's frame its hits are those of a batch whose rays are moved. What
/// they say of its model is summed as a batch's (rays/batch_gather.hpp). What they say of each ray's origin and
/// direction is summed here. The ray and the pose take their share by the equations of actors/moved_rays.hpp. The keys
/// of a track take theirs of the pose by track_step::pull_back_to_end. A distance t of the world is t / s there, and
/// its gradient s times that. Nothing is atomic: the same bits in every run.
///
/// Memory: 16 bytes a hit, 100 a ray for the keys of a track, and 96 a piece of 64 rays.

#include <gart/actors/moved_rays.hpp>
#include <gart/algorithm/sort_pairs.hpp>
#include <gart/backward/finish.hpp>
#include <gart/channels/gaussian_order.hpp>
#include <gart/rays/batch_gather.hpp>
#include <gart/render/frame.hpp>

#include <bit>

namespace gart { inline namespace GART_ISA {

/// An actor's hits where they were appended (actors/merged_hits.hpp): those of ray r are at base + [offsets[r],
/// offsets[r + 1]). Trivially copyable.
struct actor_hits_view {
  u64 const* offsets = nullptr;        ///< [R + 1]
  u64 base = 0;                        ///< its first place
  u32 first = 0;                       ///< its first Gaussian among all
  u32 const* ids = nullptr;            ///< by place: the Gaussian, among all
  hit_entry const* entries = nullptr;  ///< by place: as the forward pass kept them
  float const* depths = nullptr;       ///< by place: the same
};

namespace actor_kernels {

// What gradients need of a ray, in the actor's frame.
struct move_differentiated {
  differentiated_ray const* rays;
  actor_view actor;
  differentiated_ray* out;
  GART_KERNEL void operator()(index_t i) const {
    differentiated_ray r = rays[i];
    ray const own = actor.moved(r.own(), actor.at(i));
    r.origin = own.origin, r.direction = own.direction;
    r.by_depth *= static_cast<float>(actor.scale);
    out[i] = r;
  }
};

// An actor's hits by place.
struct picked_hits {
  hit_entry const* entries;
  float const* depths;
  u32 const* rays;
  GART_HD kept_hit at(u32 place) const { return {entries[place], depths[place], 0, rays[place]}; }
};

// An actor's hits as those of a batch. The id of one that was not composited is past the last Gaussian.
struct pick_hits {
  actor_hits_view hits;
  float to_own;  // 1 / s
  u32 gaussians;
  u32 *ids, *places, *rays;
  float* depths;
  GART_KERNEL void operator()(index_t i) const {
    for (u64 k = hits.offsets[i]; k < hits.offsets[i + 1]; ++k) {
      u64 const place = hits.base + k;
      ids[k] = hits.entries[place].written() ? hits.ids[place] - hits.first : gaussians;
      places[k] = static_cast<u32>(k), rays[k] = i;
      depths[k] = hits.depths[place] * to_own;
    }
  }
};

inline constexpr int step_numbers = 12;  // dL/d the pose at a step's beginning, and at its end

// dL/d each ray, added to what other actors did, and dL/d the keys of its step.
template <class Response>
struct differentiate_moved {
  actor_hits_view hits;
  float to_own;
  differentiated_ray const* rays;   // in the actor's frame
  differentiated_ray const* world;  // in the batch's
  ray_gaussian const* records;
  color_rows colors;
  actor_view actor;
  ray_gradient_targets of_rays;
  u32* steps;     // [R]: of the track; step_count where the ray says nothing; null where poses are not wanted
  double* poses;  // [R][step_numbers]

  GART_KERNEL void operator()(index_t i) const {
    if (steps) steps[i] = actor.step_count;
    u64 const begin = hits.offsets[i], end = hits.offsets[i + 1];
    // Hits that were not composited lie behind those that were.
    if (begin == end || !hits.entries[hits.base + begin].written()) return;
    differentiated_ray const from = rays[i];
    sh_basis<color_rows::most> const basis(from.direction);
    vec3 by_origin(0.0f), by_direction(0.0f), by_turn(0.0f);
    for (u64 k = begin; k < end; ++k) {
      u64 const place = hits.base + k;
      hit_entry const entry = hits.entries[place];
      if (!entry.written()) break;
      u32 const id = hits.ids[place] - hits.first;
      ray_gaussian const gaussian = records[id];
      ray_peak const r = evaluate(gaussian, from.own());
      float const by_alpha = alpha_gradient_of<Response>(entry, hits.depths[place] * to_own, from, gaussian, r);
      float const by_depth = entry.weight() * from.by_depth;
      moments_of<float> const m = hit_moments_with_depth<Response>(gaussian, r, by_alpha, by_depth, true);
      ray_part const part = ray_part_of(gaussian, r, m, by_depth);
      by_origin += part.origin, by_direction += part.direction;
      by_turn += turn_by_color(colors, basis, id, color_gradient_of(entry, from.by_color));
    }
    by_direction += glm::cross(by_turn, from.direction);

    actor_view::placed const pose = actor.at(i);
    vec3d const by_o = pose.rotation * vec3d(by_origin) / actor.scale, by_d = pose.rotation * vec3d(by_direction);
    for (int c = 0; c < 3; ++c) {
      std::size_t const at = std::size_t{3} * i + static_cast<std::size_t>(c);
      if (of_rays.origins) of_rays.origins[at] += static_cast<float>(by_o[c]);
      if (of_rays.directions) of_rays.directions[at] += static_cast<float>(by_d[c]);
    }
    if (!steps) return;
    steps[i] = pose.step;
    vec3d const arm = actor.frame - pose.position + vec3d(world[i].origin), d(world[i].direction);
    vec3d const by_w = -(glm::cross(arm, by_o) + glm::cross(d, by_d));
    vec3d const at_end = actor.steps[pose.step].pull_back_to_end(pose.f, by_w);
    double* const to = poses + std::size_t{step_numbers} * i;
    for (int c = 0; c < 3; ++c) {
      to[c] = -by_o[c] * (1 - pose.f), to[3 + c] = by_w[c] - at_end[c];
      to[6 + c] = -by_o[c] * pose.f, to[9 + c] = at_end[c];
    }
  }
};

struct sum_steps {
  gaussian_order_view order;  // of rays, by step
  double const* poses;
  double* sums;  // [pieces][step_numbers]
  GART_KERNEL void operator()(index_t piece) const {
    double sum[step_numbers] = {};
    for (u32 k = order.firsts[piece]; k < order.end_of(piece); ++k)
      for (int c = 0; c < step_numbers; ++c)
        sum[c] += poses[std::size_t{step_numbers} * order.places[k] + static_cast<std::size_t>(c)];
    for (int c = 0; c < step_numbers; ++c)
      sums[std::size_t{step_numbers} * piece + static_cast<std::size_t>(c)] = sum[c];
  }
};

// A key begins one step and ends the one before.
struct sum_keys {
  u64 const* offsets;  // [steps + 1]: of their pieces
  u32 steps;
  double const* sums;
  float* out;  // [keys][6]
  GART_KERNEL void operator()(index_t i) const {
    u32 const key = i / 6, c = i % 6;
    double sum = 0;
    if (key > 0) sum += of(key - 1, 6 + c);
    if (key < steps) sum += of(key, c);
    out[i] = static_cast<float>(sum);
  }

 private:
  GART_HD double of(u32 step, u32 c) const {
    double sum = 0;
    for (u64 piece = offsets[step]; piece < offsets[step + 1]; ++piece) sum += sums[step_numbers * piece + c];
    return sum;
  }
};

// From what was summed by the unit direction to the direction as it was given.
struct finish_directions {
  batch_rays rays;
  float* directions;
  GART_KERNEL void operator()(index_t i) const {
    float* const at = directions + std::size_t{3} * i;
    vec3 const by = rays.gradient_of_given(i, rays.of(i).direction, vec3(at[0], at[1], at[2]));
    at[0] = by.x, at[1] = by.y, at[2] = by.z;
  }
};

}  // namespace actor_kernels

/// The memory of the pass, kept from one batch to the next.
template <execution E, class Response>
class actor_gradient {
 public:
  /// Allocates nothing; `exec` must outlive it.
  explicit actor_gradient(E& exec)
      : exec_(&exec),
        world_(exec),
        moved_(exec),
        records_(exec),
        moments_(exec),
        ids_(exec),
        places_(exec),
        rays_of_hits_(exec),
        depths_(exec),
        gather_(exec),
        steps_(exec),
        poses_(exec),
        order_(exec),
        sums_(exec) {}

  /// The rays of a batch and what they saw; dL/d rays that are wanted are zero then.
  void begin(ray_batch const& rays, float const* color, float const* depth, float const* transmittance,
             output_gradients const& by, ray_gradient_targets const& of_rays) {
    rays_ = rays, of_rays_ = of_rays;
    index_t const n = rays.count();
    world_.resize(n);
    auto const given = [](span<float const> const& values) { return values.empty() ? nullptr : values.data(); };
    parallel_for(*exec_, "actors/rays", n,
                 ray_kernels::gather_rays{batch_rays(rays), color, depth, transmittance, given(by.color),
                                          given(by.depth), given(by.transmittance), world_.data()});
    for (float* const each : {of_rays.origins, of_rays.directions})
      if (each) exec_->zero(each, sizeof(float) * 3 * n);
  }

  /// An actor whose model's hits are `count`. To its model's gradients, overwritten, where they are wanted. To its
  /// keys', [keys][6], where they are, and to those of the rays.
  void add(actor_view const& actor, actor_hits_view const& hits, u64 count, gaussians_view<float const> model,
           float alpha_min, gaussians_view<float> gradients, float* keys, u32 key_count) {
    index_t const n = rays_.count();
    float const to_own = static_cast<float>(1 / actor.scale);
    moved_.resize(n), records_.resize(model.count);
    parallel_for(*exec_, "actors/rays", n, actor_kernels::move_differentiated{world_.data(), actor, moved_.data()});
    parallel_for(*exec_, "actors/preprocess", model.count,
                 render_kernels::prepare_gaussians<Response>{model, actor.origin, alpha_min, records_.view()});
    if (gradients.mean) {
      for (buffer<u32, E>* const each : {&ids_, &places_, &rays_of_hits_}) each->resize(count);
      depths_.resize(count), moments_.resize(std::size_t{moment_stride} * model.count);
      parallel_for(*exec_, "actors/pick", n,
                   actor_kernels::pick_hits{hits, to_own, model.count, ids_.data(), places_.data(),
                                            rays_of_hits_.data(), depths_.data()});
      sort_pairs(*exec_, ids_.view(), places_.view(), static_cast<int>(std::bit_width(model.count)));
      actor_kernels::picked_hits const picked{hits.entries + hits.base, depths_.data(), rays_of_hits_.data()};
      gather_.sum(*exec_, sorted_hits<actor_kernels::picked_hits>{picked, ids_.data(), places_.data()},
                  static_cast<index_t>(count), moved_, records_, model.sh_degree, gradients, moments_);
      finish_gradients(*exec_, model, records_, camera{}, 0, moments_, gradients);
    }
    if (!keys && !of_rays_.origins && !of_rays_.directions) return;
    steps_.resize(keys ? n : 0), poses_.resize(keys ? std::size_t{actor_kernels::step_numbers} * n : 0);
    parallel_for(
        *exec_, "actors/back", n,
        actor_kernels::differentiate_moved<Response>{hits, to_own, moved_.data(), world_.data(), records_.data(),
                                                     color_rows{model.sh, model.sh_degree, model.sh_degree}, actor,
                                                     of_rays_, keys ? steps_.data() : nullptr, poses_.data()});
    if (!keys) return;
    order_.make(*exec_, steps_, actor.step_count);
    gaussian_order_view const order = order_.view();
    sums_.resize(std::size_t{actor_kernels::step_numbers} * order.pieces);
    parallel_for(*exec_, "actors/keys", order.pieces, actor_kernels::sum_steps{order, poses_.data(), sums_.data()});
    parallel_for(*exec_, "actors/keys", 6 * key_count,
                 actor_kernels::sum_keys{order.offsets, actor.step_count, sums_.data(), keys});
  }

  /// After the last actor.
  void end() {
    if (of_rays_.directions)
      parallel_for(*exec_, "actors/back", rays_.count(),
                   actor_kernels::finish_directions{batch_rays(rays_), of_rays_.directions});
  }

 private:
  E* exec_;
  ray_batch rays_;
  ray_gradient_targets of_rays_;
  buffer<differentiated_ray, E> world_, moved_;
  buffer<ray_gaussian, E> records_;
  buffer<float, E> moments_;
  buffer<u32, E> ids_, places_, rays_of_hits_;
  buffer<float, E> depths_;
  batch_gather<E, Response> gather_;
  buffer<u32, E> steps_;
  buffer<double, E> poses_;
  gaussian_order<E> order_;
  buffer<double, E> sums_;
};

}}  // namespace gart::GART_ISA
