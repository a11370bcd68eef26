#include <support/policies.hpp>

#include <gart/loss/metrics.hpp>

#include "oracle.hpp"

using namespace gart;

TEST_CASE("psnr and ssim follow definitions, of the clamped render") {
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

TEST_CASE("psnr counts the pixels of a mask over a background") {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  std::uniform_real_distribution<float> u(0, 1);
  image8 photo(13, 7, 4), mask(13, 7, 1);
  for (auto& v : photo.data) v = static_cast<u8>(256 * u(random));
  for (auto& v : mask.data) v = u(random) < 0.3f ? 0 : 200;
  image_float render(13, 7, 3);
  for (auto& v : render.data) v = u(random);
  double sum = 0;
  int count = 0;
  for (int y = 0; y < 7; ++y) {
    for (int x = 0; x < 13; ++x) {
      if (mask.at(x, y, 0) == 0) continue;
      double const a = photo.at(x, y, 3) / 255.0;
      for (int c = 0; c < 3; ++c, ++count)
        sum += std::pow(render.at(x, y, c) - (photo.at(x, y, c) / 255.0 * a + (0.2 + 0.3 * c) * (1 - a)), 2);
    }
  }
  image_float const truth = composited(photo, vec3(0.2f, 0.5f, 0.8f));
  double const share = apply_mask(mask, truth, render);
  CHECK(share == doctest::Approx(count / 3 / (13.0 * 7)));
  CHECK(masked_psnr(render, truth, share) == doctest::Approx(-10 * std::log10(sum / count)).epsilon(1e-6));
}

TEST_CASE("metrics at the edges") {
  image_float black(4, 4, 3), white(4, 4, 3, 1.0f), wide(5, 4, 3), none;
  CHECK(psnr(black, white) == doctest::Approx(0));
  CHECK(std::isinf(psnr(white, white)));
  CHECK(ssim(white, white) == doctest::Approx(1).epsilon(1e-12));
  CHECK_THROWS_AS(psnr(black, wide), invalid_argument);
  CHECK_THROWS_AS(ssim(none, none), invalid_argument);
}
