#pragma once
/// \file
/// The hits of a batch as lists (channels/hit_table.hpp). Where a list was made before, there is room for about as many
/// hits. Rays write them as they find them (rays/hit_runs.hpp). Then each goes to its place in the table. Else one walk
/// counts and a second one writes.
///
/// Memory, beside the table: 16 bytes a hit, and 16 places at a time a ray.

#include <gart/channels/hit_table.hpp>
#include <gart/rays/batch_rays.hpp>
#include <gart/rays/hit_runs.hpp>
#include <gart/render/options.hpp>
#include <gart/trace/ray_program.hpp>

namespace gart { inline namespace GART_ISA {

/// The ray program of hit lists: the same hits as those that are composited.
struct batch_list : ray_program_base {
  using ray_type = ray;  ///< from anywhere
  /// A ray on its way.
  struct state : hit_writer::state {
    float far;  ///< where it ends
  };

  batch_rays rays;  ///< of the batch
  hit_writer to;    ///< where hits go

  /// Every ray is one.
  GART_HD bool active(index_t) const { return true; }
  /// Where ray i ends.
  GART_HD float far(index_t i) const { return rays.far(i); }
  /// The state before the first hit.
  GART_HD state begin(index_t i) const { return {to.begin(i, rays.of(i)), rays.far(i)}; }
  /// Ray i, in the batch's frame.
  GART_HD ray ray_of(index_t, state const& s) const { return s.own; }
  /// Takes a hit. False: the ray ends.
  GART_HD GART_INLINE bool on_hit(state& s, hit const& h) const { return h.t <= s.far && to.on_hit(s, h); }
  /// Takes the ray.
  GART_HD void end(index_t, state const& s) const { to.end(s); }
};
static_assert(ray_program<batch_list>);

/// The same before anybody knows how many they are: in the order in which rays find them. One walk does for both.
template <execution E>
struct batch_find : ray_program_base {
  using ray_type = ray;  ///< from anywhere
  /// What is kept of a hit, written 16 bytes at a time.
  struct alignas(16) taken_hit {
    float t;       ///< distance
    u32 id;        ///< Gaussian
    float alpha;   ///< opacity
    float weight;  ///< transmittance before the hit times alpha
  };
  /// A ray on its way.
  struct state : batch_list::state {
    typename run_writer<E>::state places;  ///< its run
  };

  batch_list counted;    ///< the rays; counts their hits
  run_writer<E> runs;    ///< where hits go
  taken_hit* hits;       ///< [places]
  ray* lines = nullptr;  ///< [R]: the rays; null: not wanted

  /// Every ray is one.
  GART_HD bool active(index_t) const { return true; }
  /// Where ray i ends.
  GART_HD float far(index_t i) const { return counted.far(i); }
  /// The state before the first hit.
  GART_HD state begin(index_t i) const { return {counted.begin(i), {}}; }
  /// Ray i, in the batch's frame.
  GART_HD ray ray_of(index_t, state const& s) const { return s.own; }
  /// Takes a hit. False: the ray ends.
  GART_KERNEL GART_INLINE bool on_hit(state& s, hit const& h) const {
    if (h.t > s.far) return false;
    taken_hit taken;
    bool const goes_on = take(s, h, taken);
    runs.put(s.places, s.number, s.count - 1, [&](u64 at) { hits[at] = taken; });
    return goes_on;
  }
  /// The same of a hit before the ray's end; it is not written yet.
  GART_HD GART_INLINE bool take(state& s, hit const& h, taken_hit& taken) const {
    taken = {h.t, h.id, h.alpha, s.transmittance * h.alpha};
    return counted.to.on_hit(s, h);
  }
  /// Writes so many that were taken, a lane each.
  GART_KERNEL GART_INLINE void keep_together(state& s, u32 count, group_values<taken_hit>& taken) const {
    runs.put_together(s.places, s.number, s.count - count, count, [&](int l, u64 at) { hits[at] = taken[l]; });
  }
  /// Takes the ray.
  GART_HD void end(index_t i, state const& s) const {
    counted.to.end(s);
    if (lines) lines[i] = s.own;
  }
};

namespace ray_kernels {

// From where they were found to the table, in the order of the rays.
template <class Hit>
struct list_found {
  run_reader runs;
  Hit const* hits;
  hit_writer to;
  GART_KERNEL void operator()(index_t place) const {
    u32 ray_number;
    u64 k;
    if (!runs.find(place, ray_number, k)) return;
    Hit const h = hits[place];
    to.ids[k] = h.id, to.t[k] = h.t, to.alpha[k] = h.alpha, to.weight[k] = h.weight;
    if (to.rays) to.rays[k] = ray_number;
  }
};

}  // namespace ray_kernels

/// Makes lists, and keeps the memory for it.
template <execution E>
class batch_lists {
  using found_hit = typename batch_find<E>::taken_hit;

 public:
  /// Allocates nothing; `exec` must outlive it.
  explicit batch_lists(E& exec) : runs_(exec), found_(exec) {}

  /// The hits of a batch. trace(label, program) traces it; `counts`, [R], has the hits of each ray where that is known.
  template <class F>
  void operator()(E& exec, hit_table<E>& to, ray_batch const& rays, render_options const& options, bool differentiable,
                  F&& trace, span<u32 const> counts = {}) {
    index_t const n = rays.count();
    if (counts.size() == 0 && n > 0 && per_ray_ > 0) {
      if (find(exec, to, rays, options, differentiable, trace)) return;
      counts = runs_.counts;
    }
    to.list(
        exec, n, options.transmittance_min, options.max_hits, differentiable,
        [&](char const* label, hit_writer const& writer) {
          trace(label, batch_list{{}, batch_rays(rays), writer});
        },
        counts);
    // Half a run of each ray is left.
    if (n > 0) per_ray_ = static_cast<double>(to.ids.size()) / n + 0.5 * hit_run;
  }

 private:
  // In one walk. False: there was no room, but counts are there.
  template <class F>
  bool find(E& exec, hit_table<E>& to, ray_batch const& rays, render_options const& options, bool differentiable,
            F&& trace) {
    index_t const n = rays.count();
    u64 const room = hit_runs<E>::room_for(n, per_ray_);
    found_.resize(room), to.lines.resize(differentiable ? n : 0);
    run_writer<E> const runs = runs_.begin(n, room);
    hit_writer counting{options.transmittance_min, options.max_hits};
    counting.counts = runs.counts;
    trace("hits/find",
          batch_find<E>{
              {}, {{}, batch_rays(rays), counting}, runs, found_.data(), differentiable ? to.lines.data() : nullptr});
    u64 const taken = runs_.used.front();
    per_ray_ = static_cast<double>(taken) / n;
    if (taken > room || taken >= 0xffffffffu) return false;
    hit_writer const writer = to.lay_out(exec, n, differentiable, runs_.counts);
    parallel_for(exec, "hits/list", static_cast<index_t>(taken),
                 ray_kernels::list_found<found_hit>{runs_.read(to.offsets.data()), found_.data(), writer});
    return true;
  }

  hit_runs<E> runs_;
  buffer<found_hit, E> found_;
  double per_ray_ = 0;  // places that the last list took
};

}}  // namespace gart::GART_ISA
