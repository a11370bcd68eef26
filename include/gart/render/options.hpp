#pragma once
/// \file
/// The parts that a render leaves out, and the background: the options that trade exactness for time.
/// Errors: require_options throws invalid_argument, naming the option; frame.prepare calls it.

#include <gart/core/error.hpp>
#include <gart/core/types.hpp>
#include <gart/math/arith.hpp>
#include <gart/math/glm.hpp>
#include <gart/scene/image_rows.hpp>

#include <string>

namespace gart {

/// How one view is rendered. A flat struct, so that designated initialisers name any member.
struct render_options {
  float alpha_min = 1.0f / 255.0f;  ///< a Gaussian is hit where sigma * rho >= alpha_min
  float transmittance_min = 1e-4f;  ///< a ray ends after the hit that brings T below this
  u32 max_hits = 0;                 ///< a ray ends after so many hits composited; 0: no cap
  float antialias = 0;              ///< standard deviation of the pixels' filter, in pixels (camera/model.hpp); 0: none
  /// The BVH tracer builds its tree every so many views, else refits it: exact. Other tracers have no tree: sessions
  /// and renderers then refuse values other than 1.
  int rebuild_every = 1;
  float near = 0.01f;     ///< hits lie at t > near, world units along the ray
  vec3 background{0.0f};  ///< linear RGB behind the last hit
  /// The part of the image to trace; whole rows of tiles. Pixels of other rows are left as they are, or written without
  /// a hit.
  image_rows rows = {};
};

/// The filter of models that are antialiased: a square pixel has a standard deviation of 0.29.
inline constexpr float default_antialias = 0.3f;

/// Below this exp has no digits left, and a hit's alpha would be 0.
inline constexpr float least_alpha_min = 1e-30f;

/// Throws invalid_argument, with the option and its value, where one is out of its range.
inline void require_options(render_options const& o) {
  auto const refuse = [](char const* what, float value) {
    throw invalid_argument(std::string(what) + ", not " + std::to_string(value));
  };
  if (!(o.alpha_min >= least_alpha_min && o.alpha_min < 1))
    refuse("render_options.alpha_min must lie between 1e-30 and 1", o.alpha_min);
  if (!(o.transmittance_min >= 0 && o.transmittance_min < 1))
    refuse("render_options.transmittance_min must be at least 0 and less than 1", o.transmittance_min);
  if (!(o.near > 0 && is_finite(o.near))) refuse("render_options.near must be positive and finite", o.near);
  if (!(o.antialias >= 0 && o.antialias <= 100))
    refuse("render_options.antialias must lie between 0 and 100 pixels", o.antialias);
  for (int k = 0; k < 3; ++k)
    if (!is_finite(o.background[k])) refuse("render_options.background must be finite", o.background[k]);
}

}  // namespace gart
