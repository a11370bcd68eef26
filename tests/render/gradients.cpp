// Gradients of a random linear function of the image, group by group, against the oracle.
#include <render/expected.hpp>

#include <cmath>
#include <random>
#include <string>

using namespace gart_test;

namespace {

struct group {
  std::string name;
  std::vector<float> gart::gaussian_model::*got;
  std::vector<double> oracle::parameters::*expected;
};
group const groups[] = {{"mean", &gart::gaussian_model::mean, &oracle::parameters::mean},
                        {"log_scale", &gart::gaussian_model::log_scale, &oracle::parameters::log_scale},
                        {"quaternion", &gart::gaussian_model::quaternion, &oracle::parameters::quaternion},
                        {"opacity", &gart::gaussian_model::opacity, &oracle::parameters::opacity},
                        {"sh", &gart::gaussian_model::sh, &oracle::parameters::sh}};

// norm(difference) / norm(expected); infinite where a value is not finite.
double relative_error(std::vector<float> const& got, std::vector<double> const& expected) {
  double error = 0, norm = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    error += (got[i] - expected[i]) * (got[i] - expected[i]);
    norm += expected[i] * expected[i];
  }
  if (!std::isfinite(error)) return INFINITY;
  return error == 0 ? 0 : std::sqrt(error / norm);
}

struct weighted_image {
  std::vector<float> color_gradient;
  oracle::parameters gradients;
  std::size_t aside = 0;
};

// Zero where rounding may take another branch: there the gradient of either side is right.
std::vector<weighted_image> const& weighted_images() {
  static std::vector<weighted_image> const all = [] {
    std::vector<weighted_image> out;
    std::mt19937_64 engine(seed() + 1);
    std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
    for (auto const& e : expectations()) {
      weighted_image w;
      for (auto const& p : e.picture.pixels) {
        bool const aside = p.edge || p.kink || p.slope_rounding > 1e-3;
        w.aside += aside;
        for (int c = 0; c < 3; ++c) w.color_gradient.push_back(aside ? 0.0f : uniform(engine));
      }
      auto const& s = e.scene;
      w.gradients = oracle::gradients(e.parameters, s.view, s.options, s.active_degree,
                                      {w.color_gradient.begin(), w.color_gradient.end()});
      out.push_back(std::move(w));
    }
    return out;
  }();
  return all;
}

}  // namespace

TEST_CASE_TEMPLATE("gradients agree with the oracle", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  for (std::size_t i = 0; i < expectations().size(); ++i) {
    auto const& e = expectations()[i];
    auto const& w = weighted_images()[i];
    auto const& s = e.scene;
    CAPTURE(s.name);
    CHECK(w.aside <= 2 + e.picture.pixels.size() / 20);
    for (auto kind : tracers<E>()) {
      int const tracer = static_cast<int>(kind);
      CAPTURE(tracer);
      for (std::string const& strategy : strategies_for(kind, s.model.sh_degree)) {
        CAPTURE(strategy);
        auto const got =
            scene_gradients(exec, s.model, s.view, s.options, s.active_degree, kind, strategy, w.color_gradient);
        for (auto const& g : groups) {
          CAPTURE(g.name);
          REQUIRE((got.*g.got).size() == (w.gradients.*g.expected).size());
          CHECK(relative_error(got.*g.got, w.gradients.*g.expected) <= 1e-4);
        }
      }
    }
  }
}
