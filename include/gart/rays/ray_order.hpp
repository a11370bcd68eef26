#pragma once
/// \file
/// An order of a batch's rays in which neighbours stay close, for walks that take them as beams (trace/beam_walk.hpp).
/// It goes along a Hilbert curve of directions, on an octahedron laid flat. An octree of origins is woven into it, a
/// level of each in turn. The batch's own arrays stay as they are.
///
/// Cost: one sort of 12 bytes a ray, by 24 bits where all rays begin at the frame, else by 50.

#include <gart/algorithm/sort_pairs.hpp>
#include <gart/bvh/bvh.hpp>
#include <gart/bvh/cross.hpp>
#include <gart/rays/batch_rays.hpp>

namespace gart { inline namespace GART_ISA {

namespace ray_kernels {

struct order_key {
  static constexpr int levels = 12, levels_with_origins = 10;
  batch_rays rays;
  bvh_view tree;
  vec3d shift;  // of the rays' frame, in that of the tree
  u64* keys;
  u32* order;

  GART_KERNEL void operator()(index_t i) const {
    ray const r = rays.of(i);
    int const used = rays.origins ? levels_with_origins : levels;
    u32 const size = 1u << used;
    vec3 const d = r.direction;
    float const length = fabsf(d.x) + fabsf(d.y) + fabsf(d.z);
    float u = d.x / length, v = d.y / length;
    if (d.z < 0) {
      float const outer = copysignf(1 - fabsf(v), u);
      v = copysignf(1 - fabsf(u), v), u = outer;
    }
    u32 x = cell(0.5f * u + 0.5f, size), y = cell(0.5f * v + 0.5f, size), place[3] = {};
    if (rays.origins && tree.count > 0) {
      float const shifts[3] = {static_cast<float>(shift.x), static_cast<float>(shift.y), static_cast<float>(shift.z)};
      float most = 0;
      for (int k = 0; k < 3; ++k) most = larger(255.0f * tree.nodes[0].axis(k).step(), most);
      for (int k = 0; k < 3; ++k)
        place[k] = cell((r.origin[k] + shifts[k] - tree.nodes[0].axis(k).origin) / most, size);
    }
    u64 key = 0;
    for (u32 bit = size / 2; bit > 0; bit /= 2) {
      u32 const right = (x & bit) != 0, up = (y & bit) != 0;
      key = key << 2 | ((3 * right) ^ up);
      if (!up) {
        if (right) x = size - 1 - x, y = size - 1 - y;
        u32 const other = x;
        x = y, y = other;
      }
      if (rays.origins)
        for (u32 const p : place) key = key << 1 | ((p & bit) != 0);
    }
    keys[i] = key, order[i] = i;
  }

 private:
  // Of a number from 0 to 1; others, and what is none, go to the edge.
  GART_HD static u32 cell(float u, u32 size) {
    float const at = u * static_cast<float>(size);
    return at > 0 ? at < static_cast<float>(size - 1) ? static_cast<u32>(at) : size - 1 : 0;
  }
};

}  // namespace ray_kernels

/// The order of the last batch that it was made for, and the memory for it.
template <execution E>
class ray_order {
 public:
  /// Allocates nothing; `exec` must outlive it.
  explicit ray_order(E& exec) : apart(exec), keys_(exec), order_(exec) {}

  /// For rays whose frame lies at `shift` in that of the tree.
  void make(E& exec, ray_batch const& rays, bvh_view const& tree, vec3d const& shift) {
    using kernel = ray_kernels::order_key;
    index_t const n = rays.count();
    keys_.resize(n), order_.resize(n);
    batch_rays const there(rays);
    parallel_for(exec, "rays/order", n, kernel{there, tree, shift, keys_.data(), order_.data()});
    sort_pairs(exec, keys_, order_, there.origins ? 5 * kernel::levels_with_origins : 2 * kernel::levels);
  }
  /// [rays]; null where it is an order of another number of rays.
  u32 const* of(index_t rays) const { return order_.size() == rays ? order_.data() : nullptr; }

  buffer<u32, E> apart;  ///< of the walk (trace_beams)

 private:
  buffer<u64, E> keys_;
  buffer<u32, E> order_;
};

}}  // namespace gart::GART_ISA
