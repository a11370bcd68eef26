#include <support/policies.hpp>

#include <gart/loss/metrics.hpp>

#include "oracle.hpp"

using namespace gart;

TEST_CASE("psnr and ssim are those of the definitions, of the clamped render") {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  std::uniform_real_distribution<float> u(0, 1);
  image_float render(41, 23, 3), truth(41, 23, 3);
  for (auto& v : truth.data) v = u(random);
  for (std::size_t i = 0; i < render.data.size(); ++i) render.data[i] = truth.data[i] + u(random) - 0.5f;
  std::vector<double> x, y(truth.data.begin(), truth.data.end());
  for (float const v : render.data) x.push_back(std::min(1.0f, std::max(0.0f, v)));
  auto const expected = gart_test::naive_loss(x, y, 41, 23);
  CHECK(psnr(render, truth) == doctest::Approx(-10 * std::log10(expected.mse)).epsilon(1e-12));
  CHECK(ssim(render, truth) == doctest::Approx(expected.ssim).epsilon(1e-10));
}

TEST_CASE("metrics at the edges") {
  image_float black(4, 4, 3), white(4, 4, 3, 1.0f), wide(5, 4, 3), none;
  CHECK(psnr(black, white) == doctest::Approx(0));
  CHECK(std::isinf(psnr(white, white)));
  CHECK(ssim(white, white) == doctest::Approx(1).epsilon(1e-12));
  CHECK_THROWS_AS(psnr(black, wide), invalid_argument);
  CHECK_THROWS_AS(ssim(none, none), invalid_argument);
}
