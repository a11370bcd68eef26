// Boxes of lenses that move while they are exposed, against the silhouettes of random ellipsoids in double.
// GART_TEST_COUNT ellipsoids a model and size class; GART_TEST_TABLE=1 prints the ratios.
#include "moving_pose.hpp"

#include <support/policies.hpp>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <optional>
#include <vector>

namespace {

using namespace gart_test;

constexpr double pi = 3.14159265358979323846;
constexpr int side = 900;
constexpr long each_view = 48;  // ellipsoids: boxes of a new camera take longer to set up

struct size_class {
  double least, most, bar;
};

// A camera that moves by 3 degrees and 19% of a unit an image.
struct moving_view {
  gart::camera lens;
  bool sphere, columns, backwards;
  moving_pose motion;
  gart::camera view;
  double last;
  beyond_angle beyond;
  std::function<gart::footprint(gart::ellipsoid const&)> box;

  moving_view(std::mt19937_64& random, char const* name, shutter_kind shutter)
      : lens(lens_named(name, side)),
        sphere(lens.kind == gart::camera_kind::equirectangular),
        columns(columns_of(shutter)),
        backwards(from_end(shutter)),
        motion(random, 3 * pi / 180, 0.19),
        view(motion.rolling(lens, shutter)),
        last(last_angle(lens)),
        beyond(last) {
    gart::visit_camera(view, [&](auto const& model) {
      box = [bounds = model.bounds(1e-4f)](gart::ellipsoid const& e) { return bounds(e); };
    });
  }
  int lines() const { return columns ? view.width : view.height; }
  int along() const { return columns ? view.height : view.width; }
};

// And an ellipsoid before it, at depths of 2 to 8, from the camera's position.
struct moving_case : moving_view {
  gart::ellipsoid e;
  gart::footprint f;

  moving_case(std::mt19937_64& random, moving_view const& by, size_class const& size) : moving_view(by) {
    auto const uniform = [&](double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(random); };
    std::normal_distribution<double> normal;
    double const distance = uniform(2, 8);
    double const theta = sphere ? std::acos(uniform(-0.95, 0.95)) : 0.6 * last * std::sqrt(uniform(0, 1));
    double const phi = uniform(-pi, pi);
    gart::vec3d const d =
        sphere ? gart::vec3d(std::sin(theta) * std::sin(phi), -std::cos(theta), std::sin(theta) * std::cos(phi))
               : gart::vec3d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
    e.center = gart::mat3d(view.rotation) * d * distance;
    double const s = distance * std::exp(uniform(std::log(size.least), std::log(size.most)));
    gart::mat3d const turn(gart::to_matrix({static_cast<float>(normal(random)), static_cast<float>(normal(random)),
                                            static_cast<float>(normal(random)), static_cast<float>(normal(random))}));
    for (int k = 0; k < 3; ++k) e.axes[k] = turn[k] * (k == 0 ? s : s * std::exp(uniform(-std::log(20.0), 0)));
    f = box(e);
  }
};

// Once around in so many steps.
struct turn {
  double cosine, sine;
};
template <int Steps>
std::array<turn, Steps + 1> const& turns() {
  static std::array<turn, Steps + 1> const all = [] {
    std::array<turn, Steps + 1> out;
    for (int k = 0; k <= Steps; ++k) out[k] = {std::cos(2 * pi * k / Steps), std::sin(2 * pi * k / Steps)};
    return out;
  }();
  return all;
}

// The silhouette as the camera sees it while the line at a place of the image, in pixels, is read: an ellipse of
// directions in its axes. None where the camera is inside.
struct silhouette {
  gart::vec3d middle, one, two;

  static std::optional<silhouette> of(moving_case const& c, double place) {
    double const line = place - 0.5, t = (c.backwards ? c.lines() - 1 - line : line) / (c.lines() - 1);
    gart::mat3d const to_camera = glm::transpose(c.motion.axes(t));
    gart::vec3d const o = c.motion.position(t) - c.view.position, m = to_camera * (c.e.center - o);
    gart::mat3d const a = to_camera * c.e.axes, inverse = glm::inverse(a);
    gart::vec3d const p = -(inverse * m);
    double const p2 = glm::dot(p, p);
    if (!(p2 > 1)) return {};
    gart::vec3d const n = p / std::sqrt(p2);
    gart::vec3d const b =
        glm::normalize(glm::cross(n, std::abs(n.x) < 0.6 ? gart::vec3d(1, 0, 0) : gart::vec3d(0, 1, 0)));
    double const radius = std::sqrt(1 - 1 / p2);
    return silhouette{m + a * (p / p2), a * (radius * b), a * (radius * glm::cross(n, b))};
  }
  // Along the line and across it, in pixels; none past where the lens ends.
  bool image_of(moving_case const& c, turn const& by, double (&out)[2]) const {
    gart::vec3d const at = middle + one * by.cosine + two * by.sine;
    if (c.beyond(at)) return false;
    double uv[2];
    image_by_definition(c.lens, at.x, at.y, at.z, uv[0], uv[1]);
    out[0] = uv[c.columns], out[1] = uv[!c.columns];
    return true;
  }
  // Whether a step from one image point to the next goes over the seam.
  static bool over_seam(moving_case const& c, double const (&from)[2], double const (&to)[2]) {
    return c.sphere && std::abs(to[c.columns] - from[c.columns]) > 0.4 * c.view.width;
  }
};

// The pixels that see the ellipsoid: columns of the lines, then lines. Without them where it is cut by the image's
// border, the seam or the lens' end.
struct seen_box {
  int lo, hi, first, last;
  long area() const { return long{hi - lo} * (last - first); }
};

// Line by line, where the silhouette as it is then crosses the middles of its pixels.
std::optional<seen_box> seen_by_lines(moving_case const& c) {
  auto const& around = turns<240>();
  gart::footprint const& f = c.f;
  seen_box out{c.along(), -1, c.lines(), -1};
  int const l0 = c.columns ? f.box.x0 : f.box.y0, l1 = c.columns ? f.box.x1 : f.box.y1;
  // What is cut is seen in some of the lines far apart, mostly: they come first.
  std::vector<int> lines;
  for (int line = 0; line < c.lines(); line += 16) lines.push_back(line);
  for (int line = 0; line < c.lines(); ++line) {
    // Past the seam a box goes on beyond the width.
    int const own = c.columns && f.seam && line < l0 - 20 ? line + f.seam : line;
    if (own >= l0 - 20 && own <= l1 + 20 && line % 16 != 0) lines.push_back(line);
  }
  for (int const line : lines) {
    double const level = line + 0.5;
    auto const s = silhouette::of(c, level);
    if (!s) return {};
    double from = 1e300, to = -1e300, before[2] = {}, now[2];
    for (std::size_t k = 0; k < around.size(); ++k) {
      if (!s->image_of(c, around[k], now)) return {};
      if (k > 0) {
        if (silhouette::over_seam(c, before, now)) return {};
        if ((before[1] < level) != (now[1] < level)) {
          double const x = before[0] + (level - before[1]) / (now[1] - before[1]) * (now[0] - before[0]);
          from = std::min(from, x), to = std::max(to, x);
        }
      }
      before[0] = now[0], before[1] = now[1];
    }
    int const x0 = static_cast<int>(std::ceil(from - 0.5 + 2e-3)), x1 = static_cast<int>(std::ceil(to - 0.5 - 2e-3));
    if (!(to > from) || x1 <= x0) continue;
    if (x0 < 0 || x1 > c.along()) return {};
    out.first = std::min(out.first, line), out.last = std::max(out.last, line + 1), out.lo = std::min(out.lo, x0),
    out.hi = std::max(out.hi, x1);
  }
  if (out.last < 0) return {};
  return out;
}

// Around the silhouette: a point of it is seen in the line that is read as it crosses that, which a few rounds find. To
// a fraction of a pixel, and much faster: for means over many. None where they do not: it then moves with the lines.
std::optional<seen_box> seen_around(moving_case const& c) {
  auto const& around = turns<96>();
  double lo = 1e300, hi = -1e300, first = 1e300, last = -1e300, level = 0.5 * c.lines(), before[2] = {}, now[2];
  std::vector<std::optional<silhouette>> of_line(static_cast<std::size_t>(c.lines()));
  for (std::size_t k = 0; k < around.size(); ++k) {
    bool settled = false;
    for (int round = 0; round < 10 && !settled; ++round) {
      int const line = std::clamp(static_cast<int>(level), 0, c.lines() - 1);
      auto& s = of_line[static_cast<std::size_t>(line)];
      if (!s) s = silhouette::of(c, line + 0.5);
      if (!s || !s->image_of(c, around[k], now)) return {};
      level = now[1], settled = std::abs(level - line - 0.5) < 1;
    }
    if (!settled) return {};
    if (k > 0 && silhouette::over_seam(c, before, now)) return {};
    before[0] = now[0], before[1] = now[1];
    lo = std::min(lo, now[0]), hi = std::max(hi, now[0]), first = std::min(first, now[1]),
    last = std::max(last, now[1]);
  }
  auto const pixel = [](double x) { return static_cast<int>(std::ceil(x - 0.5)); };
  seen_box const out{pixel(lo), pixel(hi), pixel(first), pixel(last)};
  if (out.lo < 0 || out.hi > c.along() || out.first <= 0 || out.last >= c.lines()) return {};
  return out;
}

}  // namespace

TEST_CASE("no silhouette leaves its tight box while the camera moves") {
  char const* const text = std::getenv("GART_TEST_COUNT");
  // A mean of few varies by more than the bars leave.
  long const count = text ? std::atol(text) : 60, averaged = std::max(count, 2400l);
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  for (char const* name : {"FULL_OPENCV", "OPENCV_FISHEYE", "EQUIRECTANGULAR"})
    for (size_class const& size : {size_class{0.01, 0.1, 1.1}, size_class{0.1, 0.5, 1.4}}) {
      CAPTURE(name);
      CAPTURE(size.most);
      long outside = 0, compared = 0, measured = 0, seen = 0;
      double ratio = 0;
      std::optional<moving_view> view;
      for (long i = 0; i < averaged; ++i) {
        if (i % each_view == 0) view.emplace(random, name, shutters[i / each_view % 4]);
        moving_case const c(random, *view, size);
        gart::footprint const& f = c.f;
        seen += !f.box.empty();
        auto const exact = seen_around(c);
        // Where a pixel at the border counts for little.
        if (exact && exact->area() >= 400) ++measured, ratio += f.box.area() / static_cast<double>(exact->area());
        if (i >= count) continue;
        auto by_lines = seen_by_lines(c);
        if (!by_lines) continue;
        if (exact && exact->area() >= 400) {
          ++compared;
          // One goes from line to line, the other round the silhouette by steps: on a side they may differ by a pixel
          // of rounding and one of the steps, which is more than a tenth of a small box.
          int const apart =
              std::max({std::abs(by_lines->lo - exact->lo), std::abs(by_lines->hi - exact->hi),
                        std::abs(by_lines->first - exact->first), std::abs(by_lines->last - exact->last)});
          double const share = static_cast<double>(by_lines->area()) / static_cast<double>(exact->area());
          CAPTURE(apart);
          CHECK((apart <= 2 || std::abs(share - 1) < 0.1));
        }
        int const b0 = c.columns ? f.box.y0 : f.box.x0, b1 = c.columns ? f.box.y1 : f.box.x1;
        int const l0 = c.columns ? f.box.x0 : f.box.y0, l1 = c.columns ? f.box.x1 : f.box.y1;
        if (f.seam && c.columns && by_lines->last - 1 < l0) by_lines->first += f.seam, by_lines->last += f.seam;
        if (f.seam && !c.columns && by_lines->hi <= b0) by_lines->lo += f.seam, by_lines->hi += f.seam;
        outside += by_lines->lo < b0 || by_lines->hi > b1 || by_lines->first < l0 || by_lines->last > l1;
      }
      ratio /= static_cast<double>(std::max(measured, 1l));
      CAPTURE(ratio);
      CAPTURE(measured);
      if (std::getenv("GART_TEST_TABLE"))
        std::printf("| rolling %s | %g | %ld | %ld | %ld | %.4f |\n", name, size.most, count, outside, measured, ratio);
      CHECK(outside == 0);
      CHECK(compared > count / 20);
      CHECK(seen > averaged / 4);
      CHECK(measured > averaged / 10);
      CHECK(ratio < size.bar);
    }
}
