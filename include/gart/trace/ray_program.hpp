#pragma once
// The traverser. A ray program says which rays there are and what to do with their hits; a traverser feeds it
// the hits of each ray in order, (t, id) ascending, until it has had enough. A traverser offers
//   template <class P> void trace(E&, char const* label, index_t rays, P const& program);
// Its structure yields candidates only: what is a hit, its t and its alpha come from math/ray_gaussian.hpp, so all
// traversers give the same hits in the same order, bit for bit.

#include <gart/math/ray_gaussian.hpp>
#include <gart/trace/hit.hpp>

#include <concepts>
#include <type_traits>

namespace gart::inline GART_ISA {

template <class P>
concept ray_program = std::is_trivially_copyable_v<P> && requires(P const& p, index_t i, hit h, typename P::state& s) {
  { p.active(i) } -> std::same_as<bool>;  // launch sizes are padded; other rays are skipped
  { p.begin(i) } -> std::same_as<typename P::state>;
  { p.ray_of(i, s) } -> std::same_as<typename P::ray_type>;  // primary_ray or ray
  { p.on_hit(s, h) } -> std::same_as<bool>;                  // false ends the ray
  p.end(i, s);
};

// What every traverser needs of the scene: the Gaussians in one frame, and the distance hits begin at.
struct traced_scene {
  ray_gaussian const* gaussians = nullptr;
  index_t count = 0;
  float near = 0;
};

}  // namespace gart::inline GART_ISA
