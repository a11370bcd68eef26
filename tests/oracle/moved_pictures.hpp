#pragma once
// The oracle's pictures of a scene by a camera that is shifted and turned a little in double: central differences of
// fourth order by the six numbers of a pose, and which pixels they hold for.

#include <oracle/oracle.hpp>
#include <oracle/scenes.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace oracle {

struct moved_pictures {
  picture base;
  std::vector<picture> moved;  // shifts along x, y and z, then turns about them; each by h, -h, 2 h and -2 h
  std::vector<bool> smooth;    // by pixel: no difference crosses a step
  double h = 0;

  // By number k of the pose, of f(pixel).
  template <class F>
  double slope(std::size_t k, std::size_t p, F const& f) const {
    auto const at = [&](std::size_t step) { return f(moved[4 * k + step].pixels[p]); };
    return (8 * (at(0) - at(1)) - (at(2) - at(3))) / (12 * h);
  }
};

// h: a small part of the smallest axis.
inline moved_pictures move_camera(scene const& s) {
  parameters const m(s.model);
  auto const render_by = [&](motion const& by) { return render(m, s.view, s.options, s.active_degree, by); };
  moved_pictures out{render_by({}), {}, {}, 0};
  out.h = 2e-4 * std::exp(*std::min_element(m.log_scale.begin(), m.log_scale.end()));
  out.smooth.assign(out.base.pixels.size(), true);
  for (int k = 0; k < 6; ++k)
    for (double const step : {out.h, -out.h, 2 * out.h, -2 * out.h}) {
      motion by;
      (k < 3 ? by.shift[k] : by.turn[k - 3]) = step;
      out.moved.push_back(render_by(by));
      for (std::size_t p = 0; p < out.smooth.size(); ++p) {
        pixel const& here = out.base.pixels[p];
        out.smooth[p] = out.smooth[p] && !here.edge && !here.kink && same_branches(here, out.moved.back().pixels[p]);
      }
    }
  return out;
}

}  // namespace oracle
