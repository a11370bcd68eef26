// The best affine colour of a view: against Eigen's least squares, maps that are known, and images that leave it open.
#include <support/policies.hpp>

#include <gart/loss/affine_color.hpp>

#include <Eigen/Dense>

#include <random>

using namespace gart;

namespace {

image_float random_image(std::mt19937_64& random, int w, int h, float low, float high) {
  std::uniform_real_distribution<float> u(low, high);
  image_float image(w, h, 3);
  for (auto& v : image.data) v = u(random);
  return image;
}

// Columns r, g, b, 1 of the clamped render, and the truth, of the pixels that count.
std::pair<Eigen::MatrixXd, Eigen::MatrixXd> system_of(image_float const& render, image_float const& truth,
                                                      image8 const& mask) {
  std::vector<std::size_t> kept;
  for (std::size_t p = 0; p < truth.data.size() / 3; ++p)
    if (mask.empty() || mask.data[p] != 0) kept.push_back(p);
  Eigen::MatrixXd x(kept.size(), 4), y(kept.size(), 3);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      x(i, c) = std::min(1.0f, std::max(0.0f, render.data[3 * kept[i] + c]));
      y(i, c) = truth.data[3 * kept[i] + c];
    }
    x(i, 3) = 1;
  }
  return {x, y};
}

}  // namespace

TEST_CASE("the fit is Eigen's least squares; PSNR clamps colours") {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  for (bool const masked : {false, true}) {
    CAPTURE(masked);
    image_float const render = random_image(random, 31, 17, -0.2f, 1.2f), truth = random_image(random, 31, 17, 0, 1);
    image8 mask;
    if (masked) {
      mask = image8(31, 17, 1);
      for (auto& v : mask.data) v = random() % 3 == 0 ? 0 : 200;
    }
    auto const [x, y] = system_of(render, truth, mask);
    Eigen::MatrixXd const best = x.householderQr().solve(y);
    affine_color const fit = fit_affine_color(render, truth, mask);
    for (int to = 0; to < 3; ++to) {
      for (int from = 0; from < 3; ++from) CHECK(std::abs(fit.matrix[to][from] - best(from, to)) < 1e-9);
      CHECK(std::abs(fit.offset[to] - best(3, to)) < 1e-9);
    }
    double const mean_square =
        ((x * best).cwiseMax(0.0).cwiseMin(1.0) - y).squaredNorm() / static_cast<double>(y.size());
    CHECK(psnr_affine_color(render, truth, mask) == doctest::Approx(-10 * std::log10(mean_square)).epsilon(1e-9));
    image_float scored = render;
    double const share = apply_mask(mask, truth, scored);
    CHECK(psnr_affine_color(render, truth, mask) >= masked_psnr(scored, truth, share));
  }
}

TEST_CASE("an error of exposure and white balance alone is undone") {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  image_float const render = random_image(random, 24, 24, 0, 1);
  double const matrix[3][3] = {{0.5, 0.1, 0.0}, {-0.1, 0.6, 0.1}, {0.05, 0.0, 0.4}}, offset[3] = {0.1, 0.2, 0.05};
  image_float truth(24, 24, 3);
  for (std::size_t p = 0; p < truth.data.size(); p += 3) {
    for (int to = 0; to < 3; ++to) {
      double v = offset[to];
      for (int from = 0; from < 3; ++from) v += matrix[to][from] * render.data[p + from];
      truth.data[p + to] = static_cast<float>(v);
    }
  }
  affine_color const fit = fit_affine_color(render, truth);
  for (int to = 0; to < 3; ++to) {
    for (int from = 0; from < 3; ++from) CHECK(std::abs(fit.matrix[to][from] - matrix[to][from]) < 1e-6);
    CHECK(std::abs(fit.offset[to] - offset[to]) < 1e-6);
  }
  CHECK(psnr(render, truth) < 20);
  CHECK(psnr_affine_color(render, truth) > 120);
}

TEST_CASE("grey, constant and hidden renders leave directions open") {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  image_float const truth = random_image(random, 20, 20, 0, 1);
  image_float grey = random_image(random, 20, 20, 0, 1);
  for (std::size_t p = 0; p < grey.data.size(); p += 3) grey.data[p + 1] = grey.data[p + 2] = grey.data[p];
  auto const [x, y] = system_of(grey, truth, {});
  Eigen::MatrixXd const best = x.completeOrthogonalDecomposition().solve(y);
  double const mean_square = (x * best - y).squaredNorm() / static_cast<double>(y.size());
  CHECK(psnr_affine_color(grey, truth) == doctest::Approx(-10 * std::log10(mean_square)).epsilon(1e-6));

  // Of a constant the best map is the truth's mean.
  affine_color const flat = fit_affine_color(image_float(20, 20, 3, 0.25f), truth);
  for (int c = 0; c < 3; ++c) {
    double mean = 0;
    for (std::size_t p = 0; p < truth.data.size(); p += 3) mean += truth.data[p + c] / 400.0;
    CHECK(flat.offset[c] == doctest::Approx(mean));
    for (int from = 0; from < 3; ++from) CHECK(flat.matrix[c][from] == 0);
  }

  affine_color const hidden = fit_affine_color(grey, truth, image8(20, 20, 1, 0));
  CHECK(hidden.matrix[1][1] == 1);
  CHECK(hidden.offset[1] == 0);
  CHECK_THROWS_AS(psnr_affine_color(grey, image_float(19, 20, 3)), invalid_argument);
  CHECK_THROWS_AS(psnr_affine_color(image_float(4, 4, 1), image_float(4, 4, 1)), invalid_argument);
}
