// Gradients of an arbitrary lidar sweep, to the Gaussians and to the rays, in each form: against central differences of
// a tracer in double.
#include <rays/double_rays.hpp>
#include <rays/view_rays.hpp>

#include <cmath>

using namespace gart_test;
using gart::gradient_form;
using gart::index_t;

namespace {

// A sensor that moves and turns while it looks about, its rays in no order that an image has.
struct sweep {
  std::vector<float> origins, directions, ends, by_color, by_depth, by_transmittance;
  std::size_t count() const { return ends.size(); }

  sweep(std::uint64_t seed, std::size_t n) {
    std::mt19937_64 engine(seed);
    std::normal_distribution<float> normal;
    std::uniform_real_distribution<float> uniform(-1, 1);
    for (std::size_t i = 0; i < n; ++i) {
      float const way = static_cast<float>(i) / static_cast<float>(n), azimuth = 17 * way + 0.3f * uniform(engine);
      float const height = 0.6f * uniform(engine), length = i % 3 ? 1.0f : 2.5f;
      for (float const x : {-2.5f + way, 0.4f * way, 0.2f * uniform(engine)}) origins.push_back(x);
      for (float const x :
           {std::cos(height) * std::cos(azimuth), std::cos(height) * std::sin(azimuth), std::sin(height)})
        directions.push_back(length * x);
      ends.push_back(i % 4 ? 50.0f : 2.2f);
      for (int c = 0; c < 3; ++c) by_color.push_back(normal(engine));
      by_depth.push_back(normal(engine)), by_transmittance.push_back(normal(engine));
    }
  }
  double_ray ray(std::size_t i) const {
    double_ray r{{}, {}, double{ends[i]}};
    for (std::size_t k = 0; k < 3; ++k)
      r.origin[k] = double{origins[3 * i + k]}, r.direction[k] = double{directions[3 * i + k]};
    return r;
  }
  ray_weights weights(std::size_t i) const {
    return {{double{by_color[3 * i]}, double{by_color[3 * i + 1]}, double{by_color[3 * i + 2]}},
            double{by_depth[i]},
            double{by_transmittance[i]}};
  }
};

struct results {
  gart::gaussian_model gaussians;
  std::vector<float> origins, directions;
};

template <class E>
struct traced_sweep {
  E& exec;
  batch_memory<E> rays;
  gart::buffer<float, E> by_color, by_depth, by_transmittance;
  traced_sweep(E& e, sweep const& s)
      : exec(e),
        rays(e, {}, s.origins, s.directions, s.ends),
        by_color(e, s.by_color),
        by_depth(e, s.by_depth),
        by_transmittance(e, s.by_transmittance) {}
  gart::output_gradients by() const { return {by_color, by_depth, by_transmittance}; }

  results differentiate(gart::ray_tracer<E>& tracer, gart::batch_context<E>& context, index_t count, int degree) {
    gart::gaussians<E> out(exec, count, degree);
    gart::buffer<float, E> origins(exec, 3 * rays.rays().count()), directions(exec, 3 * rays.rays().count());
    tracer.backward(context, by(), out.view(), {origins.data(), directions.data()});
    return {out.to_host(), origins.to_host(), directions.to_host()};
  }
};

// The relative error of a group of gradients, over the numbers whose differences cross no step.
class comparison {
 public:
  void add(double got, double expected) { error_ += (got - expected) * (got - expected), norm_ += expected * expected; }
  double relative() const { return std::isfinite(error_) && norm_ > 0 ? std::sqrt(error_ / norm_) : HUGE_VAL; }

 private:
  double error_ = 0, norm_ = 0;
};

constexpr double h = 1e-5;

// d loss / d x by four values, where none is on another branch; of all rays or one. False: a step was crossed.
template <class F>
bool slope(double& x, F const& loss, double& out) {
  double const at = x;
  std::uint64_t const branches = loss().branches;
  bool smooth = true;
  auto const value = [&](double by) {
    x = at + by;
    seen const s = loss();
    smooth = smooth && s.branches == branches;
    return s.loss;
  };
  out = (8 * (value(h) - value(-h)) - (value(2 * h) - value(-2 * h))) / (12 * h);
  x = at;
  return smooth;
}

void compare(gart::gaussian_model const& model, sweep const& s, gart::render_options const& options,
             results const& got) {
  double_model m(model);
  auto const loss = [&] {
    seen all;
    for (std::size_t i = 0; i < s.count(); ++i) {
      seen const one = see(m, s.ray(i), s.weights(i), options);
      all.loss += one.loss, all.branches = (all.branches ^ one.branches) * 0xff51afd7ed558ccdu;
    }
    return all;
  };
  std::size_t used = 0, tried = 0;
  auto const check = [&](std::vector<double>& values, std::vector<float> const& by, char const* what) {
    CAPTURE(what);
    comparison c;
    std::size_t const step = values.size() > 60 ? values.size() / 60 : 1;
    for (std::size_t i = 0; i < values.size(); i += step) {
      double expected = 0;
      ++tried;
      if (!slope(values[i], loss, expected)) continue;
      ++used;
      c.add(double{by[i]}, expected);
    }
    CHECK(c.relative() < 1e-4);
  };
  check(m.mean, got.gaussians.mean, "mean");
  check(m.log_scale, got.gaussians.log_scale, "log-scale");
  check(m.quaternion, got.gaussians.quaternion, "quaternion");
  check(m.opacity, got.gaussians.opacity, "opacity");
  check(m.sh, got.gaussians.sh, "SH");
  CHECK(used > tried * 3 / 4);

  comparison origin, direction;
  for (std::size_t i = 0; i < s.count(); ++i) {
    double_ray r = s.ray(i);
    auto const of_ray = [&] { return see(m, r, s.weights(i), options); };
    for (std::size_t k = 0; k < 3; ++k) {
      double expected = 0;
      if (slope(r.origin[k], of_ray, expected)) origin.add(double{got.origins[3 * i + k]}, expected);
      if (slope(r.direction[k], of_ray, expected)) direction.add(double{got.directions[3 * i + k]}, expected);
    }
  }
  CHECK(origin.relative() < 1e-4);
  CHECK(direction.relative() < 1e-4);
}

double difference(std::vector<float> const& a, std::vector<float> const& b) {
  comparison c;
  for (std::size_t i = 0; i < a.size(); ++i) c.add(double{a[i]}, double{b[i]});
  return c.relative();
}

bool same_bits(gart::gaussian_model const& a, gart::gaussian_model const& b) {
  return a.mean == b.mean && a.log_scale == b.log_scale && a.quaternion == b.quaternion && a.opacity == b.opacity &&
         a.sh == b.sh;
}

gart::render_options sweep_options() {
  gart::render_options options;
  options.background = gart::vec3(0.3f, 0.1f, 0.6f);
  return options;
}

}  // namespace

TEST_CASE_TEMPLATE("gradients of a lidar sweep are its differences", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  for (int const degree : {3, 1}) {
    CAPTURE(degree);
    gart::gaussian_model const model = cloud(seed, degree, 40);
    sweep const s(seed + 1, 60);
    gart::gaussians<E> const scene(exec, model);
    traced_sweep<E> traced(exec, s);
    gart::ray_tracer<E> tracer(exec);
    tracer.set_scene(scene.view(), degree);
    for (gradient_form const form : {gradient_form::scatter, gradient_form::primitive}) {
      CAPTURE(static_cast<int>(form));
      auto context = tracer.forward(traced.rays.rays(), sweep_options(), {}, form);
      compare(model, s, sweep_options(), traced.differentiate(tracer, context, scene.size(), degree));
    }
  }
}

TEST_CASE_TEMPLATE("both forms sum the same, one of them the same bits", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  // Gaussians with more hits than a piece has, and some with none.
  gart::gaussian_model model = cloud(seed, 2, 700);
  for (std::size_t i = 0; i < 20; ++i) model.mean[3 * i] += 1000;
  sweep const s(seed + 1, 2000);
  gart::gaussians<E> const scene(exec, model);
  traced_sweep<E> traced(exec, s);
  gart::ray_tracer<E> tracer(exec);
  tracer.set_scene(scene.view(), 2);
  auto scattered = tracer.forward(traced.rays.rays(), sweep_options(), {}, gradient_form::scatter);
  // The first has no room for its hits and is traced twice, the second has.
  auto first = tracer.forward(traced.rays.rays(), sweep_options(), {}, gradient_form::primitive);
  auto second = tracer.forward(traced.rays.rays(), sweep_options(), {}, gradient_form::primitive);
  auto const by_scatter = traced.differentiate(tracer, scattered, scene.size(), 2);
  auto const by_primitive = traced.differentiate(tracer, first, scene.size(), 2);
  CHECK(difference(by_primitive.gaussians.mean, by_scatter.gaussians.mean) < 1e-4);
  CHECK(difference(by_primitive.gaussians.log_scale, by_scatter.gaussians.log_scale) < 1e-4);
  CHECK(difference(by_primitive.gaussians.quaternion, by_scatter.gaussians.quaternion) < 1e-4);
  CHECK(difference(by_primitive.gaussians.opacity, by_scatter.gaussians.opacity) < 1e-4);
  CHECK(difference(by_primitive.gaussians.sh, by_scatter.gaussians.sh) < 1e-4);
  CHECK(by_primitive.directions == by_scatter.directions);
  for (auto* const again : {&second, &first})
    CHECK(same_bits(traced.differentiate(tracer, *again, scene.size(), 2).gaussians, by_primitive.gaussians));
}

TEST_CASE_TEMPLATE("what a batch shows does not depend on its gradients", E, GART_TEST_POLICIES) {
  E exec;
  gart::gaussians<E> const scene(exec, cloud(5, 1, 300));
  random_rays const some(6, 500, 1.0f);
  batch_memory<E> const batch(exec, {}, some.origins, some.directions);
  gart::ray_tracer<E> tracer(exec);
  tracer.set_scene(scene.view(), 1);
  auto const expected = trace_all(exec, tracer, batch.rays(), {});
  for (gradient_form const form : {gradient_form::scatter, gradient_form::primitive}) {
    target_memory<E> out(exec, 500);
    tracer.forward(batch.rays(), {}, out.targets(), form);
    CHECK(same(out.to_host(), expected));
  }
}

TEST_CASE_TEMPLATE("a context of Gaussians that have changed is refused", E, GART_TEST_POLICIES) {
  E exec;
  gart::gaussian_model model = cloud(5, 1, 100);
  gart::gaussians<E> scene(exec, model);
  sweep const s(6, 50);
  traced_sweep<E> traced(exec, s);
  gart::ray_tracer<E> tracer(exec);
  tracer.set_scene(scene.view(), 1);
  auto context = tracer.forward(traced.rays.rays(), sweep_options());
  auto const before = traced.differentiate(tracer, context, 100, 1);
  // Another batch, of another frame and cut-off, leaves it as it is; so do the same Gaussians.
  gart::render_options coarse;
  coarse.alpha_min = 0.2f;
  batch_memory<E> const elsewhere(exec, {3, 0, 0}, s.origins, s.directions);
  target_memory<E> out(exec, 50);
  tracer.trace(elsewhere.rays(), coarse, out.targets());
  tracer.set_scene(scene.view(), 1);
  auto const after = traced.differentiate(tracer, context, 100, 1);
  CHECK(same_bits(after.gaussians, before.gaussians));
  CHECK(after.directions == before.directions);

  auto const refused = [&](auto&& call, char const* what) {
    CHECK_THROWS_WITH_AS(call(), doctest::Contains(what), gart::invalid_argument);
  };
  gart::gaussians<E> fewer(exec, 99, 1), lower(exec, 100, 0), right(exec, 100, 1);
  refused([&] { tracer.backward(context, traced.by(), fewer.view()); }, "the number of the Gaussians");
  refused([&] { tracer.backward(context, traced.by(), lower.view()); }, "at least the SH degree");
  gart::buffer<float, E> const shorter(exec, 7);
  refused([&] { tracer.backward(context, {shorter}, right.view()); }, "output_gradients.color has 7 numbers");
  refused([&] { tracer.backward(context, {{}, shorter}, right.view()); }, "output_gradients.depth has 7 numbers");

  model.opacity[17] += 0.1f;
  scene.assign(model);
  tracer.set_scene(scene.view(), 1);
  refused([&] { tracer.backward(context, traced.by(), right.view()); }, "have changed since forward()");
}
