#pragma once
/// \file
/// The hits of rays in memory of a policy, as lists. Those of ray r are [offsets[r], offsets[r + 1]), in order. They
/// are exactly the hits that are composited. A ray program gives them to a hit_writer: that of a batch
/// (rays/batch_composite.hpp) or of a view's pixels (channels/pixel_hits.hpp).
///
/// Memory: 16 bytes a hit and 8 a ray; to be differentiated 4 and 24 more. Cost: a trace that writes them, and before
/// it one that counts them where nobody has. Errors: out_of_memory for 2^32 hits and more.

#include <gart/algorithm/exclusive_scan.hpp>
#include <gart/channels/channel.hpp>
#include <gart/channels/gaussian_order.hpp>
#include <gart/channels/hit_lists.hpp>
#include <gart/core/error.hpp>
#include <gart/exec/buffer.hpp>
#include <gart/math/ray_gaussian.hpp>
#include <gart/trace/hit.hpp>

namespace gart { inline namespace GART_ISA {

/// The table as kernels read it.
struct hit_table_view {
  u64 const* offsets = nullptr;   ///< [R + 1]
  u32 const* ids = nullptr;       ///< Gaussians
  u32 const* rays = nullptr;      ///< of the hits; of a table that is differentiated
  float const* t = nullptr;       ///< distances
  float const* alpha = nullptr;   ///< opacities
  float const* weight = nullptr;  ///< transmittance before the hit times alpha
  ray const* lines = nullptr;     ///< [R]: the rays; of a table that is differentiated
  index_t ray_count = 0;          ///< R
  index_t count = 0;              ///< hits

  /// Hit k, of that ray.
  GART_HD GART_INLINE listed_hit at(u64 k, u32 ray_number) const { return {ray_number, ids[k], t[k], weight[k]}; }
  /// Hit k.
  GART_HD GART_INLINE listed_hit at(u64 k) const { return at(k, rays[k]); }
};

/// Takes the hits of rays. Without lists it counts them; else it writes them to the places that the counts make.
struct hit_writer {
  /// A ray on its way.
  struct state {
    ray own;                  ///< the ray
    u32 number;               ///< of it
    u64 at;                   ///< place of its first hit
    u32 count = 0;            ///< hits so far
    float transmittance = 1;  ///< after them
  };

  float transmittance_min = 0;   ///< a ray ends after the hit that brings T below this
  u32 max_hits = 0;              ///< a ray ends after so many; 0: no cap
  u32* counts = nullptr;         ///< [R], written where there are no lists
  u64 const* offsets = nullptr;  ///< [R + 1], read where there are lists
  u32* ids = nullptr;            ///< null: hits are counted
  u32* rays = nullptr;           ///< null: not wanted
  float* t = nullptr;            ///< distances
  float* alpha = nullptr;        ///< opacities
  float* weight = nullptr;       ///< transmittance before the hit times alpha
  ray* lines = nullptr;          ///< null: not wanted

  /// Of ray `number`.
  GART_HD GART_INLINE state begin(u32 number, ray const& own) const { return {own, number, ids ? offsets[number] : 0}; }
  /// Counts or writes a hit. False: the ray ends.
  GART_HD GART_INLINE bool on_hit(state& s, hit const& h) const {
    if (ids) {
      u64 const k = s.at + s.count;
      ids[k] = h.id, t[k] = h.t, alpha[k] = h.alpha, weight[k] = s.transmittance * h.alpha;
      if (rays) rays[k] = s.number;
    }
    s.transmittance *= 1.0f - h.alpha;
    return ++s.count != max_hits && s.transmittance >= transmittance_min;
  }
  /// Writes the count, or the ray.
  GART_HD GART_INLINE void end(state const& s) const {
    if (!ids)
      counts[s.number] = s.count;
    else if (lines)
      lines[s.number] = s.own;
  }
};

/// The table and its memory, kept from one list to the next.
template <execution E>
class hit_table {
 public:
  /// None yet; allocates nothing. `exec` must outlive it.
  explicit hit_table(E& exec)
      : offsets(exec),
        ids(exec),
        rays(exec),
        t(exec),
        alpha(exec),
        weight(exec),
        lines(exec),
        counts_(exec),
        order_(exec) {}

  buffer<u64, E> offsets;             ///< as hit_table_view has them
  buffer<u32, E> ids, rays;           ///< the same
  buffer<float, E> t, alpha, weight;  ///< the same
  buffer<ray, E> lines;               ///< the same

  /// The hits of so many rays. trace(label, hit_writer) traces them; `counts`, [R], has the hits of each where that is
  /// known, else it is called twice.
  template <class F>
  void list(E& exec, index_t of_rays, float transmittance_min, u32 max_hits, bool differentiable, F&& trace,
            span<u32 const> counts = {}) {
    hit_writer to{transmittance_min, max_hits};
    if (counts.size() == 0) {
      counts_.resize(of_rays), counts_.zero();
      to.counts = counts_.data(), counts = counts_;
      trace("hits/count", to);
    }
    to = lay_out(exec, of_rays, differentiable, counts);
    to.transmittance_min = transmittance_min, to.max_hits = max_hits;
    if (ids.size() > 0) trace("hits/list", to);
  }
  /// Room for as many hits of each ray, where they are to be written. The lines stay, where they have their size.
  hit_writer lay_out(E& exec, index_t of_rays, bool differentiable, span<u32 const> counts) {
    ordered_ = false;
    offsets.resize(std::size_t{of_rays} + 1);
    span<u64> const at = offsets.view();
    exclusive_scan(exec, counts, at.subspan(0, of_rays), at.subspan(of_rays, 1));
    u64 total = 0;
    exec.copy_out(&total, offsets.data() + of_rays, sizeof total);
    if (total >= 0xffffffffu)
      throw out_of_memory("hit", total * (differentiable ? 20 : 16), 0,
                          "more than 2^32 hits at a time: trace fewer rays, or rows of the view");
    for (buffer<float, E>* const each : {&t, &alpha, &weight}) each->resize(total);
    ids.resize(total), rays.resize(differentiable ? total : 0), lines.resize(differentiable ? of_rays : 0);
    hit_writer to;
    to.offsets = offsets.data(), to.ids = ids.data(), to.t = t.data(), to.alpha = alpha.data();
    to.weight = weight.data();
    if (differentiable) to.rays = rays.data(), to.lines = lines.data();
    return to;
  }

  /// For kernels.
  hit_table_view view() const {
    return {offsets.data(),
            ids.data(),
            rays.data(),
            t.data(),
            alpha.data(),
            weight.data(),
            lines.data(),
            static_cast<index_t>(offsets.size() ? offsets.size() - 1 : 0),
            static_cast<index_t>(ids.size())};
  }
  /// The same hits by Gaussian, of so many; made where it is not.
  gaussian_order_view by_gaussian(E& exec, index_t gaussians) {
    if (!ordered_) order_.make(exec, ids, gaussians);
    ordered_ = true;
    return order_.view();
  }
  /// A copy for the host; waits for it.
  hit_lists to_host() const {
    return {offsets.to_host(), ids.to_host(), t.to_host(), alpha.to_host(), weight.to_host()};
  }

 private:
  buffer<u32, E> counts_;
  gaussian_order<E> order_;
  bool ordered_ = false;
};

}}  // namespace gart::GART_ISA
