// Training by depth: what is asked for must be there, and the depth comes nearer to the maps than without.
#include <train/runs.hpp>

#include <gart/core/error.hpp>
#include <gart/io/image_file.hpp>

using namespace gart_test;

namespace {

// The mean difference of depth where the maps have one.
template <class Run>
double off(Run& run, gart::dataset const& data) {
  double sum = 0, count = 0;
  for (gart::dataset_view const& v : data.train) {
    auto const seen = run.render(v.view, gart::vec3(0.0f));
    for (std::size_t i = 0; i < v.depth.data.size(); ++i) {
      float const alpha = 1 - seen.transmittance.data[i];
      if (v.depth.data[i] > 0 && alpha > 0.1f)
        sum += std::abs(seen.depth.data[i] / alpha - v.depth.data[i]), count += 1;
    }
  }
  return sum / count;
}

gart::train_options options_of(float weight) {
  gart::train_options options;
  options.iterations = 60, options.densify = gart::densify_kind::none, options.depth_weight = weight;
  return options;
}

}  // namespace

TEST_CASE_TEMPLATE("depth comes nearer to the maps", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  gart::dataset const data = mapped_capture(exec, seed);
  gart::gaussian_model const start = cloud(seed + 1, 0.8f);
  auto const after = [&](float weight) {
    run_of<E, gart::with_depth<gart::primitive_method>> run(exec, options_of(weight), data, start);
    double first = 0, last = 0;
    for (int i = 0; i < 60; ++i) {
      last = run.step().loss;
      if (i == 0) first = last;
    }
    CHECK(last < first);
    return off(run, data);
  };
  double const without = after(0), with = after(2);
  CAPTURE(without);
  CHECK(with < 0.7 * without);
}

TEST_CASE_TEMPLATE("a smaller image is compared with means of its depth map", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  E exec;
  gart::dataset data = mapped_capture(exec, seed);
  for (gart::dataset_view& v : data.train)
    for (float& d : v.depth.data) d = random() % 4 ? std::round(64 * d) / 64 : 0;
  gart::dataset half = data;
  for (std::size_t i = 0; i < data.train.size(); ++i) {
    gart::image_float const& map = data.train[i].depth;
    gart::dataset_view& v = half.train[i];
    v.view = gart::downscaled(v.view, 2, v.name);
    v.image = gart::box_downscale(v.image, 2);
    v.depth = gart::image_float(14, 11, 1);
    for (int y = 0; y < 11; ++y)
      for (int x = 0; x < 14; ++x) {
        double sum = 0, count = 0;
        for (int k = 0; k < 4; ++k) {
          double const d = double{map.at(2 * x + k % 2, 2 * y + k / 2, 0)};
          sum += d, count += d > 0;
        }
        v.depth.at(x, y, 0) = count > 0 ? static_cast<float>(sum / count) : 0;
      }
  }
  gart::train_options options = options_of(2);
  options.resolution = {0, 1, 1};
  using deep = run_of<E, gart::with_depth<gart::primitive_method>>;
  deep shrunk(exec, options, data, cloud(seed + 1, 0.8f));
  options.resolution = {0, 0, 1};
  deep taken(exec, options, half, cloud(seed + 1, 0.8f));
  CHECK(shrunk.step().loss == taken.step().loss);
}

TEST_CASE_TEMPLATE("a loss of one's own may add to the gradient of depth", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  gart::dataset const data = mapped_capture(exec, seed);
  run_of<E, gart::with_depth<gart::pixel_method>> run(exec, options_of(0), data, cloud(seed + 1, 0.8f));
  run.step([&](gart::loss_input<E> const& in) {
    in.exec.zero(in.gradient.data(), in.gradient.size() * sizeof(float));
    in.exec.zero(in.value.data(), 2 * sizeof(float));
    std::vector<float> const one(in.depth.depth.size(), 1.0f);
    in.exec.copy_in(in.depth.depth_gradient.data(), one.data(), one.size() * sizeof(float));
  });
  double sum = 0;
  for (float const g : run.gradients().to_host().opacity) sum += std::abs(g);
  CHECK(sum > 0);
}

TEST_CASE_TEMPLATE("a depth weight without maps or gradients is refused", E, GART_TEST_POLICIES) {
  E exec;
  gart::dataset data = capture(exec, 1);
  gart::gaussian_model const start = cloud(2, 0.8f);
  using deep = run_of<E, gart::with_depth<gart::primitive_method>>;
  using plain = run_of<E, gart::primitive_method>;
  CHECK_THROWS_WITH_AS(deep(exec, options_of(1), data, start),
                       "train_options.depth_weight: no training view has a depth map (dataset_options.depth)",
                       gart::invalid_argument);
  CHECK_THROWS_AS(plain(exec, options_of(1), data, start), gart::invalid_argument);
  CHECK_NOTHROW(plain(exec, options_of(0), data, start));
}
