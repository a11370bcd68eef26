// Features in colours: means along the ray of what the Gaussians have, at one scale, and directions of most variance.
#include "cameras.hpp"

#include <gart/core/error.hpp>
#include <gart/runtime/renderer.hpp>
#include <gart/view/image_modes.hpp>
#include <gart/view/message.hpp>
#include <gart/view/model_view.hpp>
#include <gart/view/shown_features.hpp>

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <random>

namespace {

gart::gaussian_model cloud(int features) {
  std::mt19937_64 engine(5);
  std::normal_distribution<float> normal;
  gart::gaussian_model m;
  m.feature_count = features;
  m.resize(300, 0);
  for (auto& x : m.mean) x = 0.5f * normal(engine);
  for (auto& x : m.log_scale) x = -1.6f + 0.2f * normal(engine);
  for (auto& x : m.quaternion) x = normal(engine);
  for (auto& x : m.opacity) x = 1 + normal(engine);
  for (auto& x : m.sh) x = normal(engine);
  for (auto& x : m.features) x = 3 + 2 * normal(engine);
  return m;
}

gart::feature_view<float const> features_of(gart::gaussian_model const& m) {
  return {m.features.data(), static_cast<gart::index_t>(m.size()), m.feature_count};
}

std::unique_ptr<gart::renderer> serial() {
  gart::configuration_request r;
  r.backend = gart::backend_kind::serial, r.sh_degree = 0;
  return gart::make_renderer(r);
}

std::string refusal(auto const& act) {
  try {
    act();
  } catch (gart::invalid_argument const& e) {
    return e.what();
  }
  return "accepted";
}

}  // namespace

TEST_CASE("principal directions are those of the features") {
  constexpr std::size_t n = 4000, width = 40;
  std::mt19937_64 engine(11);
  std::normal_distribution<double> normal;
  // Three directions at right angles: rows of a cosine transform.
  double axis[3][width];
  for (std::size_t d = 0; d < 3; ++d)
    for (std::size_t k = 0; k < width; ++k)
      axis[d][k] = std::sqrt(2.0 / width) *
                   std::cos(3.14159265358979 * (static_cast<double>(k) + 0.5) * static_cast<double>(2 * d + 1) / width);
  std::vector<float> values(n * width);
  for (std::size_t i = 0; i < n; ++i) {
    double const along[3] = {5 * normal(engine), 3 * normal(engine), 2 * normal(engine)};
    for (std::size_t k = 0; k < width; ++k) {
      double v = 7 + 0.2 * normal(engine);
      for (std::size_t d = 0; d < 3; ++d) v += along[d] * axis[d][k];
      values[i * width + k] = static_cast<float>(v);
    }
  }
  auto const found = gart::principal_directions({values.data(), n, width});
  for (std::size_t d = 0; d < 3; ++d) {
    double dot = 0, length = 0;
    for (std::size_t k = 0; k < width; ++k)
      dot += found[d * width + k] * axis[d][k], length += found[d * width + k] * found[d * width + k];
    CHECK(std::abs(dot) > 0.999);
    CHECK(length == doctest::Approx(1));
  }
}

TEST_CASE("features go from 0 to 1 over the bulk of the Gaussians") {
  std::vector<float> values;
  for (int i = 0; i <= 100; ++i) values.insert(values.end(), {static_cast<float>(i), 4.0f});
  values[0] = -1e6f, values[200] = 1e6f;  // strays
  gart::feature_view<float const> const f{values.data(), 101, 2};
  auto const one = gart::features_to_show(f, {0});
  CHECK(one.count == 1);
  CHECK(one.ranges.front() == std::pair{1.0f, 99.0f});
  CHECK(one.values[50] == doctest::Approx(0.5));
  CHECK(one.values[99] == doctest::Approx(1));
  auto const three = gart::features_to_show(f, {0, 1, 0});
  CHECK(three.count == 3);
  CHECK(three.values[3 * 50 + 1] == 0.5f);  // all are the same
  auto const directions = gart::features_to_show(f, {});
  CHECK(directions.count == 3);
  CHECK(directions.values[3 * 75] - directions.values[3 * 25] == doctest::Approx(50.0 / 98).epsilon(1e-4));
  CHECK(refusal([&] { gart::features_to_show(f, {2}); }).find("there is no feature 2") != std::string::npos);
  CHECK(refusal([&] { gart::features_to_show(f, {0, 1}); }).find("one feature, three") != std::string::npos);
  CHECK(refusal([&] { gart::features_to_show({}, {0}); }).find("no features") != std::string::npos);
}

TEST_CASE("a pixel has the mean feature, and colours stay") {
  gart::gaussian_model const m = cloud(5);
  gart::camera const view = gart_test::camera_at({0, 0, -3}, 0, 32, 70);
  auto const by = serial(), alone = serial();
  gart::view_render const render = gart::render_of(*by, m, {});
  alone->set_model(m);
  gart::rendered const raw = alone->render(view, {}, true);
  gart::view_settings settings;
  CHECK(render.images(view, settings).color.data == raw.color.data);
  auto const check = [&](std::vector<int> const& places) {
    settings.features = places;
    auto const all = gart::features_to_show(features_of(m), places);
    gart::rendered const r = render.images(view, settings);
    CHECK(r.color.data == raw.color.data);
    REQUIRE(r.features.channels == all.count);
    CHECK(render.feature_range(settings) == all.ranges.front());
    for (std::size_t p = 0; p < r.transmittance.data.size(); ++p) {
      float const seen = 1 - r.transmittance.data[p];
      if (seen < 0.5f) continue;
      for (std::size_t c = 0; c < places.size(); ++c) {
        auto const [low, high] = all.ranges[c];
        float const mean = raw.features.data[5 * p + static_cast<std::size_t>(places[c])] / seen;
        CHECK(r.features.data[places.size() * p + c] / seen ==
              doctest::Approx((mean - low) / (high - low)).epsilon(1e-3));
      }
    }
    // In parts they are the same bits.
    settings.rows = {32, 64};
    gart::rendered const part = render.images(view, settings);
    for (int x = 0; x < 32; ++x) CHECK(part.features.at(x, 40, 0) == r.features.at(x, 40, 0));
    settings.rows = {};
    return r;
  };
  gart::rendered const one = check({4});
  gart::image8 const colours = gart::shown(one, view, gart::view_mode::features).image;
  CHECK(gart::shown(check({0, 4, 2}), view, gart::view_mode::features).image.data != colours.data);
  settings.features = std::vector<int>();
  CHECK(render.images(view, settings).features.channels == 3);
  // Where a crop box leaves nothing, nothing is shown; without the mode, no features are traced.
  settings.crop = gart::view_box{{8, 8, 8}, {9, 9, 9}};
  auto const none = gart::shown(render.images(view, settings), view, gart::view_mode::features).image;
  CHECK(std::all_of(none.data.begin(), none.data.end(), [](gart::u8 v) { return v == 0; }));
  settings = {};
  CHECK(render.images(view, settings).features.data.empty());
  CHECK_THROWS_AS(gart::shown(raw, view, gart::view_mode::features), gart::invalid_argument);
  CHECK_FALSE(gart::render_of(*by, cloud(0), {}).feature_range);
}

TEST_CASE("the colours of one feature end where its range does") {
  gart::rendered r;
  r.transmittance = gart::image_float(3, 1, 1);
  r.transmittance.data = {0, 0.5f, 0.75f};
  r.features = gart::image_float(3, 1, 1);
  r.features.data = {0, 0.5f, 0.25f};
  auto const c = gart::features_in_colors(r).data;
  CHECK(c[0] == 250);  // pale yellow, as depth's nearest
  CHECK(c[2] == 140);
  CHECK(c[3] == 26);                             // dark blue
  CHECK((c[6] == 0 && c[7] == 0 && c[8] == 0));  // too little is seen
}

TEST_CASE("features are asked for by their places, in their mode alone") {
  gart::camera const c = gart_test::camera_at({0, 0, 0});
  auto const read = [&](std::string const& mode, std::string const& features) {
    return std::get<gart::view_message>(gart::parse_message(R"({"type":"view","id":1,"moving":false,"mode":")" + mode +
                                                            R"(","camera":)" + gart_test::json_of(c) + features + "}"));
  };
  CHECK(*read("features", R"(,"features":[7])").settings.features == std::vector<int>{7});
  CHECK(*read("features", R"(,"features":[7,0,2])").settings.features == std::vector<int>{7, 0, 2});
  CHECK(read("features", R"(,"features":null)").settings.features->empty());
  CHECK(read("features", "").settings.features->empty());
  CHECK_FALSE(read("colour", R"(,"features":[7])").settings.features);
  for (char const* wrong : {"[]", "[1,2]", "[1.5]", "[-1]", "[512]", "7", R"(["1"])"})
    CHECK(refusal([&] { read("features", std::string(R"(,"features":)") + wrong); }).find("'features'") !=
          std::string::npos);
}

TEST_CASE("the mode is offered where the model has features") {
  gart::gaussian_model const m = cloud(4);
  gart::view_scene scene = gart::scene_of("m", m, 2);
  auto const modes = [&] { return nlohmann::json::parse(gart::hello_text(scene, false))["modes"].dump(); };
  CHECK(modes().find("features") == std::string::npos);
  scene.features = 4;
  CHECK(modes().find("features") != std::string::npos);
}
