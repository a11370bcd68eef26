// The exposure of a view that was not trained on, from views whose exposures are known; and when they are learned.
#include <support/policies.hpp>

#include <gart/exposure/exposure_field.hpp>

#include <cmath>

namespace {

gart::camera camera_at(double x, double y, float angle) {
  gart::camera c;
  c.width = 4, c.height = 3, c.fx = c.fy = 4, c.cx = 2, c.cy = 1.5f;
  c.position = {x, y, 0};
  float const cosine = std::cos(angle), sine = std::sin(angle);
  c.rotation = gart::mat3(gart::vec3(cosine, 0, -sine), gart::vec3(0, 1, 0), gart::vec3(sine, 0, cosine));
  return c;
}

gart::view_exposure exposed(gart::camera const& c, float gain, float offset) {
  gart::view_exposure v{"view", c.position, c.rotation[2], {}};
  for (int k = 0; k < 3; ++k) v.value.m[5 * k] = gain, v.value.m[4 * k + 3] = offset;
  return v;
}

}  // namespace

TEST_CASE("without views all have the identity; with one, its own") {
  gart::exposure const identity;
  auto const none = gart::exposure_field().at(camera_at(0, 0, 0));
  for (int k = 0; k < gart::exposure::floats; ++k) CHECK(none.exposed.m[k] == identity.m[k]);
  gart::exposure_field const one({exposed(camera_at(1, 2, 0.3f), 0.7f, 0.1f)});
  for (double const far : {0.0, 1e-3, 10.0, 1e6}) {
    auto const e = one.at(camera_at(1 + far, 2, 0.3f));
    CHECK(e.exposed.m[0] == doctest::Approx(0.7f).epsilon(1e-6));
    CHECK(e.exposed.m[3] == doctest::Approx(0.1f).epsilon(1e-6));
  }
}

TEST_CASE("between training views exposures mix; far off they average") {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> gain(0.5f, 1.5f);
  std::vector<gart::view_exposure> views;
  double mean = 0;
  for (int i = 0; i < 20; ++i) {
    views.push_back(exposed(camera_at(3.0 * i, 0.2 * i, 0.05f * static_cast<float>(i)), gain(random), 0.01f));
    mean += static_cast<double>(views.back().value.m[0]) / 20;
  }
  gart::exposure_field const field(views);
  for (int i = 0; i < 20; ++i) {
    auto const e = field.at(camera_at(3.0 * i, 0.2 * i, 0.05f * static_cast<float>(i)));
    CHECK(e.exposed.m[0] == doctest::Approx(views[static_cast<std::size_t>(i)].value.m[0]).epsilon(0.01));
  }
  auto const far = field.at(camera_at(1e9, 1e9, 3));
  CHECK(far.exposed.m[0] == doctest::Approx(mean).epsilon(0.02));
  CHECK(far.exposed.m[3] == doctest::Approx(0.01f).epsilon(1e-3));
  CHECK(far.exposed.m[1] == doctest::Approx(0.0f));

  // A line is followed between the views it was sampled at, by any scale of the scene.
  for (double const scale : {1e-3, 1.0, 1e4}) {
    CAPTURE(scale);
    std::vector<gart::view_exposure> line;
    for (int i = 0; i < 20; ++i)
      line.push_back(exposed(camera_at(scale * i, 0, 0), 0.6f + 0.02f * static_cast<float>(i), 0));
    auto const between = gart::exposure_field(line).at(camera_at(scale * 9.4, 0, 0));
    CHECK(between.exposed.m[0] == doctest::Approx(0.6 + 0.02 * 9.4).epsilon(0.005));
  }
}

TEST_CASE("views in one place, or one of them twice, are no difficulty") {
  std::vector<gart::view_exposure> views(5, exposed(camera_at(1, 1, 0), 0.8f, 0));
  views.push_back(exposed(camera_at(1, 1, 0), 1.4f, 0));
  auto const e = gart::exposure_field(views).at(camera_at(1, 1, 0));
  CHECK(e.exposed.m[0] == doctest::Approx(0.9f).epsilon(1e-4));
}

TEST_CASE("a view has the falloff of the lens most like its own") {
  std::vector<gart::lens_falloff> lenses;
  for (float const focal : {4.0f, 6.0f}) {
    gart::camera lens = camera_at(0, 0, 0);
    lens.fx = lens.fy = focal;
    gart::vignetting falloff;
    for (int c = 0; c < 3; ++c)
      falloff.k[3 * c] = -0.1f * focal, falloff.k[3 * c + 1] = 0.02f,
                    falloff.k[3 * c + 2] = 0.01f * static_cast<float>(c);
    lenses.emplace_back(lens, falloff);
  }
  gart::exposure_field const field({exposed(camera_at(0, 0, 0), 0.5f, 0.1f)}, lenses);
  for (float const focal : {3.5f, 4.0f, 6.0f, 7.0f}) {
    CAPTURE(focal);
    gart::camera view = camera_at(5, 0, 0);
    view.fx = view.fy = focal;
    view = gart::resized(view, 12, 9);
    auto const response = field.at(view);
    CHECK(response.falloff.k[0] == (focal < 5 ? -0.4f : -0.6f));
    // Of each pixel what the lens lets through, exposed.
    gart::image_float image(12, 9, 3, 0.6f);
    apply(response, image);
    for (int y = 0; y < 9; ++y) {
      for (int x = 0; x < 12; ++x) {
        double const dx = x + 0.5 - 6, dy = y + 0.5 - 4.5, u = (dx * dx + dy * dy) / (6 * 6 + 4.5 * 4.5);
        for (int c = 0; c < 3; ++c) {
          double const gain = 1 + static_cast<double>(response.falloff.k[0]) * u + 0.02 * u * u + 0.01 * c * u * u * u;
          CHECK(image.at(x, y, c) == doctest::Approx(0.5 * gain * 0.6 + 0.1).epsilon(1e-5));
        }
      }
    }
  }
  gart::camera sphere = camera_at(5, 0, 0);
  sphere.kind = gart::camera_kind::equirectangular;
  CHECK(field.at(sphere).gain(0, 3, 2) == 1);
  // Without lenses there is none, without views colours stay but for it.
  gart::image_float plain(4, 3, 3, 0.6f), shaded = plain;
  apply(gart::exposure_field().at(camera_at(0, 0, 0)), plain);
  CHECK(plain.data == std::vector<float>(36, 0.6f));
  apply(gart::exposure_field({}, lenses).at(camera_at(0, 0, 0)), shaded);
  CHECK(shaded.at(0, 0, 0) < 0.5f);
  CHECK(shaded.at(1, 1, 0) > shaded.at(0, 0, 0));
}
