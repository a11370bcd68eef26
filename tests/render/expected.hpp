#pragma once
// The scenes of a test run with the oracle's pictures of them, rendered once for all policies, and how closely the
// library must agree with a pixel.

#include <oracle/oracle.hpp>
#include <oracle/scenes.hpp>
#include <support/policies.hpp>
#include <support/trace_scene.hpp>

#include <vector>

namespace gart_test {

struct expectation {
  oracle::scene scene;
  oracle::parameters parameters;
  oracle::picture picture;
};

inline std::vector<expectation> const& expectations() {
  static std::vector<expectation> const all = [] {
    std::vector<expectation> out;
    for (auto& s : oracle::scenes(seed())) {
      oracle::parameters p(s.model);
      auto picture = oracle::render(p, s.view, s.options, s.active_degree);
      out.push_back({std::move(s), std::move(p), std::move(picture)});
    }
    return out;
  }();
  return all;
}

inline double const image_tolerance = 1e-5;

// Rounding alone may move this pixel by the tolerance: an undecided hit or order, or an ill-conditioned one.
inline bool within_rounding(oracle::pixel const& p) { return p.rounding > image_tolerance; }

template <class E>
inline std::vector<tracer_kind> tracers() {
#if defined(GART_WITH_EMBREE)
  if constexpr (!E::device) return {tracer_kind::bvh, tracer_kind::tiles, tracer_kind::embree};
#endif
  return {tracer_kind::bvh, tracer_kind::tiles};
}

}  // namespace gart_test
