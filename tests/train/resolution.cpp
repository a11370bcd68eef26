// Images smaller than the photographs early in a run: a step is one of a capture of that size, with its masks,
// falloffs, exposures, poses and lenses, and sizes follow each other as the options say.
#include "runs.hpp"

#include <gart/core/error.hpp>

#include <cmath>
#include <tuple>

using namespace gart_test;

namespace {

template <class E>
using run = run_of<E, gart::deterministic_method>;

std::size_t at(int width, int x, int y) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
}
gart::u8 rounded(double x) { return static_cast<gart::u8>(std::floor(x + 0.5)); }

// The view as its camera had taken it with pixels so many times as wide: means of what the mask keeps, in double.
gart::dataset_view smaller(gart::dataset_view const& v, int by) {
  gart::dataset_view out = v;
  int const width = v.view.width / by, height = v.view.height / by, channels = v.image.channels;
  out.view.fx /= static_cast<float>(by), out.view.fy /= static_cast<float>(by);
  out.view.cx /= static_cast<float>(by), out.view.cy /= static_cast<float>(by);
  out.view.width = width, out.view.height = height;
  out.image = gart::image8(width, height, channels);
  if (!v.mask.empty()) out.mask = gart::image8(width, height, 1);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      double color[3] = {}, alpha = 0, kept = 0;
      for (int k = 0; k < by * by; ++k) {
        std::size_t const from = at(v.view.width, x * by + k % by, y * by + k / by);
        gart::u8 const* const pixel = &v.image.data[from * static_cast<std::size_t>(channels)];
        double const weight = v.mask.empty() ? 255.0 : v.mask.data[from];
        double const opaque = channels == 4 ? weight * pixel[3] : weight;
        kept += weight, alpha += opaque;
        for (int c = 0; c < 3; ++c) color[c] += opaque * pixel[c];
      }
      for (int c = 0; c < 3; ++c) out.image.at(x, y, c) = alpha > 0 ? rounded(color[c] / alpha) : gart::u8{0};
      if (channels == 4) out.image.at(x, y, 3) = kept > 0 ? rounded(alpha / kept) : gart::u8{0};
      if (!v.mask.empty())
        out.mask.at(x, y, 0) = kept > 0 ? std::max<gart::u8>(1, rounded(kept / (by * by))) : gart::u8{0};
    }
  return out;
}

// Images a quarter and a half as wide until these shares of the run, however small.
gart::resolution_options sizes(float quarter_until, float half_until) { return {quarter_until, half_until, 1}; }

}  // namespace

TEST_CASE_TEMPLATE("a step by smaller images is a smaller capture's, bit by bit", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  E exec;
  bool with_alpha = false;
  SUBCASE("masks and all that is learned") {}
  SUBCASE("alpha") { with_alpha = true; }
  gart::dataset data = capture(exec, seed);
  auto const byte = [&] { return static_cast<gart::u8>(random() % 3 ? random() % 256 : random() % 2 * 255); };
  for (gart::dataset_view& v : data.train) {
    if (&v != &data.train[1]) {  // one has none
      v.mask = gart::image8(v.view.width, v.view.height, 1);
      for (gart::u8& x : v.mask.data) x = byte();
    }
    if (!with_alpha) continue;
    gart::image8 image(v.view.width, v.view.height, 4);
    for (std::size_t i = 0; i < image.data.size(); ++i)
      image.data[i] = i % 4 == 3 ? byte() : v.image.data[i / 4 * 3 + i % 4];
    v.image = std::move(image);
  }
  gart::train_options options;
  options.iterations = 40, options.densify = gart::densify_kind::none, options.sh_every = 4;
  options.background = gart::background_kind::random;
  if (!with_alpha) {
    options.exposure = options.vignetting = options.refine_poses = options.refine_lens = true;
    options.poses.warm_up = options.lens.warm_up = 0;
  }
  auto const start = cloud(seed + 1, 0.7f);
  for (int const by : {2, 4}) {
    CAPTURE(by);
    gart::dataset small = data;
    for (gart::dataset_view& v : small.train) v = smaller(v, by);
    options.resolution = sizes(by == 4 ? 1 : 0, 1);
    run<E> shrunk(exec, options, data, start);
    options.resolution = sizes(0, 0);
    run<E> taken(exec, options, small, start);
    for (int i = 0; i < 14; ++i) REQUIRE(shrunk.step().loss == taken.step().loss);
    CHECK(same(shrunk.model(), taken.model()));
    gart::training_state const a = shrunk.state(), b = taken.state();
    CHECK(floats(a, "exposure") == floats(b, "exposure"));
    CHECK(floats(a, "vignetting") == floats(b, "vignetting"));
    CHECK(doubles(a, "pose") == doubles(b, "pose"));
    CHECK(doubles(a, "lens") == doubles(b, "lens"));
    CHECK(doubles(a, "lens").empty() == with_alpha);
  }
}

TEST_CASE_TEMPLATE("sizes follow each other and survive a stop", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  auto const data = capture(exec, seed);
  auto const start = cloud(seed + 1, 0.7f);
  gart::train_options options;
  options.iterations = 80, options.max_gaussians = 230, options.error.from = 10, options.error.every = 10;
  options.resolution = sizes(0.25f, 0.5f);
  run<E> whole(exec, options, data, start), early(exec, options, data, start), late(exec, options, data, start);
  for (int i = 1; i <= options.iterations; ++i) {
    whole.step();
    if (i == 15) early.set_state(whole.state());
    if (i == 33) late.set_state(whole.state());
  }
  for (run<E>* const resumed : {&early, &late})
    while (resumed->steps_done() < options.iterations) resumed->step();
  CHECK(whole.scene().size() > start.size());
  CHECK(same(early.model(), whole.model()));
  CHECK(same(late.model(), whole.model()));

  options.densify = gart::densify_kind::none;
  run<E> told(exec, options, data, start);
  std::vector<int> widths;
  for (int i = 0; i < options.iterations; ++i)
    told.step([&](gart::loss_input<E> const& in) {
      widths.push_back(in.width);
      CHECK(in.height == (in.width == 29 ? 22 : in.width == 14 ? 11 : 5));
      CHECK(in.image.size() == 3 * static_cast<std::size_t>(in.width * in.height));
      in.exec.zero(in.gradient.data(), in.gradient.size() * sizeof(float));
      in.exec.zero(in.value.data(), 2 * sizeof(float));
    });
  for (int i = 0; i < options.iterations; ++i)
    CHECK(widths[static_cast<std::size_t>(i)] == (i < 20 ? 7 : i < 40 ? 14 : 29));
}

TEST_CASE("a long run has its smaller images in the first of its steps") {
  gart::resolution_options const options{0.125f, 0.5f, 1, 1000};
  for (int const iterations : {1000, 1001, 30000}) {
    CHECK(gart::shrink_at(options, 124, iterations) == 4);
    CHECK(gart::shrink_at(options, 125, iterations) == 2);
    CHECK(gart::shrink_at(options, 499, iterations) == 2);
    CHECK(gart::shrink_at(options, 500, iterations) == 1);
    CHECK(gart::steps_shrunk(options, 4, iterations) == 125);
    CHECK(gart::steps_shrunk(options, 2, iterations) == 500);
  }
  CHECK(gart::shrink_at(options, 99, 800) == 4);
  CHECK(gart::shrink_at(options, 100, 800) == 2);
  CHECK(gart::shrink_at(options, 400, 800) == 1);
}

TEST_CASE("no image is smaller than its camera or options allow") {
  gart::camera c;
  c.width = 800, c.height = 600, c.fx = c.fy = 700;
  gart::resolution_options options;
  options.least = 150;
  CHECK(gart::shrink_of(c, 4, options) == 4);
  options.least = 151;
  CHECK(gart::shrink_of(c, 4, options) == 2);
  CHECK(gart::shrink_of(c, 1, options) == 1);
  options.least = 301;
  CHECK(gart::shrink_of(c, 4, options) == 1);
  options.least = 1, c.kind = gart::camera_kind::equirectangular;
  for (auto const& [width, height, by] : {std::tuple{800, 600, 4}, {800, 602, 2}, {802, 600, 2}, {800, 601, 1}}) {
    c.width = width, c.height = height;
    CHECK(gart::shrink_of(c, 4, options) == by);
  }
}

TEST_CASE_TEMPLATE("sizes that are none are refused", E, GART_TEST_POLICIES) {
  E exec;
  auto const data = capture(exec, 1);
  gart::train_options options;
  auto const refused = [&](gart::resolution_options const& resolution, char const* why) {
    options.resolution = resolution;
    CHECK_THROWS_WITH_AS(run<E>(exec, options, data, cloud(2, 0.7f)), why, gart::invalid_argument);
  };
  refused(sizes(-0.5f, 1), "train_options.resolution.quarter_until is -0.5: from 0 to 1");
  refused(sizes(0.25f, 1.5f), "train_options.resolution.half_until is 1.5: from 0 to 1");
  refused(sizes(0, std::nanf("")), "train_options.resolution.half_until is nan: from 0 to 1");
  refused({0, 0, 0}, "train_options.resolution.least is 0: from 1 to 1000000");
  refused({0, 0, 1, 0}, "train_options.resolution.long_run is 0: from 1 to 1e+09");
}
