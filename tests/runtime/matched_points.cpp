// Points matched in photographs of a textured slope, whose every pixel's depth is known.
#include <gart/camera/models.hpp>
#include <gart/optim/random.hpp>
#include <gart/runtime/matched_points.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#if defined(_OPENMP)
#include <omp.h>
#endif

namespace {

// Smooth noise: random levels on a grid, and between them.
float noise(double x, double y, gart::u32 channel) {
  auto const level = [&](double i, double j) {
    gart::random_source const source{17, channel};
    auto const at = static_cast<gart::u64>((i + 1000) * 4096 + (j + 1000));
    return gart::uniform(source.words(at).v[0]);
  };
  double const i = std::floor(x), j = std::floor(y), a = x - i, b = y - j;
  return static_cast<float>((1 - b) * ((1 - a) * level(i, j) + a * level(i + 1, j)) +
                            b * ((1 - a) * level(i, j + 1) + a * level(i + 1, j + 1)));
}

gart::vec3 textured(double x, double y) {
  return {noise(8 * x, 8 * y, 0), noise(8 * x, 8 * y, 1), noise(8 * x, 8 * y, 2)};
}

// The slope z = 4 + 0.3 x.
gart::dataset photographs_of(gart::vec3 (*color)(double, double), int views, gart::distortion const& lens = {},
                             double spread = 1) {
  gart::dataset data;
  data.extent = 1.1f;
  for (int i = 0; i < views; ++i) {
    gart::dataset_view v;
    gart::camera& c = v.view;
    c.width = 160, c.height = 120, c.fx = 150, c.fy = 140, c.cx = 81, c.cy = 59, c.lens = lens;
    c.position = gart::vec3d(-1 + 2.0 * (i % 4) / 3, 0.4 * (i / 4) - 0.4, 0.05 * i) * spread;
    float const turn = -0.2f * static_cast<float>(c.position.x);
    c.rotation = gart::mat3(std::cos(turn), 0, -std::sin(turn), 0, 1, 0, std::sin(turn), 0, std::cos(turn));
    v.image = gart::image8(c.width, c.height, 3);
    for (int y = 0; y < c.height; ++y) {
      for (int x = 0; x < c.width; ++x) {
        gart::vec3d const d(gart::ray_direction(c, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f));
        double const t = (4 + 0.3 * c.position.x - c.position.z) / (d.z - 0.3 * d.x);
        gart::vec3 const seen = color(c.position.x + t * d.x, c.position.y + t * d.y);
        for (int k = 0; k < 3; ++k) v.image.at(x, y, k) = static_cast<gart::u8>(20 + 200 * seen[k]);
      }
    }
    data.train.push_back(std::move(v));
  }
  return data;
}

void check_on_slope(gart::point_cloud const& points) {
  std::size_t off = 0, other_color = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    float const* const p = &points.position[3 * i];
    off += std::fabs(p[2] - (4 + 0.3f * p[0])) > 0.06f;
    gart::vec3 const color = textured(p[0], p[1]);
    for (int k = 0; k < 3; ++k)
      other_color += std::fabs(static_cast<float>(points.color[3 * i + k]) - (20 + 200 * color[k])) > 30;
  }
  CHECK(points.color.size() == points.position.size());
  CHECK(off <= points.size() / 50);
  CHECK(other_color <= 3 * points.size() / 20);
}

}  // namespace

TEST_CASE("photographs are matched to points on surfaces") {
  auto const points = gart::match_photographs(photographs_of(textured, 12), 3000, 1);
  CHECK(points.size() > 1000);
  check_on_slope(points);
}

TEST_CASE("photographs through lenses are matched too") {
  gart::distortion lens;
  lens.k1 = -0.15f, lens.k2 = 0.03f, lens.p1 = 0.01f;
  auto const points = gart::match_photographs(photographs_of(textured, 12, lens), 3000, 1);
  CHECK(points.size() > 1000);
  check_on_slope(points);
}

TEST_CASE("matched points are the same on any number of threads") {
  auto const data = photographs_of(textured, 8);
  double last = 0;
  auto const points = gart::match_photographs(data, 500, 1, [&](double done) {
    CHECK(done > last);
    last = done;
  });
  CHECK(last <= 1);
  REQUIRE(points.size() > 100);
#if defined(_OPENMP)
  int const threads = omp_get_max_threads();
  omp_set_num_threads(1);
#endif
  auto const alone = gart::match_photographs(data, 500, 1);
#if defined(_OPENMP)
  omp_set_num_threads(threads);
#endif
  CHECK(alone.position == points.position);
  CHECK(alone.color == points.color);
  CHECK(gart::match_photographs(data, 500, 2).position != points.position);
}

TEST_CASE("no points where photographs do not tell depth") {
  auto const plain = [](double, double) { return gart::vec3(0.5f); };
  CHECK(gart::match_photographs(photographs_of(plain, 12), 1000, 1).size() == 0);
  // Rays meet at less than a degree.
  CHECK(gart::match_photographs(photographs_of(textured, 12, {}, 0.04), 1000, 1).size() == 0);
  auto few = photographs_of(textured, 3);
  CHECK(gart::match_photographs(few, 1000, 1).size() == 0);
  CHECK(gart::match_photographs({}, 1000, 1).size() == 0);
}

TEST_CASE("masked, clear and spherical photographs give no points") {
  auto masked = photographs_of(textured, 8), clear = masked, round = masked;
  for (auto& v : masked.train) {
    v.mask = gart::image8(160, 120, 1, 255);
    for (int y = 0; y < 120; ++y)
      for (int x = 0; x < 80; ++x) v.mask.at(x, y, 0) = 0;
  }
  std::size_t const half = gart::match_photographs(masked, 2000, 1).size();
  CHECK(half > 100);
  CHECK(half < gart::match_photographs(clear, 2000, 1).size());
  for (auto& v : clear.train) v.image = gart::image8(160, 120, 4, 0);
  CHECK(gart::match_photographs(clear, 1000, 1).size() == 0);
  for (auto& v : round.train) v.view.kind = gart::camera_kind::equirectangular;
  CHECK(gart::match_photographs(round, 1000, 1).size() == 0);
}
