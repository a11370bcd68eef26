#pragma once
// Visits the leaves of a BVH that a ray may meet between two distances, nearer children first. The visitor says what is
// of interest, and may narrow it as it goes:
//   float near(), far();    only boxes the ray crosses somewhere in [near, far] are entered
//   void leaf(u32 box);     a leaf whose own box is crossed
// Any ray type with a unit `direction` and an origin_of(ray).

#include <gart/bvh/bvh.hpp>

namespace gart {

// A finite inverse of every direction, so that 0 * inf never makes a slab test lie.
GART_HD GART_INLINE float slab_inverse(float d) {
  float const tiny = 1e-20f;
  return 1.0f / (d < tiny && d > -tiny ? (d < 0 ? -tiny : tiny) : d);
}

struct slab_ray {
  vec3 origin, inverse;
  template <class Ray>
  GART_HD GART_INLINE explicit slab_ray(Ray const& r)
      : origin(origin_of(r)),
        inverse(slab_inverse(r.direction.x), slab_inverse(r.direction.y), slab_inverse(r.direction.z)) {}
};

// Entry and exit of the ray into child c of a node.
GART_HD GART_INLINE void cross(bvh_node const& n, int c, slab_ray const& r, float& entry, float& exit) {
  float const x0 = (n.lo[c][0] - r.origin.x) * r.inverse.x, x1 = (n.hi[c][0] - r.origin.x) * r.inverse.x;
  float const y0 = (n.lo[c][1] - r.origin.y) * r.inverse.y, y1 = (n.hi[c][1] - r.origin.y) * r.inverse.y;
  float const z0 = (n.lo[c][2] - r.origin.z) * r.inverse.z, z1 = (n.hi[c][2] - r.origin.z) * r.inverse.z;
  entry = fmaxf(fmaxf(fminf(x0, x1), fminf(y0, y1)), fminf(z0, z1));
  exit = fminf(fminf(fmaxf(x0, x1), fmaxf(y0, y1)), fmaxf(z0, z1));
}

template <class Ray, class Visitor>
GART_HD GART_INLINE void walk(bvh_view const& tree, Ray const& r, Visitor& visitor) {
  if (tree.count == 0) return;
  // 63 bits of code and at most 32 of position bound the depth, and a level leaves at most one node behind.
  constexpr int depth = 96;
  u32 pending[depth];
  float pending_entry[depth];
  int top = 0;
  slab_ray const slab(r);
  u32 node = 0;
  for (;;) {
    bvh_node const& n = tree.nodes[node];
    float entry[2], exit[2];
    cross(n, 0, slab, entry[0], exit[0]);
    cross(n, 1, slab, entry[1], exit[1]);
    u32 const child[2] = {n.child[0], n.child[1]};
    float const near = visitor.near();
    bool enter[2];
    GART_UNROLL
    for (int c = 0; c < 2; ++c)
      enter[c] = entry[c] <= exit[c] && exit[c] >= near && entry[c] <= visitor.far() && n.lo[c][0] <= n.hi[c][0];
    int const first = entry[1] < entry[0] ? 1 : 0;
    GART_UNROLL
    for (int k = 0; k < 2; ++k) {
      int const c = k == 0 ? first : 1 - first;
      bool const wanted = c == 0 ? enter[0] : enter[1];
      u32 const which = c == 0 ? child[0] : child[1];
      if (wanted && (which & bvh_node::leaf)) {
        visitor.leaf(which & ~bvh_node::leaf);
        if (c == 0)
          enter[0] = false;
        else
          enter[1] = false;
      }
    }
    if (enter[0] && enter[1]) {
      pending[top] = child[1 - first];
      pending_entry[top++] = first ? entry[0] : entry[1];
      node = first ? child[1] : child[0];
    } else if (enter[0] || enter[1]) {
      node = enter[0] ? child[0] : child[1];
    } else {
      do {
        if (top == 0) return;
        --top;
      } while (pending_entry[top] > visitor.far());
      node = pending[top];
    }
  }
}

}  // namespace gart
