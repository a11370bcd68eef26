#pragma once
// The scenes of a test run with the oracle's pictures of them, rendered once for all policies.

#include <oracle/scenes.hpp>
#include <render/agreement.hpp>

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

template <class E>
inline std::vector<tracer_kind> tracers() {
#if defined(GART_WITH_EMBREE)
  if constexpr (!E::device) return {tracer_kind::bvh, tracer_kind::tiles, tracer_kind::embree};
#endif
  return {tracer_kind::bvh, tracer_kind::tiles};
}

}  // namespace gart_test
