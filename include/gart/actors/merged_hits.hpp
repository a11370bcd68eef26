#pragma once
/// \file
/// The hits of rays with several actors, each traced apart, in one order. That is by ray and t, ties by the number of
/// the Gaussian among all. Lists of actors are appended one after the other, with the colour that each ray sees in the
/// actor's frame. Then they are sorted. The sort is stable, so that ties keep the order of the actors. What ends a ray
/// among all hits ends it no later than among one actor's. So lists that options end hold all that is composited.
///
/// Memory: 32 bytes a hit and 8 a ray. Cost: a sort of 12 bytes a hit by 32 bits and those of a ray's number. Errors:
/// out_of_memory for 2^32 hits and more.

#include <gart/algorithm/sort_pairs.hpp>
#include <gart/rays/batch_composite.hpp>
#include <gart/rays/batch_lists.hpp>

#include <algorithm>
#include <bit>

namespace gart { inline namespace GART_ISA {

/// The merged hits as kernels read them.
struct merged_view {
  u64 const* offsets = nullptr;   ///< [R + 1]: of each ray, among the sorted
  u64 const* keys = nullptr;      ///< [hits], sorted: ray << 32 | bits of t
  u32 const* places = nullptr;    ///< [hits], sorted: where the hit was appended
  u32 const* ids = nullptr;       ///< by place: the Gaussian, among all
  float const* alphas = nullptr;  ///< by place
  float const* colors = nullptr;  ///< [hits][3], by place: as its ray sees it, before the clamp

  /// Sorted hit k.
  GART_HD GART_INLINE hit at(u64 k) const {
    u32 const place = places[k];
    return {bits_to_float(static_cast<u32>(keys[k])), ids[place], alphas[place]};
  }
};

namespace actor_kernels {

struct append_hits {
  hit_table_view from;
  batch_rays rays;  // in the actor's frame
  color_rows colors;
  float scale;  // from its t to the world's
  u64 base;     // the first place
  u32 first;    // the actor's first Gaussian among all
  u64* keys;
  u32 *places, *ids;
  float *alphas, *seen;
  GART_KERNEL void operator()(index_t i) const {
    u64 const begin = from.offsets[i], end = from.offsets[i + 1];
    if (begin == end) return;
    sh_basis<color_rows::most> const basis(rays.of(i).direction);
    for (u64 k = begin; k < end; ++k) {
      u64 const place = base + k;
      keys[place] = u64{i} << 32 | float_to_bits(mul(from.t[k], scale));
      places[place] = static_cast<u32>(place), ids[place] = first + from.ids[k], alphas[place] = from.alpha[k];
      vec3 const c = colors.unclamped(basis, from.ids[k]);
      float* const to = seen + std::size_t{3} * place;
      to[0] = c.x, to[1] = c.y, to[2] = c.z;
    }
  }
};

struct add_offsets {
  u64 const* from;
  bool add;
  u64* to;
  GART_KERNEL void operator()(index_t i) const { to[i] = add ? to[i] + from[i] : from[i]; }
};

// Lists hits, by the program that lists those of a batch.
struct list_merged {
  merged_view hits;
  batch_list program;
  GART_KERNEL void operator()(index_t i) const {
    auto s = program.begin(i);
    for (u64 k = hits.offsets[i]; k < hits.offsets[i + 1]; ++k)
      if (!program.on_hit(s, hits.at(k))) break;
    program.end(i, s);
  }
};

// Composites them, by the program that does those of a batch.
template <class Keep>
struct composite_merged {
  merged_view hits;
  batch_composite<Keep> program;
  GART_KERNEL void operator()(index_t i) const {
    auto s = program.begin(i);
    u64 k = hits.offsets[i];
    u64 const end = hits.offsets[i + 1];
    for (bool more = true; more && k < end; ++k) {
      hit const h = hits.at(k);
      if (h.t > s.far) break;
      u32 const place = hits.places[k];
      float const* const c = hits.colors + std::size_t{3} * place;
      typename Keep::hit taken;
      more = program.take(s, h, vec3(c[0], c[1], c[2]), taken);
      if constexpr (Keep::any) program.keep.write(place, taken);
    }
    if constexpr (Keep::any)
      for (; k < end; ++k) program.keep.drop(hits.places[k]);
    program.end(i, s);
  }
};

}  // namespace actor_kernels

/// Keeps what the gradient needs of each hit, at the place where it was appended.
struct keep_by_place {
  static constexpr bool any = true;  ///< some are kept
  using hit = kept_hit;              ///< what is kept of one
  struct state {};                   ///< of a ray: nothing
  hit_entry* entries = nullptr;      ///< [hits], by place
  float* depths = nullptr;           ///< [hits]: the depth that the ray would have if the hit were opaque

  /// Keeps a hit.
  GART_HD GART_INLINE void write(u32 place, hit const& h) const { entries[place] = h.entry, depths[place] = h.depth; }
  /// Marks one that was not composited: hit_entry::written is false.
  GART_HD GART_INLINE void drop(u32 place) const { entries[place] = {0, 0, 0, -1}, depths[place] = 0; }
  /// After the last one.
  GART_HD GART_INLINE void end(index_t, u32) const {}
};

/// The merged hits and their memory, kept from one batch to the next.
template <execution E>
class merged_hits {
 public:
  /// Allocates nothing; `exec` must outlive it.
  explicit merged_hits(E& exec)
      : offsets_(exec), keys_(exec), places_(exec), ids_(exec), alphas_(exec), colors_(exec) {}

  /// Of so many rays, none yet.
  void begin(index_t rays) { rays_ = rays, count_ = 0, lists_ = 0, offsets_.resize(std::size_t{rays} + 1); }
  /// An actor's, in the order of the actors. `first`: its first Gaussian among all; `rays`: in its frame.
  void append(E& exec, hit_table<E> const& list, ray_batch const& rays, color_rows const& colors, double scale,
              u32 first) {
    u64 const base = count_;
    count_ += list.ids.size();
    if (count_ >= 0xffffffffu)
      throw out_of_memory("hit", count_ * 32, 0, "more than 2^32 hits of all actors at a time: trace fewer rays");
    keys_.resize_keep(count_), places_.resize_keep(count_), ids_.resize_keep(count_);
    alphas_.resize_keep(count_), colors_.resize_keep(3 * count_);
    parallel_for(
        exec, "actors/append", rays_,
        actor_kernels::append_hits{list.view(), batch_rays(rays), colors, static_cast<float>(scale), base, first,
                                   keys_.data(), places_.data(), ids_.data(), alphas_.data(), colors_.data()});
    parallel_for(exec, "actors/append", rays_ + 1,
                 actor_kernels::add_offsets{list.offsets.data(), lists_++ > 0, offsets_.data()});
  }
  /// After the last actor.
  void sort(E& exec) {
    int const ray_bits = static_cast<int>(std::bit_width(rays_));
    sort_pairs(exec, keys_.view(), places_.view(), 32 + ray_bits);
  }
  /// For kernels, sorted.
  merged_view view() const {
    return {offsets_.data(), keys_.data(), places_.data(), ids_.data(), alphas_.data(), colors_.data()};
  }
  /// Hits of all actors.
  u64 count() const { return count_; }
  /// [count()]: the Gaussian among all, by place.
  buffer<u32, E> const& ids() const { return ids_; }

 private:
  index_t rays_ = 0;
  u64 count_ = 0;
  int lists_ = 0;
  buffer<u64, E> offsets_, keys_;
  buffer<u32, E> places_, ids_;
  buffer<float, E> alphas_, colors_;
};

}}  // namespace gart::GART_ISA
