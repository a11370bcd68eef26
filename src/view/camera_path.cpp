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

rotation operator*(rotation const& a, rotation const& b) {
  return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
          a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

// Differences of values, and steps by them: common to vector spaces and rotations. Of rotations it is half the turn
// about an axis in the body's frame, the shorter way round.
template <class V>
V way(V const& from, V const& to) {
  return to - from;
}
template <class V>
V gone(V const& from, V const& by) {
  return from + by;
}
vec3d way(rotation const& from, rotation const& to) {
  rotation q = rotation{from.w, -from.x, -from.y, -from.z} * to;
  if (q.w < 0) q = -1.0 * q;
  vec3d const v(q.x, q.y, q.z);
  double const sine = std::sqrt(glm::dot(v, v));
  return (sine > 1e-12 ? std::atan2(sine, q.w) / sine : 1.0) * v;
}
rotation gone(rotation const& from, vec3d const& by) {
  double const angle = std::sqrt(glm::dot(by, by)), s = angle > 1e-12 ? std::sin(angle) / angle : 1.0;
  return unit(from * rotation{std::cos(angle), s * by.x, s * by.y, s * by.z});
}

// The stretch between two keyframes, with those before and after; null beyond the ends of an open path.
struct stretch {
  camera const *before, *from, *to, *after;
  double time_before, time, time_after;
};

// The value at a share of the stretch: a cubic Bezier curve with Catmull and Rom's speeds at keyframes. The cumulative
// form of Kim, Kim and Shin needs no sums of values.
template <class Value>
auto at_share(stretch const& s, double share, Value const& value) {
  auto const from = value(*s.from), to = value(*s.to);
  auto const straight = way(from, to) / s.time;
  auto const speed = [&](auto const& before, double time_before, auto const& after, double time_after) {
    return (before * time_after + after * time_before) / (time_before + time_after);
  };
  auto const start =
      s.before ? speed(way(value(*s.before), from) / s.time_before, s.time_before, straight, s.time) : straight;
  auto const end = s.after ? speed(straight, s.time, way(to, value(*s.after)) / s.time_after, s.time_after) : straight;
  auto const first = start * (s.time / 3), last = end * (s.time / 3);
  auto const middle = way(gone(from, first), gone(to, -last));
  double const rest = 1 - share, square = share * share;
  return gone(gone(gone(from, first * (1 - rest * rest * rest)), middle * (square * (3 - 2 * share))),
              last * (square * share));
}

double distance(camera const& a, camera const& b) {
  vec3d const d = a.position - b.position;
  return std::sqrt(glm::dot(d, d));
}

double angle(camera const& a, camera const& b) {
  return 2 * std::acos(std::min(1.0, std::abs(dot(rotation_of(a.rotation), rotation_of(b.rotation)))));
}

}  // namespace

camera_path::camera_path(std::vector<camera> keyframes, bool closed, std::vector<double> times)
    : keyframes_(std::move(keyframes)), closed_(closed) {
  if (keyframes_.size() < 2) throw invalid_argument("a path goes through at least 2 keyframes");
  for (camera& c : keyframes_) {
    if (c.kind != keyframes_.front().kind)
      throw invalid_argument("the keyframes of a path are of different camera models (take those of one)");
    c = resized(c, keyframes_.front().width, keyframes_.front().height);
  }
  std::size_t const stretches = keyframes_.size() - (closed ? 0 : 1);
  if (!times.empty()) {
    bool rises = times.size() == stretches + 1 && times.front() == 0;
    for (std::size_t i = 1; i < times.size(); ++i) rises = rises && times[i] > times[i - 1] && std::isfinite(times[i]);
    if (!rises)
      throw invalid_argument("the times of a path are not " + std::to_string(stretches + 1) +
                             " that begin at 0, each more than the one before");
    times_ = std::move(times);
    return;
  }
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
  auto const length = [&](std::size_t k) { return times_[k + 1] - times_[k]; };
  bool const first = !closed_ && i == 0, last = !closed_ && i + 1 == stretches;
  stretch const here{first ? nullptr : &keyframes_[(i + n - 1) % n],
                     &keyframes_[i],
                     &keyframes_[(i + 1) % n],
                     last ? nullptr : &keyframes_[(i + 2) % n],
                     length((i + stretches - 1) % stretches),
                     length(i),
                     length((i + 1) % stretches)};
  auto const through = [&](auto const& value) { return at_share(here, (time - times_[i]) / length(i), value); };
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

std::vector<camera> smooth_path(std::vector<camera> const& keyframes, int frames, bool closed,
                                std::vector<double> const& times) {
  if (frames < 2) throw invalid_argument("a path has at least 2 frames, not " + std::to_string(frames));
  camera_path const path(keyframes, closed, times);
  std::vector<camera> out;
  for (int i = 0; i < frames; ++i) out.push_back(path.at(path.end() * i / (closed ? frames : frames - 1)));
  return out;
}

}  // namespace gart
