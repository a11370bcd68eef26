// What is chosen for a capture, from captures made by hand.
#include <support/policies.hpp>

#include <gart/camera/models.hpp>
#include <gart/runtime/capture_defaults.hpp>
#include <gart/runtime/initial.hpp>

#include <algorithm>

namespace {

constexpr int width = 40, height = 30;

// Views of one colour, with a coloured square in the middle.
gart::dataset capture(int channels, int border, int views = 3) {
  gart::dataset data;
  for (int v = 0; v < views; ++v) {
    gart::dataset_view view;
    view.name = std::to_string(v);
    view.view.width = width, view.view.height = height;
    view.view.fx = view.view.fy = 40, view.view.cx = 20, view.view.cy = 15;
    view.image = gart::image8(width, height, channels, static_cast<gart::u8>(border));
    for (int y = 10; y < 20; ++y)
      for (int x = 10; x < 30; ++x)
        for (int c = 0; c < 3; ++c) view.image.at(x, y, c) = static_cast<gart::u8>(60 + 40 * c);
    if (channels == 4) {
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) view.image.at(x, y, 3) = y >= 10 && y < 20 && x >= 10 && x < 30 ? 255 : 0;
    }
    data.train.push_back(view);
  }
  return data;
}

gart::background_kind background_of(gart::dataset const& data) {
  return gart::choose_background(gart::inspect(data)).value;
}

using gart::background_kind;

}  // namespace

TEST_CASE("the background is what the images' alpha and borders say") {
  auto const clear = capture(4, 0);
  auto const seen = gart::inspect(clear);
  CHECK(seen.clear_border);
  CHECK(seen.bounded());
  CHECK(seen.transparent == doctest::Approx(1 - 200.0 / (width * height)));
  CHECK(background_of(clear) == background_kind::white);

  CHECK(background_of(capture(3, 255)) == background_kind::white);
  CHECK(gart::inspect(capture(3, 255)).bounded());
  CHECK(background_of(capture(3, 3)) == background_kind::black);
  CHECK(background_of(capture(3, 128)) == background_kind::black);
  CHECK(gart::inspect(capture(3, 128)).plain_border);
  CHECK(gart::inspect(capture(3, 128)).border[1] == 128);

  // Alpha that is opaque everywhere says nothing: the border does.
  auto opaque = capture(4, 250);
  for (auto& v : opaque.train)
    for (std::size_t i = 3; i < v.image.data.size(); i += 4) v.image.data[i] = 255;
  CHECK(gart::inspect(opaque).transparent == 0);
  CHECK(background_of(opaque) == background_kind::white);
}

TEST_CASE("a scene that fills the images is unbounded") {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937 random(static_cast<unsigned>(seed));
  auto data = capture(3, 255);
  // A quarter of one view's border is something else.
  auto& image = data.train[1].image;
  for (int x = 0; x < width; ++x)
    for (int c = 0; c < 3; ++c) image.at(x, 0, c) = static_cast<gart::u8>(random() % 200);
  CHECK_FALSE(gart::inspect(data).bounded());
  CHECK(background_of(data) == background_kind::black);
  // Noise of a few levels leaves a plain border plain.
  auto noisy = capture(3, 245);
  for (auto& v : noisy.train)
    for (auto& p : v.image.data)
      p = static_cast<gart::u8>(std::clamp<int>(p + static_cast<int>(random() % 9) - 4, 0, 255));
  CHECK(gart::inspect(noisy).bounded());
  CHECK(background_of(noisy) == background_kind::white);
}

TEST_CASE("masks are counted; a capture without images says nothing") {
  auto data = capture(3, 90);
  data.train[2].mask = gart::image8(width, height, 1, 255);
  CHECK(gart::inspect(data).masked == 1);
  gart::dataset const none;
  CHECK_FALSE(gart::inspect(none).bounded());
}

TEST_CASE("a lens that is one to one is traced by tiles") {
  auto data = capture(3, 90);
  CHECK(gart::choose_tracer(gart::inspect(data)).value == gart::tracer_kind::automatic);
  data.train[0].view.lens.k1 = -0.1f, data.train[0].view.lens.p1 = 0.01f;
  auto const mild = gart::inspect(data);
  CHECK(mild.distorted == 1);
  CHECK(mild.folding == 0);
  CHECK(gart::choose_tracer(mild).value == gart::tracer_kind::automatic);
  // r (1 + k1 r^2) has its maximum at r = 1 / sqrt(-3 k1): for k1 = -1.5 at r = 0.47, where the image is 0.31 away, and
  // the corners of the image are 0.62 away.
  data.train[1].view.lens.k1 = -1.5f;
  auto const strong = gart::inspect(data);
  CHECK(strong.folding == 1);
  CHECK(gart::choose_tracer(strong).value == gart::tracer_kind::bvh);
  CHECK(gart::choose_backward(strong).value == "pixel");
}

TEST_CASE("training starts from the capture's points or random ones") {
  auto data = capture(3, 90);
  gart::train_options options;
  options.random_points = 500;
  auto start = gart::choose_start(data, options).value;
  CHECK(start.random);
  CHECK(start.count == 500);
  CHECK(start.opacity == 0.5f);
  CHECK(start.scale == 0.1f);
  options.densify = gart::densify_kind::adc;
  options.initial_scale = 0.7f;
  start = gart::choose_start(data, options).value;
  CHECK(start.opacity == 0.1f);
  CHECK(start.scale == 0.7f);
  data.points.position.assign(30, 0.0f), data.points.color.assign(30, 0);
  options.max_gaussians = 4;
  start = gart::choose_start(data, options).value;
  CHECK_FALSE(start.random);
  CHECK(start.count == 4);
}

TEST_CASE("training starts from matched points where asked to, and where a capture has none") {
  auto data = capture(3, 90);
  gart::train_options options;
  options.random_points = 500;
  CHECK_FALSE(gart::choose_match(gart::inspect(data)).value);
  data.matched.position.assign(3 * 999, 1.0f), data.matched.color.assign(3 * 999, 7);
  CHECK_FALSE(gart::choose_match(gart::inspect(data)).value);
  CHECK(gart::choose_match(gart::inspect(data)).why == "too few were found: 999");
  CHECK(gart::choose_start(data, options).value.random);
  data.matched.position.resize(3 * 1000, 1.0f), data.matched.color.resize(3 * 1000, 7);
  CHECK(gart::choose_match(gart::inspect(data)).value);
  options.match = true;
  auto start = gart::choose_start(data, options).value;
  CHECK(start.matched);
  CHECK_FALSE(start.random);
  CHECK(start.count == 1000);
  CHECK(start.opacity == 0.1f);
  CHECK(gart::initial_model(data, options, 0).mean == data.matched.position);
  // Beside a capture's own points trials tell.
  data.points.position.assign(30, 2.0f), data.points.color.assign(30, 0);
  auto const traits = gart::inspect(data);
  CHECK_FALSE(gart::choose_match(traits).value);
  auto const offered = [&] {
    auto const all = gart::default_candidates(traits, options);
    return std::any_of(all.begin(), all.end(), [](gart::candidate const& c) { return c.setting == "match"; });
  };
  CHECK_FALSE(offered());
  CHECK(gart::initial_model(data, options, 0).size() == 1010);
  options.match = false;
  CHECK(offered());
  CHECK(gart::initial_model(data, options, 0).size() == 10);
  // A trial has as many of them a pixel as the run.
  CHECK(gart::shrunk(data, 3).matched.size() == 112);
  CHECK(gart::shrunk(data, 3).points.size() == 10);
}

TEST_CASE("training on depth starts from what the maps measured") {
  // A pinhole at the origin and one beside it look at the plane z = 3, of which the left half is measured.
  gart::dataset data;
  for (int v = 0; v < 2; ++v) {
    gart::dataset_view view;
    view.view.width = view.view.height = 20, view.view.fx = view.view.fy = 20, view.view.cx = view.view.cy = 10;
    view.view.position = {0.25 * v, 0, 0};
    view.image = gart::image8(20, 20, 3, static_cast<gart::u8>(50 + 100 * v));
    view.depth = gart::image_float(20, 20, 1);
    for (int y = 0; y < 20; ++y)
      for (int x = 0; x < 10; ++x)
        view.depth.at(x, y, 0) =
            3 / gart::ray_direction(view.view, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f).z;
    data.train.push_back(view);
  }
  gart::train_options options;
  options.random_points = 300;
  CHECK(gart::choose_start(data, options).value.random);
  options.depth_weight = 1;
  auto const start = gart::choose_start(data, options).value;
  CHECK(start.measured);
  CHECK_FALSE(start.random);
  CHECK(start.count == 300);
  CHECK(start.opacity == 0.1f);
  CHECK(start.scale == 1.0f);
  auto const points = gart::points_of_maps(data, 300, 5);
  CHECK(points.size() == 300);
  CHECK(points.position == gart::points_of_maps(data, 300, 5).position);
  CHECK(points.position != gart::points_of_maps(data, 300, 6).position);
  std::size_t second = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    bool const of_second = points.color[3 * i] == 150;
    second += of_second;
    CHECK(points.position[3 * i + 2] == doctest::Approx(3));
    CHECK(points.position[3 * i] < (of_second ? 0.25f : 0.0f));
  }
  CHECK(second > 100);
  CHECK(second < 200);
  CHECK(gart::initial_model(data, options, 1).size() == 300);
  // A view that is held out, a mask and what is clear have no part.
  for (auto const c : gart::points_of_maps(data, 50, 5, {1}).color) CHECK(c == 50);
  data.train[0].mask = gart::image8(20, 20, 1, 0);
  data.train[1].image = gart::image8(20, 20, 4, 0);
  CHECK(gart::points_of_maps(data, 50, 5).size() == 0);
  CHECK_THROWS_WITH_AS(gart::initial_model(data, options, 1), doctest::Contains("no depth map has a distance"),
                       gart::invalid_argument);
  data.points.position.assign(30, 0.0f), data.points.color.assign(30, 0);
  CHECK_FALSE(gart::choose_start(data, options).value.measured);
}
