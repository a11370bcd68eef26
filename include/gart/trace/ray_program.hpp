#pragma once
/// \file
/// A ray program says which rays there are and what to do with their hits. A tracer (trace/tracer.hpp) feeds it the
/// hits of each ray in order, (t, id) ascending, until it has had enough. It is copied to where the rays run, by bytes,
/// and derives from ray_program_base.

#include <gart/math/ray_gaussian.hpp>
#include <gart/trace/hit.hpp>
#include <gart/trace/pixel_order.hpp>

#include <concepts>
#include <type_traits>

namespace gart { inline namespace GART_ISA {

/// The defaults of a ray program.
struct ray_program_base {
  /// Its rays can be walked in packets on a host: packets_of(program) is its packet_program (trace/packet_program.hpp).
  static constexpr bool has_packets = false;
  /// Its rays can be walked in warps on a device: it is a warp_program (trace/warp_program.hpp).
  static constexpr bool has_warps = false;
};

/// Rays and what becomes of their hits.
template <class P>
concept ray_program = std::is_trivially_copyable_v<P> && requires(P const& p, index_t i, hit h, typename P::state& s) {
  typename P::state;                      // what a ray has gathered so far
  typename P::ray_type;                   // primary_ray or ray
  { p.active(i) } -> std::same_as<bool>;  // launch sizes are padded; other rays are skipped
  { p.begin(i) } -> std::same_as<typename P::state>;
  { p.ray_of(i, s) } -> std::same_as<typename P::ray_type>;
  { p.on_hit(s, h) } -> std::same_as<bool>;  // false ends the ray
  p.end(i, s);
  // From ray_program_base:
  { P::has_packets } -> std::convertible_to<bool>;
  { P::has_warps } -> std::convertible_to<bool>;
};

/// A ray program whose rays belong to an image's pixels, so that a tracer by tiles can follow.
template <class P>
concept pixel_program = ray_program<P> && requires(P const& p, index_t i) {
  { p.at(i) } -> std::same_as<pixel>;                      // of ray i
  { p.order } -> std::convertible_to<pixel_order const&>;  // ray i is the i-th in it
};

}}  // namespace gart::GART_ISA
