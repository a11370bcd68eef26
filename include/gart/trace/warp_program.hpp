#pragma once
/// \file
/// A pixel program whose rays can meet a Gaussian together (trace/warp_walk.hpp). It computes what a hit shows where
/// the hit is found. What it needs for that is in a row of floats that the whole warp has read. It composites the hit
/// in its turn.

#include <gart/math/glm.hpp>
#include <gart/tiles/footprint_slots.hpp>
#include <gart/trace/ray_program.hpp>

namespace gart { inline namespace GART_ISA {

/// The cell of a program whose hits have no places: a word, to align its neighbours in shared memory.
struct alignas(16) no_cell {};

/// A pixel program for warps.
template <class P>
concept warp_program = pixel_program<P> &&
    requires(P const& p, typename P::state& s, float const* row, vec3 const& shown, float x, u32 place) {
  requires P::has_warps;
  requires std::same_as<typename P::ray_type, primary_ray>;
  { P::row_floats } -> std::convertible_to<int>;           // of a Gaussian's row
  { p.rows_from() } -> std::same_as<float const*>;         // where the rows of all Gaussians begin
  { p.row_floats_read() } -> std::convertible_to<int>;     // how many of them are to be read; the rest is zero
  { p.shade(s, row) } -> std::same_as<vec3>;               // what a hit shows
  { p.add(s, x, x, shown, place) } -> std::same_as<bool>;  // composites a hit (t, alpha); false ends the ray
  // Whether hits have places: numbers of 32 bits that order a pixel's hits as their Gaussians' ids do. They are then
  // found by cells: cell(footprint_slots, tile's box), cell::read from shared memory, cell.place_of(x, y).
  { P::uses_slots } -> std::convertible_to<bool>;
  typename P::cell;
  requires !P::uses_slots || std::constructible_from<typename P::cell, footprint_slots const&, pixel_box const&>;
};

}}  // namespace gart::GART_ISA
