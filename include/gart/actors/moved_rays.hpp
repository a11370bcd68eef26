#pragma once
/// \file
/// Rays in the frame of an actor, each at its own time. A point x of the model stands at s R x + p of the world. R and
/// p are those of the track at the ray's time. In the actor's frame a ray o + t d has
///   o' = R^T (o - p) / s,   d' = R^T d,   t' = t / s.
/// What a hit there says of o' and d' goes to the world's ray and the pose. They take
///   dL/do = R dL/do' / s,   dL/dd = R dL/dd',   dL/dp = -dL/do,   dL/dw = -(o - p) x dL/do - d x dL/dd.
/// Here w is a small turn about p, as instances/instance.hpp has it. Arithmetic is in double. What rays are relative to
/// in the actor's frame is a point near them. An actor that stands at the world's origin, in its axes, leaves rays
/// their bits.

#include <gart/instances/instance_track.hpp>
#include <gart/rays/batch_rays.hpp>

namespace gart { inline namespace GART_ISA {

/// An actor as kernels see it; trivially copyable.
struct actor_view {
  track_step const* steps = nullptr;  ///< [step_count], one at least
  u32 step_count = 0;                 ///< of its track
  float const* times = nullptr;       ///< [R], of the rays; null: it stands
  double scale = 1;                   ///< s
  vec3d frame{0.0};                   ///< of the batch, in the world
  vec3d origin{0.0};                  ///< what moved rays are relative to, in the actor's frame

  /// The pose at a ray's time.
  struct placed {
    u32 step;        ///< of the track
    double f;        ///< from 0 at its beginning to 1 at its end
    mat3d rotation;  ///< R
    vec3d position;  ///< p
  };
  /// That which ray i sees.
  GART_HD GART_INLINE placed at(index_t i) const {
    if (!times) return {0, 0, steps[0].rotation, steps[0].position};
    double const time = double{times[i]};
    u32 first = 0, end = step_count;
    while (end - first > 1) {
      u32 const middle = first + (end - first) / 2;
      (steps[middle].begin <= time ? first : end) = middle;
    }
    double f = (time - steps[first].begin) / steps[first].duration;
    f = f < 0 ? 0 : f < 1 ? f : 1;
    return {first, f, steps[first].rotation_at(f), steps[first].position_at(f)};
  }
  /// Where the batch's frame lies in the actor's at a pose.
  GART_HD GART_INLINE vec3d frame_at(placed const& p) const { return (frame - p.position) * p.rotation / scale; }
  /// A ray of the batch's frame, moved.
  GART_HD GART_INLINE ray moved(ray const& r, placed const& p) const {
    vec3d const o = vec3d(r.origin) * p.rotation / scale + (frame_at(p) - origin);
    return {vec3(o), vec3(vec3d(r.direction) * p.rotation)};
  }
};

namespace actor_kernels {

struct move_rays {
  batch_rays rays;
  actor_view actor;
  float *origins, *directions, *t_max;  // of the moved rays; t_max: null where rays have no end
  GART_KERNEL void operator()(index_t i) const {
    ray const own = actor.moved(rays.of(i), actor.at(i));
    for (int k = 0; k < 3; ++k) {
      std::size_t const at = std::size_t{3} * i + static_cast<std::size_t>(k);
      origins[at] = own.origin[k], directions[at] = own.direction[k];
    }
    if (t_max) t_max[i] = rays.t_max[i] / static_cast<float>(actor.scale);
  }
};

struct find_uncovered {
  float const* times;
  float first, last;
  u32* faulty;  // [R]: the ray's number, or ~0
  GART_KERNEL void operator()(index_t i) const { faulty[i] = times[i] >= first && times[i] <= last ? ~u32{0} : i; }
};

}  // namespace actor_kernels

/// The rays of a batch in the frame of one actor after the other, and their memory.
template <execution E>
class moved_rays {
 public:
  /// Allocates nothing; `exec` must outlive it.
  explicit moved_rays(E& exec) : origins_(exec), directions_(exec), t_max_(exec) {}

  /// Of an actor of that scale, whose steps are in memory of the policy. It is at rest where it has no times.
  void move(E& exec, ray_batch const& rays, actor_view const& actor) {
    index_t const n = rays.count();
    bool const ends = !rays.t_max.empty();
    origins_.resize(std::size_t{3} * n), directions_.resize(std::size_t{3} * n), t_max_.resize(ends ? n : 0);
    parallel_for(exec, "actors/move", n,
                 actor_kernels::move_rays{batch_rays(rays), actor, origins_.data(), directions_.data(),
                                          ends ? t_max_.data() : nullptr});
    frame_ = actor.origin;
  }
  /// The last ones.
  ray_batch batch() const { return {frame_, origins_, directions_, t_max_}; }

 private:
  buffer<float, E> origins_, directions_, t_max_;
  vec3d frame_{0.0};
};

/// Throws invalid_argument for the first ray whose time some track does not cover, which are those of moving actors.
/// The ends are compared in the precision of the rays' times. Waits for the policy.
template <execution E>
void require_times(E& exec, ray_batch const& rays, span<instance_track const> actors) {
  float first = -infinity, last = infinity;
  std::size_t begins = 0, ends = 0;  // whose these are
  bool any = false;
  for (std::size_t a = 0; a < actors.size(); ++a) {
    if (!actors[a].moves()) continue;
    any = true;
    float const from = static_cast<float>(actors[a].times.front()), to = static_cast<float>(actors[a].times.back());
    if (from > first) first = from, begins = a;
    if (to < last) last = to, ends = a;
  }
  index_t const n = rays.count();
  if (!any || n == 0) return;
  if (rays.times.empty())
    throw invalid_argument("ray_batch.times is empty, and actors[" + std::to_string(begins) +
                           "] moves: give each ray a time");
  buffer<u32, E> faulty(exec, n), least(exec, 1);
  parallel_for(exec, "actors/check", n, actor_kernels::find_uncovered{rays.times.data(), first, last, faulty.data()});
  reduce(exec, span<u32 const>(faulty), least.view(), reduction::min);
  u32 const number = least.front();
  if (number == ~u32{0}) return;
  float time = 0;
  exec.copy_out(&time, rays.times.data() + number, sizeof time);
  std::string const at = "ray_batch.times[" + std::to_string(number) + "] is " + std::to_string(time);
  if (time != time) throw invalid_argument(at + ", which is no number: correct it, or leave the ray out");
  std::size_t const whose = time < first ? begins : ends;
  throw invalid_argument(at + ", and the track of actors[" + std::to_string(whose) + "] goes from " +
                         std::to_string(actors[whose].times.front()) + " to " +
                         std::to_string(actors[whose].times.back()) +
                         ": give it poses at the times of all rays, or leave the ray out");
}

}}  // namespace gart::GART_ISA
