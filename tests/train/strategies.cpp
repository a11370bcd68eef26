// Training by each strategy: the same loss curve, and with sums in a fixed order the same bits twice.
#include <support/policies.hpp>
#include <support/trace_scene.hpp>

#include <gart/train/trainer.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

using namespace gart_test;

namespace {

constexpr int steps = 150;

gart::gaussian_model cloud(std::uint64_t seed, float spread) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<float> normal;
  gart::gaussian_model m;
  m.resize(150, 1);
  for (auto& x : m.mean) x = spread * normal(engine);
  for (auto& x : m.log_scale) x = -1.8f + 0.3f * normal(engine);
  for (auto& x : m.quaternion) x = normal(engine);
  for (auto& x : m.opacity) x = normal(engine);
  for (auto& x : m.sh) x = 0.5f * normal(engine);
  return m;
}

// Views of one cloud, to be learnt from another.
template <class E>
gart::dataset capture(E& exec, std::uint64_t seed) {
  gart::gaussian_model const truth = cloud(seed, 0.6f);
  gart::dataset data;
  for (int v = 0; v < 4; ++v) {
    gart::dataset_view view;
    view.name = std::to_string(v);
    view.view.width = 29, view.view.height = 22;
    view.view.fx = view.view.fy = 30, view.view.cx = 14.5f, view.view.cy = 11;
    float const angle = 0.4f * static_cast<float>(v), c = std::cos(angle), s = std::sin(angle);
    view.view.rotation = gart::mat3(gart::vec3(c, 0, -s), gart::vec3(0, 1, 0), gart::vec3(s, 0, c));
    view.view.position = gart::vec3d(-4.0 * s, 0, -4.0 * c);
    auto const picture = render_scene(exec, truth, view.view, gart::render_options{}, 1, tracer_kind::tiles);
    view.image = gart::image8(view.view.width, view.view.height, 3);
    for (std::size_t i = 0; i < picture.color.size(); ++i)
      view.image.data[i] = static_cast<gart::u8>(std::lround(255 * std::clamp(picture.color[i], 0.0f, 1.0f)));
    data.train.push_back(std::move(view));
  }
  return data;
}

struct course {
  std::vector<float> loss;
  gart::gaussian_model model;
};

template <class Strategy, class E>
course train(E& exec, gart::dataset const& data, std::uint64_t seed) {
  gart::train_options options;
  options.iterations = steps;
  options.densify = gart::densify_kind::none;
  options.sh_degree = 1;
  gart::trainer<E, gart::scene_traits<1>, gart::tile_tracer<E>, Strategy> run(exec, options, data,
                                                                              cloud(seed + 1, 0.7f));
  course out;
  for (int i = 0; i < steps; ++i) out.loss.push_back(run.step().loss);
  out.model = run.model();
  return out;
}

bool same_bits(gart::gaussian_model const& a, gart::gaussian_model const& b) {
  return a.mean == b.mean && a.log_scale == b.log_scale && a.quaternion == b.quaternion && a.opacity == b.opacity &&
         a.sh == b.sh;
}

}  // namespace

TEST_CASE_TEMPLATE("every strategy trains along the same loss curve", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  auto const data = capture(exec, seed);
  auto const reference = train<gart::primitive_strategy>(exec, data, seed);
  CHECK(reference.loss.back() < 0.8f * reference.loss.front());
  for (auto const& other : {train<gart::pixel_strategy>(exec, data, seed), train<gart::hybrid_strategy>(exec, data, seed),
                            train<gart::deterministic_strategy>(exec, data, seed)}) {
    for (int i = 0; i < steps; ++i) {
      CAPTURE(i);
      CHECK(other.loss[i] == doctest::Approx(reference.loss[i]).epsilon(i < 20 ? 1e-3 : 2e-2));
    }
  }
}

TEST_CASE_TEMPLATE("sums in a fixed order give the same bits twice", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  auto const data = capture(exec, seed);
  auto const first = train<gart::deterministic_strategy>(exec, data, seed);
  auto const second = train<gart::deterministic_strategy>(exec, data, seed);
  CHECK(first.loss == second.loss);
  CHECK(same_bits(first.model, second.model));
}
