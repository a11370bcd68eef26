// A capture through a rolling shutter is learned as well as one of still cameras; ignoring it is worse.
#include "runs.hpp"

#include <gart/camera/models.hpp>
#include <gart/render/render_image.hpp>

#include <vector>

using namespace gart_test;

namespace {

template <class E>
gart::image_float seen(E& exec, gart::gaussian_model const& model, gart::camera const& view) {
  gart::frame<E, gart::scene_traits<1>, gart::tile_tracer<E>> frame(exec);
  gart::gaussians<E> const scene(exec, model);
  frame.prepare(scene.view(), view);
  return gart::render_image(frame).color;
}

gart::camera standing(double azimuth, double height) {
  gart::camera c;
  c.width = 48, c.height = 40;
  c.fx = c.fy = 46, c.cx = 24, c.cy = 20;
  gart::vec3d const outward = glm::normalize(gart::vec3d(std::cos(azimuth), height, std::sin(azimuth)));
  gart::vec3d const right = glm::normalize(glm::cross(outward, gart::vec3d(0, 1, 0)));
  c.rotation = gart::mat3(gart::vec3(right), gart::vec3(glm::cross(-outward, right)), gart::vec3(-outward));
  c.position = 4.0 * outward;
  return c;
}

template <class E>
double trained(E& exec, std::vector<gart::camera> const& taken_by, std::vector<gart::camera> const& said,
               gart::gaussian_model const& truth, gart::gaussian_model const& start) {
  gart::dataset data;
  for (std::size_t v = 0; v < said.size(); ++v) {
    gart::dataset_view view;
    view.name = std::to_string(v), view.view = said[v];
    auto const picture = seen(exec, truth, taken_by[v]);
    view.image = gart::image8(picture.width, picture.height, 3);
    for (std::size_t i = 0; i < picture.data.size(); ++i)
      view.image.data[i] = static_cast<gart::u8>(std::lround(255 * std::clamp(picture.data[i], 0.0f, 1.0f)));
    data.train.push_back(std::move(view));
  }
  data.extent = 4;
  gart::train_options options;
  options.iterations = 200;
  options.densify = gart::densify_kind::none;
  run_of<E> run(exec, options, data, start);
  for (int i = 0; i < options.iterations; ++i) run.step();
  double squares = 0;
  std::size_t count = 0;
  auto const model = run.model();
  for (int v = 0; v < 4; ++v) {
    gart::camera const view = standing(0.8 + 1.6 * v, 0.1);
    auto const a = seen(exec, model, view), b = seen(exec, truth, view);
    for (std::size_t i = 0; i < a.data.size(); ++i) {
      double const d = double{a.data[i]} - b.data[i];
      squares += d * d, ++count;
    }
  }
  return -10 * std::log10(squares / static_cast<double>(count));
}

}  // namespace

TEST_CASE_TEMPLATE("a rolling shutter is learned; ignoring it costs a decibel", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::normal_distribution<float> normal;
  E exec;
  gart::gaussian_model const truth = cloud(seed, 0.6f);
  gart::gaussian_model start = truth;
  for (float& x : start.mean) x += 0.05f * normal(random);
  for (float& x : start.log_scale) x += 0.2f * normal(random);
  for (float& x : start.sh) x += 0.2f * normal(random);
  std::vector<gart::camera> still, rolling;
  for (int v = 0; v < 12; ++v) {
    gart::camera c = standing(0.5236 * v, v % 2 ? 0.4 : -0.3);
    still.push_back(c);
    c.shutter = v % 2 ? gart::shutter_kind::top_to_bottom : gart::shutter_kind::left_to_right;
    double const about = 2.4 * v;
    c.turn = gart::vec3(0.08 * std::cos(about), 0.08 * std::sin(about), 0.02);
    c.travel = gart::vec3(0.2 * std::sin(3 * about), 0.2 * std::cos(3 * about), 0.05);
    rolling.push_back(c);
  }
  double const plain = trained(exec, still, still, truth, start);
  double const known = trained(exec, rolling, rolling, truth, start);
  double const ignored = trained(exec, rolling, still, truth, start);
  CAPTURE(plain);
  CAPTURE(known);
  CAPTURE(ignored);
  MESSAGE("dB: still " << plain << ", rolling " << known << ", ignored " << ignored);
  CHECK(known > plain - 0.5);
  CHECK(ignored < known - 1);
}
