#pragma once
/// \file
/// A ray program for packets, a lane a pixel (trace/packet_walk.hpp). A pixel program that has packets is turned into
/// its own by a function packets_of(program), found beside it.

#include <gart/math/glm.hpp>
#include <gart/trace/packet_cell.hpp>
#include <gart/trace/ray_program.hpp>

#include <array>
#include <concepts>

#if !defined(__CUDACC__)

namespace gart { inline namespace GART_ISA {

/// A ray program for packets.
template <class P>
concept packet_program = requires(P const& p, typename P::state& s, packet_block const& block,
                                  typename P::cell const& cell, typename P::shaded const& shown, lane_mask rays,
                                  lanes x, lane_words places, u32 id) {
  typename P::state;   // of a packet's rays
  typename P::cell;    // a packet_cell, and what the program wants to know of a (tile, Gaussian) pair
  typename P::shaded;  // what a Gaussian shows each ray
  { p.begin(block) } -> std::same_as<typename P::state>;
  { s.directions } -> std::convertible_to<vec3_of<lanes> const&>;
  { s.inside } -> std::convertible_to<lane_mask>;  // lanes whose pixels are of the image
  // May be hit: a word of each hit, kept until its turn comes. What the hits will write may be fetched.
  { p.expect(s, cell) } -> std::same_as<lane_words>;
  p.fetch(id);  // was hit: what shade will read may be fetched
  { p.shade(s, id) } -> std::same_as<typename P::shaded>;
  // A hit a ray, of different Gaussians: t, alpha, what they show, their words. The rays that go on.
  { p.on_hit(s, rays, x, x, shown, places) } -> std::same_as<lane_mask>;
  p.end(s);
  requires std::same_as<typename P::shaded, std::array<lanes, std::tuple_size_v<typename P::shaded>>>;
  requires std::derived_from<typename P::cell, packet_cell>;
  requires std::constructible_from<typename P::cell, u32, footprint_slots const&, pixel_box const&>;
};

}}  // namespace gart::GART_ISA

#endif
