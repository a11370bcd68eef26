#include <gart/core/error.hpp>
#include <gart/view/camera_path.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

namespace gart {

namespace {

struct rotation {
  double w = 1, x = 0, y = 0, z = 0;
};

rotation operator*(double s, rotation const& q) { return {s * q.w, s * q.x, s * q.y, s * q.z}; }
rotation operator+(rotation const& a, rotation const& b) { return {a.w + b.w, a.x + b.x, a.y + b.y, a.z + b.z}; }
double dot(rotation const& a, rotation const& b) { return a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z; }
rotation unit(rotation const& q) { return (1 / std::sqrt(dot(q, q))) * q; }

// By the largest of the four, which is never small.
rotation rotation_of(mat3 const& m) {
  auto const at = [&](int row, int column) { return static_cast<double>(m[column][row]); };
  std::array<double, 4> const square = {1 + at(0, 0) + at(1, 1) + at(2, 2), 1 + at(0, 0) - at(1, 1) - at(2, 2),
                                        1 - at(0, 0) + at(1, 1) - at(2, 2), 1 - at(0, 0) - at(1, 1) + at(2, 2)};
  double const x = at(2, 1) - at(1, 2), y = at(0, 2) - at(2, 0), z = at(1, 0) - at(0, 1);
  double const xy = at(1, 0) + at(0, 1), xz = at(0, 2) + at(2, 0), yz = at(2, 1) + at(1, 2);
  switch (std::max_element(square.begin(), square.end()) - square.begin()) {
    case 0:
      return unit({square[0], x, y, z});
    case 1:
      return unit({x, square[1], xy, xz});
    case 2:
      return unit({y, xy, square[2], yz});
    default:
      return unit({z, xz, yz, square[3]});
  }
}

mat3 matrix_of(rotation const& q) {
  auto const f = [](double v) { return static_cast<float>(v); };
  mat3 m;
  m[0] = vec3(f(1 - 2 * (q.y * q.y + q.z * q.z)), f(2 * (q.x * q.y + q.w * q.z)), f(2 * (q.x * q.z - q.w * q.y)));
  m[1] = vec3(f(2 * (q.x * q.y - q.w * q.z)), f(1 - 2 * (q.x * q.x + q.z * q.z)), f(2 * (q.y * q.z + q.w * q.x)));
  m[2] = vec3(f(2 * (q.x * q.z + q.w * q.y)), f(2 * (q.y * q.z - q.w * q.x)), f(1 - 2 * (q.x * q.x + q.y * q.y)));
  return m;
}

// Between two, and beyond them, along the shorter way.
rotation between(rotation const& a, rotation b, double s) {
  double cosine = dot(a, b);
  if (cosine < 0) b = -1.0 * b, cosine = -cosine;
  if (cosine > 1 - 1e-12) return unit((1 - s) * a + s * b);
  double const angle = std::acos(std::min(cosine, 1.0)), sine = std::sin(angle);
  return unit((std::sin((1 - s) * angle) / sine) * a + (std::sin(s * angle) / sine) * b);
}
vec3d between(vec3d const& a, vec3d const& b, double s) { return (1 - s) * a + s * b; }
double between(double a, double b, double s) { return (1 - s) * a + s * b; }

// Barry and Goldman: the value at `time` between the second and the third of four knots.
template <class V>
V spline(std::array<V, 4> const& p, std::array<double, 4> const& knot, double time) {
  auto const mix = [&](V const& a, V const& b, std::size_t from, std::size_t to) {
    return between(a, b, (time - knot[from]) / (knot[to] - knot[from]));
  };
  V const a = mix(p[0], p[1], 0, 1), b = mix(p[1], p[2], 1, 2), c = mix(p[2], p[3], 2, 3);
  return mix(mix(a, b, 0, 2), mix(b, c, 1, 3), 1, 2);
}

double distance(camera const& a, camera const& b) {
  vec3d const d = a.position - b.position;
  return std::sqrt(glm::dot(d, d));
}

double angle(camera const& a, camera const& b) {
  return 2 * std::acos(std::min(1.0, std::abs(dot(rotation_of(a.rotation), rotation_of(b.rotation)))));
}

}  // namespace

camera_path::camera_path(std::vector<camera> keyframes, bool closed)
    : keyframes_(std::move(keyframes)), closed_(closed) {
  if (keyframes_.size() < 2) throw invalid_argument("a path goes through at least 2 keyframes");
  for (camera& c : keyframes_) {
    if (c.kind != keyframes_.front().kind)
      throw invalid_argument("the keyframes of a path are of different camera models (take those of one)");
    c = resized(c, keyframes_.front().width, keyframes_.front().height);
  }
  std::size_t const stretches = keyframes_.size() - (closed ? 0 : 1);
  auto const next = [&](std::size_t i) -> camera const& { return keyframes_[(i + 1) % keyframes_.size()]; };
  double way = 0;
  for (std::size_t i = 0; i < stretches; ++i) way += distance(keyframes_[i], next(i));
  times_ = {0};
  for (std::size_t i = 0; i < stretches; ++i) {
    double const moved = way > 0 ? distance(keyframes_[i], next(i)) * static_cast<double>(stretches) / way : 0;
    times_.push_back(times_.back() + std::sqrt(moved + angle(keyframes_[i], next(i)) + 1e-4));
  }
}

camera camera_path::at(double time) const {
  time = std::clamp(time, 0.0, end());
  std::size_t const stretches = times_.size() - 1, n = keyframes_.size();
  std::size_t const passed =
      static_cast<std::size_t>(std::upper_bound(times_.begin(), times_.end(), time) - times_.begin());
  std::size_t const i = std::min(passed - 1, stretches - 1);
  // Beyond the ends of an open path it goes on as it came, for as long.
  auto const length = [&](std::size_t k) { return times_[k + 1] - times_[k]; };
  bool const first = !closed_ && i == 0, last = !closed_ && i + 1 == stretches;
  double const before = first ? length(i) : length((i + stretches - 1) % stretches),
               after = last ? length(i) : length((i + 1) % stretches);
  std::array<double, 4> const knots = {times_[i] - before, times_[i], times_[i + 1], times_[i + 1] + after};
  camera const &from = keyframes_[i], &to = keyframes_[(i + 1) % n];
  auto const through = [&](auto const& value) {
    auto const a = value(from), b = value(to);
    return spline(std::array{first ? between(b, a, 2.0) : value(keyframes_[(i + n - 1) % n]), a, b,
                             last ? between(a, b, 2.0) : value(keyframes_[(i + 2) % n])},
                  knots, time);
  };
  camera c = keyframes_.front();
  c.position = through([](camera const& k) { return k.position; });
  c.rotation = matrix_of(through([](camera const& k) { return rotation_of(k.rotation); }));
  if (c.kind == camera_kind::equirectangular) return c;
  auto const number = [&](float camera::*member, bool in_proportion) {
    double const v = through([&](camera const& k) {
      double const own = k.*member;
      return in_proportion ? std::log(own) : own;
    });
    c.*member = static_cast<float>(in_proportion ? std::exp(v) : v);
  };
  number(&camera::fx, true), number(&camera::fy, true), number(&camera::cx, false), number(&camera::cy, false);
  return c;
}

std::vector<camera> smooth_path(std::vector<camera> const& keyframes, int frames, bool closed) {
  if (frames < 2) throw invalid_argument("a path has at least 2 frames, not " + std::to_string(frames));
  camera_path const path(keyframes, closed);
  std::vector<camera> out;
  for (int i = 0; i < frames; ++i) out.push_back(path.at(path.end() * i / (closed ? frames : frames - 1)));
  return out;
}

}  // namespace gart
