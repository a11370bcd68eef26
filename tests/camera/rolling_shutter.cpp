// Lenses that move while they are exposed: held to the seam, their rays to cameras that stand still at each line's
// pose, their boxes to silhouettes in double, line by line. GART_TEST_COUNT ellipsoids; GART_TEST_TABLE=1 prints the
// ratios.
#include "lenses.hpp"
#include "seam.hpp"

#include <cstdio>
#include <cstdlib>

namespace {

using gart::shutter_kind;

constexpr shutter_kind shutters[] = {shutter_kind::top_to_bottom, shutter_kind::left_to_right,
                                     shutter_kind::bottom_to_top, shutter_kind::right_to_left};

// Poses of lines by their definition: quaternions along the great circle, positions along the line.
struct moving_pose {
  double q[2][4];
  gart::vec3d p[2];

  moving_pose(std::mt19937_64& random, double angle, double distance) {
    std::normal_distribution<double> normal;
    double turn[4] = {std::cos(angle / 2), 0, 0, 0}, length = 0, turn_length = 0;
    for (double& v : q[0]) v = normal(random), length += v * v;
    for (double& v : q[0]) v /= std::sqrt(length);
    for (int k = 1; k < 4; ++k) turn[k] = normal(random), turn_length += turn[k] * turn[k];
    for (int k = 1; k < 4; ++k) turn[k] *= std::sin(angle / 2) / std::sqrt(turn_length);
    auto const& a = q[0];
    q[1][0] = a[0] * turn[0] - a[1] * turn[1] - a[2] * turn[2] - a[3] * turn[3];
    q[1][1] = a[0] * turn[1] + a[1] * turn[0] + a[2] * turn[3] - a[3] * turn[2];
    q[1][2] = a[0] * turn[2] - a[1] * turn[3] + a[2] * turn[0] + a[3] * turn[1];
    q[1][3] = a[0] * turn[3] + a[1] * turn[2] - a[2] * turn[1] + a[3] * turn[0];
    gart::vec3d step;
    for (int k = 0; k < 3; ++k) p[0][k] = normal(random), step[k] = normal(random);
    p[1] = p[0] + glm::normalize(step) * distance;
  }
  // t from 0, the first line that is read, to 1, the last.
  gart::vec3d position(double t) const { return p[0] * (1 - t) + p[1] * t; }
  gart::mat3d axes(double t) const {
    double cosine = 0, at[4];
    for (int k = 0; k < 4; ++k) cosine += q[0][k] * q[1][k];
    double const angle = std::acos(std::min(cosine, 1.0)), sine = std::sin(angle);
    for (int k = 0; k < 4; ++k)
      at[k] = sine > 1e-9 ? (std::sin((1 - t) * angle) * q[0][k] + std::sin(t * angle) * q[1][k]) / sine : q[0][k];
    double const w = at[0], x = at[1], y = at[2], z = at[3];
    gart::mat3d out;
    out[0] = {1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)};
    out[1] = {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)};
    out[2] = {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)};
    return out;
  }
  gart::camera at(gart::camera c, double t) const {
    c.position = position(t), c.rotation = gart::mat3(axes(t));
    return c;
  }
  gart::camera rolling(gart::camera const& c, shutter_kind shutter) const {
    return gart::rolling_between(at(c, 0), at(c, 1), shutter);
  }
};

template <class Model>
constexpr bool is_rolling = false;
template <class Lens>
constexpr bool is_rolling<gart::rolling_shutter<Lens>> = true;

bool columns_of(shutter_kind s) { return s == shutter_kind::left_to_right || s == shutter_kind::right_to_left; }
bool from_end(shutter_kind s) { return s == shutter_kind::bottom_to_top || s == shutter_kind::right_to_left; }

gart::camera pinhole(int side) {
  gart::camera c;
  c.width = c.height = side;
  c.fx = c.fy = 0.8f * static_cast<float>(side), c.cx = c.cy = 0.5f * static_cast<float>(side);
  return c;
}

gart::camera lens_named(char const* name, int side) {
  for (auto const& lens : gart_test::lenses())
    if (std::string(lens.name) == name) return gart_test::camera_of(lens, side);
  FAIL("no such lens");
  return {};
}

}  // namespace

TEST_CASE_TEMPLATE("lenses with a rolling shutter are traced through the seam", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  E exec;
  gart::camera bent = pinhole(44);
  bent.lens = {0.08f, 0.02f, 0.005f, -0.003f};
  gart::camera const still[] = {pinhole(44), bent, lens_named("OPENCV_FISHEYE", 44), lens_named("EQUIRECTANGULAR", 30)};
  for (int k = 0; k < 4; ++k) {
    CAPTURE(k);
    moving_pose const motion(random, k % 2 ? 0.3 : 0.05, k % 2 ? 0.2 : 0.5);
    gart::camera const c = motion.rolling(still[k], shutters[k]);
    auto const model = gart_test::gaussians_around(c.position, 3, 500, random);
    gart::visit_camera(c, [&](auto const& view) {
      if constexpr (is_rolling<std::decay_t<decltype(view)>>) {
        CHECK(view.one_to_one());
        gart_test::check_hits(exec, view, model);
        gart_test::check_image(exec, view, model);
        gart_test::check_gradients(exec, view, model);
      } else {
        FAIL("another model");
      }
    });
  }
}

TEST_CASE("a line of a rolling shutter has the rays of a camera that stands still where the line is read") {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  std::vector<gart::camera> still{pinhole(40)};
  for (auto const& lens : gart_test::lenses()) still.push_back(gart_test::camera_of(lens, 40));
  for (gart::camera const& lens : still)
    for (shutter_kind const shutter : shutters) {
      moving_pose const motion(random, 0.4, 2);
      gart::camera const c = motion.rolling(lens, shutter);
      REQUIRE(gart::fault_of(c).what == nullptr);
      int const lines = columns_of(shutter) ? c.width : c.height;
      double turned = 0, moved = 0;
      for (int y = 0; y < c.height; y += 3)
        for (int x = 0; x < c.width; x += 3) {
          int const line = columns_of(shutter) ? x : y;
          double const t = static_cast<double>(from_end(shutter) ? lines - 1 - line : line) / (lines - 1);
          float const u = static_cast<float>(x) + 0.5f, v = static_cast<float>(y) + 0.5f;
          gart::ray const got = gart::ray_through(c, u, v), expected = gart::ray_through(motion.at(lens, t), u, v);
          for (int k = 0; k < 3; ++k) {
            turned = std::max(turned, std::abs(double{got.direction[k]} - expected.direction[k]));
            moved = std::max(moved, std::abs(c.position[k] + double{got.origin[k]} - motion.position(t)[k]));
          }
        }
      // The ray of a lens that stands still may be found in floats, to a few of their roundings (camera/undistort.hpp).
      bool const in_floats = lens.kind == gart::camera_kind::perspective && lens.lens.any() && !lens.lens.more();
      CHECK(turned < (in_floats ? 5e-6 : 1e-6));
      CHECK(moved < 1e-6);
      // There and back.
      gart::line_poses const back = gart::poses_of_lines(c);
      for (int k = 0; k < 3; ++k) {
        CHECK(std::abs(back.first.position[k] - motion.position(0)[k]) < 1e-6);
        CHECK(std::abs(back.last.position[k] - motion.position(1)[k]) < 1e-6);
        for (int j = 0; j < 3; ++j) {
          CHECK(std::abs(back.first.rotation[k][j] - motion.axes(0)[k][j]) < 1e-6);
          CHECK(std::abs(back.last.rotation[k][j] - motion.axes(1)[k][j]) < 1e-6);
        }
      }
    }
}

// A shutter that does not move is none: the same rays, and the boxes of the lens that stands still.
TEST_CASE("a rolling shutter without a motion is the lens itself") {
  for (char const* name : {"OPENCV_FISHEYE", "EQUIRECTANGULAR"}) {
    gart::camera c = lens_named(name, 40), rolls = c;
    rolls.shutter = shutter_kind::top_to_bottom;
    for (int y = 0; y < c.height; ++y)
      for (int x = 0; x < c.width; ++x) {
        float const u = static_cast<float>(x) + 0.5f, v = static_cast<float>(y) + 0.5f;
        gart::ray const r = gart::ray_through(rolls, u, v);
        CHECK(r.origin == gart::vec3(0.0f));
        CHECK(r.direction == gart::ray_direction(c, u, v));
      }
  }
}

TEST_CASE("no silhouette leaves its box while the camera moves, and boxes are tight") {
  constexpr double pi = 3.14159265358979323846;
  constexpr int side = 900, around = 240;
  char const* const text = std::getenv("GART_TEST_COUNT");
  long const count = text ? std::atol(text) : 120;
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  auto const uniform = [&](double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(random); };
  std::normal_distribution<double> normal;
  struct size_class {
    double least, most, bar;
  };
  for (char const* name : {"FULL_OPENCV", "OPENCV_FISHEYE", "EQUIRECTANGULAR"})
    for (size_class const& size : {size_class{0.01, 0.1, 1.1}, size_class{0.1, 0.5, 1.4}}) {
      long outside = 0, measured = 0, seen = 0;
      double ratio = 0;
      for (long i = 0; i < count; ++i) {
        gart::camera const lens = lens_named(name, side);
        bool const sphere = lens.kind == gart::camera_kind::equirectangular;
        shutter_kind const shutter = shutters[i % 4];
        bool const columns = columns_of(shutter);
        // 3 degrees and 19% of a unit an image, depths of 2 to 8.
        moving_pose const motion(random, 3 * pi / 180, 0.19);
        gart::camera const c = motion.rolling(lens, shutter);
        double const last = gart_test::last_angle(lens), distance = uniform(2, 8);
        double const theta = sphere ? std::acos(uniform(-0.95, 0.95)) : 0.6 * last * std::sqrt(uniform(0, 1));
        double const phi = uniform(-pi, pi);
        gart::vec3d const d =
            sphere ? gart::vec3d(std::sin(theta) * std::sin(phi), -std::cos(theta), std::sin(theta) * std::cos(phi))
                   : gart::vec3d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
        gart::ellipsoid e;  // from the camera's position
        e.center = gart::mat3d(c.rotation) * d * distance;
        double const s = distance * std::exp(uniform(std::log(size.least), std::log(size.most)));
        gart::mat3d const turn(
            gart::to_matrix({static_cast<float>(normal(random)), static_cast<float>(normal(random)),
                             static_cast<float>(normal(random)), static_cast<float>(normal(random))}));
        for (int k = 0; k < 3; ++k) e.axes[k] = turn[k] * (k == 0 ? s : s * std::exp(uniform(-std::log(20.0), 0)));
        gart::footprint f;
        gart::visit_camera(c, [&](auto const& model) { f = model.bounds(1e-4f)(e); });
        seen += !f.box.empty();
        // Of each line, where the silhouette as it is then crosses it.
        int const lines = columns ? c.width : c.height, along = columns ? c.height : c.width;
        int first_line = lines, last_line = -1, lo = along, hi = -1;
        bool whole = true, wrong = false;
        int const b0 = columns ? f.box.y0 : f.box.x0, b1 = columns ? f.box.y1 : f.box.x1;
        int const l0 = columns ? f.box.x0 : f.box.y0, l1 = columns ? f.box.x1 : f.box.y1;
        for (int line = 0; line < lines; ++line) {
          // Past the seam a box goes on beyond the width.
          int const own = columns && f.seam && line < l0 - 20 ? line + f.seam : line;
          if ((own < l0 - 20 || own > l1 + 20) && line % 16 != 0) continue;
          double const t = static_cast<double>(from_end(shutter) ? lines - 1 - line : line) / (lines - 1);
          gart::mat3d const to_camera = glm::transpose(motion.axes(t));
          gart::vec3d const o = motion.position(t) - c.position, m = to_camera * (e.center - o);
          gart::mat3d const a = to_camera * e.axes, inverse = glm::inverse(a);
          gart::vec3d const p = -(inverse * m);
          double const p2 = glm::dot(p, p);
          if (!(p2 > 1)) {
            whole = false;
            break;
          }
          gart::vec3d const n = p / std::sqrt(p2);
          gart::vec3d const b =
              glm::normalize(glm::cross(n, std::abs(n.x) < 0.6 ? gart::vec3d(1, 0, 0) : gart::vec3d(0, 1, 0)));
          gart::vec3d const middle = m + a * (p / p2), one = a * (std::sqrt(1 - 1 / p2) * b),
                            two = a * (std::sqrt(1 - 1 / p2) * glm::cross(n, b));
          double from = 1e300, to = -1e300, before[2] = {};
          for (int k = 0; k <= around; ++k) {
            gart::vec3d const at = middle + one * std::cos(2 * pi * k / around) + two * std::sin(2 * pi * k / around);
            if (std::atan2(std::hypot(at.x, at.y), at.z) > last) {
              whole = false;
              break;
            }
            double uv[2];
            gart_test::image_by_definition(lens, at.x, at.y, at.z, uv[0], uv[1]);
            double const level = line + 0.5, now[2] = {uv[columns], uv[!columns]};  // along the line, across it
            if (k > 0) {
              if (sphere && std::abs(uv[0] - before[columns]) > 0.4 * c.width) whole = false;  // over the seam
              if ((before[1] < level) != (now[1] < level)) {
                double const share = (level - before[1]) / (now[1] - before[1]);
                double const x = before[0] + share * (now[0] - before[0]);
                from = std::min(from, x), to = std::max(to, x);
              }
            }
            before[0] = now[0], before[1] = now[1];
          }
          if (!whole) break;
          int const x0 = static_cast<int>(std::ceil(from - 0.5 + 2e-3)),
                    x1 = static_cast<int>(std::ceil(to - 0.5 - 2e-3));
          if (!(to > from) || x1 <= x0) continue;
          whole = whole && x0 >= 0 && x1 <= along;
          first_line = std::min(first_line, line), last_line = line, lo = std::min(lo, x0), hi = std::max(hi, x1);
        }
        if (!whole || last_line < 0) continue;
        whole = first_line > 0 && last_line < lines - 1;
        if (f.seam && columns && last_line < l0) first_line += f.seam, last_line += f.seam;
        if (f.seam && !columns && hi <= b0) lo += f.seam, hi += f.seam;
        wrong = lo < b0 || hi > b1 || first_line < l0 || last_line >= l1;
        outside += wrong;
        double const exact = double(hi - lo) * (last_line + 1 - first_line);
        if (!whole || exact < 400) continue;  // where a pixel at the border counts for little
        ++measured, ratio += f.box.area() / exact;
      }
      CAPTURE(name);
      CAPTURE(size.most);
      ratio /= static_cast<double>(std::max(measured, 1l));
      CAPTURE(ratio);
      CAPTURE(measured);
      if (std::getenv("GART_TEST_TABLE"))
        std::printf("| rolling %s | %g | %ld | %ld | %ld | %.4f |\n", name, size.most, count, outside, measured, ratio);
      CHECK(outside == 0);
      CHECK(seen > count / 4);
      CHECK(measured > count / 10);
      CHECK(ratio < size.bar);
    }
}
