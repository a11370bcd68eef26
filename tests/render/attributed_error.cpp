// The error of the pixels that the backward pass attributes to the Gaussians: by every method the sum of weight times
// error over a Gaussian's hits, as the hit lists have them.
#include <render/expected.hpp>

#include <cmath>
#include <random>
#include <string>

using namespace gart_test;

TEST_CASE_TEMPLATE("a pixel's error goes to the Gaussians that show in it", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  std::mt19937_64 engine(seed + 2);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (auto const& e : expectations()) {
    auto const& s = e.scene;
    CAPTURE(s.name);
    std::size_t const pixels = static_cast<std::size_t>(s.view.width) * s.view.height;
    attributed_error error;
    for (std::size_t i = 0; i < pixels; ++i) error.of_pixels.push_back(uniform(engine));
    std::vector<float> const gradient(3 * pixels, 1e-3f);
    for (auto kind : tracers<E>()) {
      int const tracer = static_cast<int>(kind);
      CAPTURE(tracer);
      std::vector<double> expected(s.model.size());
      double largest = 0;
      auto const lists = hit_lists(exec, s.model, s.view, s.options, kind);
      for (std::size_t i = 0; i < pixels; ++i) {
        double transmittance = 1;
        for (gart::hit const& h : lists[i]) {
          expected[h.id] += transmittance * h.alpha * error.of_pixels[i];
          transmittance *= 1 - static_cast<double>(h.alpha);
          largest = std::max(largest, expected[h.id]);
        }
      }
      for (std::string const& method : methods_for(kind, s.model.sh_degree)) {
        CAPTURE(method);
        error.of_gaussians.clear();
        scene_gradients(exec, s.model, s.view, s.options, s.active_degree, kind, method, gradient, &error);
        REQUIRE(error.of_gaussians.size() == expected.size());
        double worst = 0;
        for (std::size_t i = 0; i < expected.size(); ++i)
          worst = std::max(worst, std::abs(error.of_gaussians[i] - expected[i]));
        CHECK(worst <= 1e-4 * largest);
      }
    }
  }
}
