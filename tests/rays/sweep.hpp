#pragma once
// An arbitrary lidar sweep, its gradients by a tracer, and the central differences that they are compared with.

#include <rays/double_rays.hpp>
#include <rays/view_rays.hpp>
#include <support/kept_results.hpp>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

namespace gart_test {

// A sensor that moves and turns while it looks about, its rays in no order that an image has.
struct sweep {
  std::vector<float> origins, directions, ends, by_color, by_depth, by_transmittance;
  std::vector<float> by_features;  // of as many as there are, where there are any
  std::size_t count() const { return ends.size(); }

  sweep(std::uint64_t seed, std::size_t n, std::size_t features = 0) {
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
    for (std::size_t i = 0; i < n * features; ++i) by_features.push_back(normal(engine));
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
            double{by_transmittance[i]},
            by_features.data() + i * (by_features.size() / count())};
  }
};

struct results {
  gart::gaussian_model gaussians;
  std::vector<float> origins, directions, features;
};

template <class E>
struct traced_sweep {
  E& exec;
  batch_memory<E> rays;
  gart::buffer<float, E> by_color, by_depth, by_transmittance, by_features;
  traced_sweep(E& e, sweep const& s)
      : exec(e),
        rays(e, {}, s.origins, s.directions, s.ends),
        by_color(e, s.by_color),
        by_depth(e, s.by_depth),
        by_transmittance(e, s.by_transmittance),
        by_features(e, s.by_features) {}
  gart::output_gradients by(bool detached = false) const {
    gart::output_gradients out;
    out.color = by_color, out.depth = by_depth, out.transmittance = by_transmittance;
    out.channels.features = by_features, out.channels.detached = detached;
    return out;
  }

  results differentiate(gart::ray_tracer<E>& tracer, gart::batch_context<E>& context, gart::index_t count, int degree,
                        int features = 0, bool detached = false) {
    gart::gaussians<E> out(exec, count, degree);
    gart::buffer<float, E> origins(exec, 3 * rays.rays().count()), directions(exec, 3 * rays.rays().count());
    gart::buffer<float, E> of_features(exec, std::size_t{count} * static_cast<std::size_t>(features));
    tracer.backward(context, by(detached), out.view(), {origins.data(), directions.data()},
                    {{of_features.data(), count, features}});
    return {out.to_host(), origins.to_host(), directions.to_host(), of_features.to_host()};
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

inline constexpr double difference_step = 1e-5;

// d loss / d x by four values, of all rays or one. Nothing where one is on another branch: a step was crossed.
template <class F>
std::optional<double> slope(double& x, F const& loss) {
  double const at = x;
  std::uint64_t const branches = loss().branches;
  bool smooth = true;
  auto const value = [&](double by) {
    x = at + by;
    seen const s = loss();
    smooth = smooth && s.branches == branches;
    return s.loss;
  };
  constexpr double h = difference_step;
  double const found = (8 * (value(h) - value(-h)) - (value(2 * h) - value(-2 * h))) / (12 * h);
  x = at;
  return smooth ? std::optional(found) : std::nullopt;
}

// The same, of inputs that have a name.
using kept_slopes = kept_results<double, std::optional<double>>;
template <class F>
std::optional<double> const& slope(kept_slopes& kept, double& x, F const& loss) {
  return kept.of(x, [&] { return slope(x, loss); });
}

// All rays of a sweep, each seen by f(i).
template <class F>
seen see_all(sweep const& s, F const& f) {
  seen all;
  for (std::size_t i = 0; i < s.count(); ++i) {
    seen const one = f(i);
    all.loss += one.loss, all.branches = (all.branches ^ one.branches) * 0xff51afd7ed558ccdu;
  }
  return all;
}

// `inputs` names the other arguments but the last.
inline void compare(std::string const& inputs, gart::gaussian_model const& model, sweep const& s,
                    gart::render_options const& options, results const& got) {
  kept_slopes kept(inputs);
  double_model m(model);
  auto const loss = [&] { return see_all(s, [&](std::size_t i) { return see(m, s.ray(i), s.weights(i), options); }); };
  std::size_t used = 0, tried = 0;
  auto const check = [&](std::vector<double>& values, std::vector<float> const& by, char const* what) {
    CAPTURE(what);
    comparison c;
    std::size_t const step = values.size() > 60 ? values.size() / 60 : 1;
    for (std::size_t i = 0; i < values.size(); i += step) {
      ++tried;
      auto const expected = slope(kept, values[i], loss);
      if (!expected) continue;
      ++used;
      c.add(double{by[i]}, *expected);
    }
    CHECK(c.relative() < 1e-4);
  };
  check(m.mean, got.gaussians.mean, "mean");
  check(m.log_scale, got.gaussians.log_scale, "log-scale");
  check(m.quaternion, got.gaussians.quaternion, "quaternion");
  check(m.opacity, got.gaussians.opacity, "opacity");
  check(m.sh, got.gaussians.sh, "SH");
  if (!m.features.empty()) check(m.features, got.features, "features");
  CHECK(used > tried * 3 / 4);

  comparison origin, direction;
  for (std::size_t i = 0; i < s.count(); ++i) {
    double_ray r = s.ray(i);
    auto const of_ray = [&] { return see(m, r, s.weights(i), options); };
    for (std::size_t k = 0; k < 3; ++k) {
      if (auto const of = slope(kept, r.origin[k], of_ray)) origin.add(double{got.origins[3 * i + k]}, *of);
      if (auto const of = slope(kept, r.direction[k], of_ray)) direction.add(double{got.directions[3 * i + k]}, *of);
    }
  }
  CHECK(origin.relative() < 1e-4);
  CHECK(direction.relative() < 1e-4);
}

inline double difference(std::vector<float> const& a, std::vector<float> const& b) {
  comparison c;
  for (std::size_t i = 0; i < a.size(); ++i) c.add(double{a[i]}, double{b[i]});
  return c.relative();
}

inline bool same_bits(gart::gaussian_model const& a, gart::gaussian_model const& b) {
  return a.mean == b.mean && a.log_scale == b.log_scale && a.quaternion == b.quaternion && a.opacity == b.opacity &&
         a.sh == b.sh;
}

inline gart::render_options sweep_options() {
  gart::render_options options;
  options.background = gart::vec3(0.3f, 0.1f, 0.6f);
  return options;
}

}  // namespace gart_test
