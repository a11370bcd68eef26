#pragma once
/// \file
/// The kinds that choose a configuration, with their names (core/names.hpp). `automatic` is the best on this machine.
/// `own` is a tracer that a program wrote for itself. Gradient methods go by their names
/// (backward/gradient_methods.hpp).

#include <gart/core/names.hpp>

namespace gart {

/// Which policy computes; `automatic`: the best that is available.
enum class backend_kind { automatic, serial, openmp, cuda };
/// Their names.
constexpr auto names_of(backend_kind) {
  using enum backend_kind;
  return std::array<name_of<backend_kind>, 4>{
      {{automatic, "auto"}, {serial, "serial"}, {openmp, "openmp"}, {cuda, "cuda"}}};
}

/// What finds a ray's hits; `own`: a program's own tracer.
enum class tracer_kind { automatic, bvh, embree, tiles, optix, own };
/// Their names.
constexpr auto names_of(tracer_kind) {
  using enum tracer_kind;
  return std::array<name_of<tracer_kind>, 6>{
      {{automatic, "auto"}, {bvh, "bvh"}, {embree, "embree"}, {tiles, "tiles"}, {optix, "optix"}, {own, "own"}}};
}

/// The record of a hit by the forward pass (backward/hit_slot.hpp): nothing for pixel, its weight for hybrid.
enum class hit_format_kind { automatic, float4, half, weight, none };
/// Their names.
constexpr auto names_of(hit_format_kind) {
  using enum hit_format_kind;
  return std::array<name_of<hit_format_kind>, 5>{
      {{automatic, "auto"}, {float4, "float4"}, {half, "half"}, {weight, "weight"}, {none, "none"}}};
}

/// The degrees of the generalised Gaussians that math/response.hpp has.
inline constexpr int kernel_degrees[] = {1, 2, 3, 4, 5, 8};

}  // namespace gart
