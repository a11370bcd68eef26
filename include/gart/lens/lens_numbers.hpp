#pragma once
/// \file
/// Learned lenses: three numbers for each camera of a capture, relative to the capture's focal length,
///   fx = fx_0 (1 + f),   fy = fy_0 (1 + f),   cx = cx_0 + fx_0 x,   cy = cy_0 + fy_0 y.
/// One number serves both focal lengths, since a sensor's pixels keep their shape. All in double: a training step may
/// move a lens by less than a float resolves.

#include <gart/core/isa.hpp>
#include <gart/core/types.hpp>
#include <gart/scene/camera.hpp>

#include <array>
#include <vector>

namespace gart {

/// Three numbers of a lens: f, x, y.
using lens_numbers = std::array<double, 3>;

}  // namespace gart

namespace gart { inline namespace GART_ISA {

/// The camera with a changed lens; all else stays.
inline camera through(camera view, lens_numbers const& by) {
  double const fx = double{view.fx}, fy = double{view.fy};
  view.fx = static_cast<float>(fx * (1 + by[0])), view.fy = static_cast<float>(fy * (1 + by[0]));
  view.cx = static_cast<float>(double{view.cx} + fx * by[1]),
  view.cy = static_cast<float>(double{view.cy} + fy * by[2]);
  return view;
}

/// Whether two views count as one camera of the capture: the same model, size and lens.
inline bool same_lens(camera const& a, camera const& b) {
  static_assert(sizeof(distortion) == 18 * sizeof(float), "a new number of a lens is to be compared too");
  auto const all = [](camera const& c) {
    distortion const& l = c.lens;
    return std::array<float, 22>{c.fx, c.fy, c.cx, c.cy, l.k1, l.k2, l.p1, l.p2, l.k3,    l.k4,    l.k5,
                                 l.k6, l.d1, l.d2, l.d3, l.s1, l.s2, l.s3, l.s4, l.omega, l.alpha, l.beta};
  };
  return a.kind == b.kind && a.width == b.width && a.height == b.height && all(a) == all(b);
}

}}  // namespace gart::GART_ISA
