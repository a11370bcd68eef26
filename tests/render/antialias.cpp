// What a pixel shows of one Gaussian through its filter, against the integral over the pixel in double; and what a
// filter must leave alone.
#include <support/policies.hpp>
#include <support/scene_by_kind.hpp>

#include <gart/render/antialiased.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

using namespace gart_test;

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double filter_pixels = gart::default_antialias;

// In camera axes, and as seen from it: where the camera is among the Gaussian's own axes, in units of them, and which
// way its axes go there. By plain numbers: integrals are millions of these.
struct blob {
  double sigma, camera[3], axes[3][3];

  blob(Vector3d const& mean, Matrix3d const& to_unit, double of) : sigma(of) {
    Vector3d const at = -(to_unit * mean);
    for (int k = 0; k < 3; ++k) {
      camera[k] = at[k];
      for (int j = 0; j < 3; ++j) axes[k][j] = to_unit(k, j);
    }
  }
  double alpha(double x, double y) const {
    double d[3], along = 0, d2 = 0, p2 = 0;
    for (int k = 0; k < 3; ++k) {
      d[k] = axes[k][0] * x + axes[k][1] * y + axes[k][2];
      along += camera[k] * d[k], d2 += d[k] * d[k];
    }
    double const t = -along / d2;
    for (int k = 0; k < 3; ++k) p2 += (camera[k] + t * d[k]) * (camera[k] + t * d[k]);
    return sigma * std::exp(-0.5 * p2);
  }
};

// The mean of alpha about pixel (i, j), weighted as a filter weighs: a sum that is exact to far below the tolerance,
// its steps being half of the narrowest that it sums. The filter is round: on the image, or seen from the camera, where
// it takes the pixel's solid angle. These are one in the middle of an image; to its sides a square pixel is a long
// diamond of directions.
enum class roundness { on_image, from_camera };
double integral(blob const& b, gart::camera const& c, int i, int j, roundness where) {
  double const step = 0.05, reach = 4.5 * filter_pixels;
  double const x = (i + 0.5 - c.cx) / c.fx, y = (j + 0.5 - c.cy) / c.fy;
  Vector3d const middle(x, y, 1), n = middle.normalized(), side = n.unitOrthogonal(), across = n.cross(side);
  double const angle = std::pow(middle.norm(), -1.5) / std::sqrt(double{c.fx} * c.fy);
  std::vector<double> steps, weight_of;
  for (double u = -reach; u <= reach; u += step) {
    steps.push_back(u);
    weight_of.push_back(std::exp(-0.5 * u * u / (filter_pixels * filter_pixels)));
  }
  double sum = 0, weights = 0;
  for (std::size_t row = 0; row < steps.size(); ++row)
    for (std::size_t column = 0; column < steps.size(); ++column) {
      double const u = steps[column], v = steps[row], weight = weight_of[row] * weight_of[column];
      weights += weight;
      if (where == roundness::on_image) {
        sum += weight * b.alpha(x + u / c.fx, y + v / c.fy);
        continue;
      }
      double const p = angle * u, q = angle * v, z = n[2] + p * side[2] + q * across[2];
      sum += weight * b.alpha((n[0] + p * side[0] + q * across[0]) / z, (n[1] + p * side[1] + q * across[1]) / z);
    }
  return sum / weights;
}

struct errors {
  double with = 0, on_image = 0, without = 0;
};

// A Gaussian, and what the pixels about its middle see of it, row by row.
struct small_gaussian {
  gart::gaussian_model model;
  int x0, x1, y0, y1;
  std::vector<double> on_image, from_camera;
};

// `half_view`: slope of the image's corner.
gart::camera view_of(double half_view) {
  gart::camera c;
  c.width = c.height = 48;
  c.fx = c.fy = static_cast<float>(24 * std::sqrt(2.0) / half_view);
  c.cx = 23.7f, c.cy = 24.4f;
  return c;
}

std::vector<small_gaussian> draw(gart::camera const& c) {
  std::mt19937_64 random(seed());
  auto const uniform = [&](double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(random); };
  std::normal_distribution<double> normal;
  std::vector<small_gaussian> all(40);
  for (small_gaussian& g : all) {
    double const depth = std::exp(uniform(-1, 3)), pixel = depth / c.fx;
    Vector3d const mean((uniform(3, 45) - c.cx) * pixel, (uniform(3, 45) - c.cy) * pixel, depth);
    Eigen::Quaterniond const q(normal(random), normal(random), normal(random), normal(random));
    Vector3d scale;
    for (int k = 0; k < 3; ++k) scale[k] = pixel * std::exp(uniform(std::log(0.1), std::log(3.0)));
    double const sigma = uniform(0.3, 0.95);
    gart::gaussian_model& m = g.model;
    m.resize(1, 0);
    for (std::size_t k = 0; k < 3; ++k) {
      m.mean[k] = static_cast<float>(mean[static_cast<int>(k)]);
      m.log_scale[k] = static_cast<float>(std::log(scale[static_cast<int>(k)]));
    }
    m.quaternion = {static_cast<float>(q.w()), static_cast<float>(q.x()), static_cast<float>(q.y()),
                    static_cast<float>(q.z())};
    m.opacity = {static_cast<float>(std::log(sigma / (1 - sigma)))};
    // S^-1 R^T
    blob const b(mean, scale.cwiseInverse().asDiagonal() * q.normalized().toRotationMatrix().transpose(), sigma);
    int const x = static_cast<int>(mean.x() / pixel + c.cx), y = static_cast<int>(mean.y() / pixel + c.cy);
    g.x0 = std::max(0, x - 3), g.x1 = std::min(c.width, x + 4);
    g.y0 = std::max(0, y - 3), g.y1 = std::min(c.height, y + 4);
    for (int j = g.y0; j < g.y1; ++j)
      for (int i = g.x0; i < g.x1; ++i) {
        g.on_image.push_back(integral(b, c, i, j, roundness::on_image));
        g.from_camera.push_back(integral(b, c, i, j, roundness::from_camera));
      }
  }
  return all;
}

// The integrals take nearly all of the time: once for all policies.
std::vector<small_gaussian> const& drawn(double half_view) {
  static std::map<double, std::vector<small_gaussian>> known;
  auto const [at, is_new] = known.try_emplace(half_view);
  if (is_new) at->second = draw(view_of(half_view));
  return at->second;
}

template <class E>
errors worst_errors(E& exec, double half_view) {
  gart::camera const c = view_of(half_view);
  gart::render_options options;
  options.alpha_min = 1e-4f;
  errors worst;
  for (small_gaussian const& g : drawn(half_view)) {
    for (bool const filtered : {true, false}) {
      options.antialias = filtered ? static_cast<float>(filter_pixels) : 0;
      auto const got = render_scene(exec, g.model, c, options, 0, tracer_kind::tiles);
      std::size_t pixel = 0;
      for (int j = g.y0; j < g.y1; ++j)
        for (int i = g.x0; i < g.x1; ++i, ++pixel) {
          double const alpha = 1 - got.transmittance[static_cast<std::size_t>(j * c.width + i)];
          double const on_image = std::abs(alpha - g.on_image[pixel]);
          if (!filtered) {
            worst.without = std::max(worst.without, on_image);
            continue;
          }
          worst.on_image = std::max(worst.on_image, on_image);
          worst.with = std::max(worst.with, std::abs(alpha - g.from_camera[pixel]));
        }
    }
  }
  return worst;
}

}  // namespace

TEST_CASE_TEMPLATE("each pixel sees a small Gaussian through its filter", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  // Wide views: a Gaussian some pixels long reaches where pixels are smaller than at its mean, whose filter it has.
  struct {
    double half_view, from_camera, on_image;
  } const views[] = {{0.1, 0.005, 0.005}, {0.6, 0.01, 0.02}, {1.0, 0.02, 0.05}};
  for (auto const& [half_view, from_camera, on_image] : views) {
    CAPTURE(half_view);
    errors const worst = worst_errors(exec, half_view);
    MESSAGE(std::string(E::name) << ", corner at slope " << half_view << ": " << worst.with << ", on the image "
                                 << worst.on_image << "; without a filter " << worst.without);
    CHECK(worst.with < from_camera);
    CHECK(worst.on_image < on_image);
    CHECK(worst.without > 0.1);
  }
}

TEST_CASE_TEMPLATE("without a filter a scene is seen as it is stored", E, GART_TEST_POLICIES) {
  E exec;
  gart::gaussian_model model;
  model.resize(3, 1);
  gart::gaussians<E> const scene(exec, model);
  gart::antialiased<E> filter(exec);
  gart::camera view;
  view.width = view.height = 8, view.fx = view.fy = 8, view.cx = view.cy = 4;
  auto const before = exec.memory.current;
  auto const stored = scene.view(), seen = filter.of(exec, stored, view, 0);
  CHECK(seen.log_scale == stored.log_scale);
  CHECK(seen.opacity == stored.opacity);
  CHECK(exec.memory.current == before);
  auto const filtered = filter.of(exec, stored, view, 0.3f);
  CHECK(filtered.log_scale != stored.log_scale);
  CHECK(filtered.mean == stored.mean);
  CHECK(filtered.sh == stored.sh);
}
