#pragma once
/// \file
/// Triangles under the tree: the nearest that a ray meets, or whether there is any. The test is watertight. A ray
/// between two triangles that share an edge, or through their corner, meets one of them. Source: Woop, Benthin and
/// Wald, "Watertight ray/triangle intersection", JCGT 2013. Triangles without an area, or with a corner that is not
/// finite, are never met.
///
/// Both sides count. Of equally near ones the first is met, so that the order of the tree decides nothing.
/// Cost: a walk of the tree; 36 bytes a triangle beside it.

#include <gart/bvh/walk.hpp>

namespace gart { inline namespace GART_ISA {

/// In the rays' frame. Those that share an edge have the same floats for its corners.
struct triangle {
  vec3 corner[3];  ///< counter-clockwise seen from outside
};

/// Where a ray meets a triangle.
struct triangle_hit {
  static constexpr u32 none = 0xffffffffu;  ///< in place of a triangle
  float t = infinity;                       ///< distance along the ray
  u32 id = none;                            ///< the triangle
  float u = 0, v = 0;                       ///< weights of the second and the third corner
};

/// The least box, and the empty one of a triangle that is never met.
GART_HD GART_INLINE box triangle_box(triangle const& t) {
  box out = empty_box();
  for (vec3 const& c : t.corner) {
    for (int k = 0; k < 3; ++k)
      if (!(fabsf(c[k]) < 1e30f)) return empty_box();
    out = join(out, {c, c});
  }
  return out;
}

/// A ray as triangles are tested against it: sheared so that it goes along its largest axis.
struct sheared_ray {
  vec3 origin, shear;  ///< where it begins; x, y: what is sheared off a unit of the largest axis, z: its inverse
  int x, y, z;         ///< axes, z the largest

  /// Of a ray.
  GART_HD GART_INLINE explicit sheared_ray(ray const& r) : origin(r.origin) {
    vec3 const d = r.direction, size(fabsf(d.x), fabsf(d.y), fabsf(d.z));
    z = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
    x = z == 2 ? 0 : z + 1, y = x == 2 ? 0 : x + 1;
    if (d[z] < 0) {  // keeps the winding
      int const other = x;
      x = y, y = other;
    }
    shear = {divide(d[x], d[z]), divide(d[y], d[z]), reciprocal(d[z])};
  }

  /// A corner relative to the ray.
  GART_HD GART_INLINE vec3 sheared(vec3 const& corner) const {
    vec3 const c(add(corner.x, -origin.x), add(corner.y, -origin.y), add(corner.z, -origin.z));
    return {add(c[x], -mul(shear.x, c[z])), add(c[y], -mul(shear.y, c[z])), mul(shear.z, c[z])};
  }
};

/// Whether the ray meets the triangle in (near, hit.t), or at hit.t where its number is lower. Sets the hit.
GART_HD GART_INLINE bool meets(triangle const& t, u32 id, sheared_ray const& r, float near, triangle_hit& hit) {
  vec3 const a = r.sheared(t.corner[0]), b = r.sheared(t.corner[1]), c = r.sheared(t.corner[2]);
  // Products are rounded before they are subtracted: seen from the neighbour, an edge has the same number negated.
  float u = add(mul(c.x, b.y), -mul(c.y, b.x)), v = add(mul(a.x, c.y), -mul(a.y, c.x)),
        w = add(mul(b.x, a.y), -mul(b.y, a.x));
  if (u == 0 || v == 0 || w == 0) {
    auto const edge = [](vec3 const& p, vec3 const& q) {
      return static_cast<float>(static_cast<double>(p.x) * q.y - static_cast<double>(p.y) * q.x);
    };
    u = edge(c, b), v = edge(a, c), w = edge(b, a);
  }
  if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) return false;
  float const area = add(add(u, v), w);
  if (area == 0) return false;
  float const inverse = reciprocal(area);
  float const at = mul(fma(u, a.z, fma(v, b.z, mul(w, c.z))), inverse);
  if (!(at > near && (at < hit.t || (at == hit.t && id < hit.id)))) return false;
  hit = {at, id, mul(v, inverse), mul(w, inverse)};
  return true;
}

/// Triangles and the tree over their boxes, as kernels hold them.
struct triangles_view {
  bvh_view tree;                        ///< over triangle_box of each
  triangle const* triangles = nullptr;  ///< [tree.count]
};

/// Takes every triangle.
struct all_there {
  /// Whether a hit counts.
  GART_HD bool operator()(triangle_hit const&) const { return true; }
};

namespace bvh_kernels {

template <bool Any, class Accept>
struct triangle_visitor {
  triangle const* triangles;
  sheared_ray ray;
  float from;
  triangle_hit hit;
  Accept accept;
  GART_HD GART_INLINE float near() const { return from; }
  // Boxes are met a few roundings from where their triangles are; any one that is found ends the walk.
  GART_HD GART_INLINE float far() const { return Any && hit.id != triangle_hit::none ? -1.0f : mul(hit.t, 1.000002f); }
  GART_HD GART_INLINE void leaf(u32 id) {
    triangle_hit met = hit;
    if (Any && hit.id != triangle_hit::none) return;
    if (meets(triangles[id], id, ray, from, met) && accept(met)) hit = met;
  }
};

}  // namespace bvh_kernels

/// The nearest triangle in (near, far) that `accept` takes; without one hit.t is far.
template <class Accept = all_there>
GART_HD GART_INLINE triangle_hit nearest_triangle(triangles_view const& in, ray const& r, float near, float far,
                                                  Accept const& accept = {}) {
  bvh_kernels::triangle_visitor<false, Accept> visitor{in.triangles, sheared_ray(r), near, {far}, accept};
  walk(in.tree, r, visitor);
  return visitor.hit;
}

/// Whether there is any in (near, far) that `accept` takes.
template <class Accept = all_there>
GART_HD GART_INLINE bool meets_any_triangle(triangles_view const& in, ray const& r, float near, float far,
                                            Accept const& accept = {}) {
  bvh_kernels::triangle_visitor<true, Accept> visitor{in.triangles, sheared_ray(r), near, {far}, accept};
  walk(in.tree, r, visitor);
  return visitor.hit.id != triangle_hit::none;
}

}}  // namespace gart::GART_ISA
