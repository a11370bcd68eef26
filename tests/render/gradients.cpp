// Gradients of a random linear function of the image, group by group, against the oracle.
#include <render/expected.hpp>

#include <random>
#include <string>

using namespace gart_test;

namespace {

std::vector<weighted_image> const& weighted_images() {
  static std::vector<weighted_image> const all = [] {
    std::vector<weighted_image> out;
    std::mt19937_64 engine(seed() + 1);
    for (auto const& e : expectations()) out.push_back(weighted(e.scene, e.parameters, e.picture, engine));
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
    // Axes that differ a thousandfold lose three digits of single precision; some seeds lose a little more than others.
    double const bound = s.name == "needles" || s.name == "pancakes" ? 3e-4 : 1e-4;
    for (auto kind : tracers<E>()) {
      int const tracer = static_cast<int>(kind);
      CAPTURE(tracer);
      for (std::string const& method : methods_for(kind, s.model.sh_degree)) {
        CAPTURE(method);
        auto const got =
            scene_gradients(exec, s.model, s.view, s.options, s.active_degree, kind, method, w.color_gradient);
        for (auto const& g : gradient_groups) {
          CAPTURE(g.name);
          REQUIRE((got.*g.got).size() == (w.gradients.*g.expected).size());
          CHECK(relative_error(got.*g.got, w.gradients.*g.expected) <= bound);
        }
      }
    }
  }
}
