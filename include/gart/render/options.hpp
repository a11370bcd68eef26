#pragma once
// What a render leaves out, and what shows where nothing is: the knobs that trade exactness for time.

#include <gart/core/types.hpp>
#include <gart/math/glm.hpp>

namespace gart {

struct render_options {
  float alpha_min = 1.0f / 255.0f;  // a Gaussian is hit where sigma * rho >= alpha_min
  float transmittance_min = 1e-4f;  // a ray ends after the hit that brings T below this
  float near = 0.01f;               // hits lie at t > near, world units along the ray
  u32 max_hits = 0;                 // a ray ends after so many hits composited; 0: no cap
  int rebuild_every = 1;            // the BVH tracer builds its tree every so many views, else refits it: exact
  vec3 background{0.0f};
};

}  // namespace gart
