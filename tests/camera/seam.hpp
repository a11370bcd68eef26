#pragma once
// Holds a camera model to what camera/model.hpp asks of it: scenes of random Gaussians around the camera, traced by
// every tracer through the seam alone, against each pixel's ray and every Gaussian in double.

#include <gart/backward/backward.hpp>
#include <gart/trace/bvh_tracer.hpp>
#include <gart/trace/tile_tracer.hpp>
#if defined(GART_WITH_EMBREE)
#include <gart/trace/embree_tracer.hpp>
#endif
#include <support/policies.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace gart_test {

inline constexpr float seam_alpha_min = 1.0f / 255, seam_near = 0.05f;
inline constexpr int seam_capacity = 512;  // hits of a pixel

// Every hit of every pixel, and the ray that found them.
template <class Model>
struct list_every_hit : gart::ray_program_base {
  using ray_type = decltype(std::declval<Model const&>().ray(0.0f, 0.0f));
  struct state {
    ray_type ray;
    gart::u32 count = 0, place = 0;
  };
  Model model;
  gart::pixel_order order;
  gart::hit* list;
  gart::u32* counts;
  gart::ray* rays;

  GART_HD bool active(gart::index_t i) const { return order.inside(order.at(i)); }
  GART_HD gart::pixel at(gart::index_t i) const { return order.at(i); }
  GART_HD state begin(gart::index_t i) const {
    gart::pixel const p = order.at(i);
    state s{model.ray(static_cast<float>(p.x) + 0.5f, static_cast<float>(p.y) + 0.5f)};
    s.place = static_cast<gart::u32>(order.address(p));
    return s;
  }
  GART_HD ray_type ray_of(gart::index_t, state const& s) const { return s.ray; }
  GART_HD bool on_hit(state& s, gart::hit const& h) const {
    if (s.count < seam_capacity) list[std::size_t{seam_capacity} * s.place + s.count] = h;
    ++s.count;
    return true;
  }
  GART_HD void end(gart::index_t, state const& s) const {
    counts[s.place] = s.count;
    rays[s.place] = {origin_of(s.ray), s.ray.direction};
  }
};

struct every_hit {
  std::vector<std::vector<gart::hit>> of;  // [H][W]
  std::vector<gart::ray> rays;
};

// Gaussians in double, one ray at a time.
class brute_force {
 public:
  struct found {
    gart::u32 id;
    double t, d2, alpha;
    bool sure;  // not so near to the edge of its ellipsoid, or to near, that a rounding decides
  };

  brute_force(gart::gaussian_model const& model, gart::vec3d const& frame) {
    for (std::size_t i = 0; i < model.size(); ++i) {
      body b;
      double q[4], norm = 0;
      for (std::size_t k = 0; k < 4; ++k) q[k] = model.quaternion[4 * i + k], norm += q[k] * q[k];
      for (double& v : q) v /= std::sqrt(norm);
      double const w = q[0], x = q[1], y = q[2], z = q[3];
      double const r[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                              {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                              {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
      for (int k = 0; k < 3; ++k) {
        b.mean[k] = model.mean[3 * i + static_cast<std::size_t>(k)] - frame[k];
        double const inverse = std::exp(-static_cast<double>(model.log_scale[3 * i + static_cast<std::size_t>(k)]));
        for (int j = 0; j < 3; ++j) b.m[k][j] = r[j][k] * inverse;
      }
      b.sigma = 1 / (1 + std::exp(-static_cast<double>(model.opacity[i])));
      b.cutoff = 2 * std::log(b.sigma / static_cast<double>(seam_alpha_min));
      bodies_.push_back(b);
    }
  }

  // By distance.
  std::vector<found> hits(gart::ray const& r) const {
    std::vector<found> out;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      body const& b = bodies_[i];
      double o[3], d[3], od = 0, dd = 0;
      for (int k = 0; k < 3; ++k) {
        o[k] = d[k] = 0;
        for (int j = 0; j < 3; ++j)
          o[k] += b.m[k][j] * (static_cast<double>(r.origin[j]) - b.mean[j]), d[k] += b.m[k][j] * r.direction[j];
        od += o[k] * d[k], dd += d[k] * d[k];
      }
      double const t = -od / dd;
      double d2 = 0;
      for (int k = 0; k < 3; ++k) d2 += (o[k] + t * d[k]) * (o[k] + t * d[k]);
      double const edge = 1e-3 * b.cutoff + 1e-4;
      if (!(d2 <= b.cutoff + edge && t > 0.999 * seam_near)) continue;
      bool const sure = d2 < b.cutoff - edge && t > 1.001 * seam_near;
      out.push_back({static_cast<gart::u32>(i), t, d2, std::min(0.99, b.sigma * std::exp(-0.5 * d2)), sure});
    }
    std::sort(out.begin(), out.end(), [](found const& a, found const& b) { return a.t < b.t; });
    return out;
  }

 private:
  struct body {
    double mean[3], m[3][3], sigma, cutoff;
  };
  std::vector<body> bodies_;
};

// Around the camera in every direction; some of them about it.
inline gart::gaussian_model gaussians_around(gart::vec3d const& center, double distance, int count,
                                             std::mt19937_64& random) {
  auto const uniform = [&](double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(random); };
  std::normal_distribution<float> normal;
  gart::gaussian_model m;
  m.sh_degree = 0;
  for (int i = 0; i < count; ++i) {
    double const far = distance * std::exp(uniform(-1.5, 1.5)), size = far * std::exp(uniform(-5, i % 8 ? -1 : 0.3));
    double d[3], norm = 0;
    for (double& v : d) v = normal(random), norm += v * v;
    for (int k = 0; k < 3; ++k) {
      m.mean.push_back(static_cast<float>(center[k] + far * d[k] / std::sqrt(norm)));
      m.log_scale.push_back(static_cast<float>(std::log(size) + uniform(-2, 0)));
      m.sh.push_back(normal(random));
    }
    for (int k = 0; k < 4; ++k) m.quaternion.push_back(normal(random));
    m.opacity.push_back(static_cast<float>(uniform(-4, 4)));
  }
  return m;
}

// A scene on a policy, and a model's view of it.
template <class E, class Model>
class seam_scene {
 public:
  seam_scene(E& exec, gart::gaussian_model const& model, Model const& view)
      : exec_(exec), view_(view), scene_(exec, model), brute_(model, view.position) {}

  template <class Tracer>
  every_hit list() {
    frame_by<Tracer> frame(exec_);
    frame.prepare(constant(), view_, options());
    std::size_t const pixels = static_cast<std::size_t>(view_.width) * view_.height;
    gart::buffer<gart::hit, E> list(exec_, pixels * seam_capacity);
    gart::buffer<gart::u32, E> counts(exec_, pixels);
    gart::buffer<gart::ray, E> rays(exec_, pixels);
    gart::pixel_order const order{view_.width, view_.height};
    frame.trace("list", order.launch_size(),
                list_every_hit<Model>{{}, view_, order, list.data(), counts.data(), rays.data()});
    every_hit out{{}, rays.to_host()};
    auto const flat = list.to_host();
    auto const count = counts.to_host();
    for (std::size_t i = 0; i < pixels; ++i) {
      REQUIRE(count[i] <= seam_capacity);
      auto const from = flat.begin() + static_cast<std::ptrdiff_t>(i * seam_capacity);
      out.of.emplace_back(from, from + count[i]);
    }
    return out;
  }

  template <class Tracer>
  std::vector<float> image() {
    frame_by<Tracer> frame(exec_);
    frame.prepare(constant(), view_, options());
    gart::buffer<float, E> color(exec_, std::size_t{3} * view_.width * view_.height);
    frame.render({color.data()});
    return color.to_host();
  }

  // Of the sum of the image's colours, through a filter of so many pixels.
  template <class Tracer, class Method>
  gart::gaussian_model gradients(float antialias) {
    frame_by<Tracer> frame(exec_);
    gart::backward_pass<frame_by<Tracer>, Method> pass(exec_);
    gart::render_options o = options();
    o.antialias = antialias;
    std::size_t const floats = std::size_t{3} * view_.width * view_.height;
    gart::buffer<float, E> color(exec_, floats), by_color(exec_, std::vector<float>(floats, 1.0f));
    gart::gaussians<E> out(exec_, scene_.size(), 0);
    frame.prepare(constant(), view_, o);
    REQUIRE(pass.prepare(frame));
    pass.render(frame, {color.data()});
    differentiate(frame, pass, gart::span<float const>(by_color), out);
    return out.to_host();
  }

  gart::footprint footprint(gart::gaussian_model const& m, gart::u32 i) const {
    gart::gaussians_view<float const> const all{m.mean.data(),    m.log_scale.data(), m.quaternion.data(),
                                                m.opacity.data(), m.sh.data(),        static_cast<gart::u32>(m.size()),
                                                m.sh_degree};
    return gart::footprint_of(view_.bounds(seam_near), gart::load_parameters(all, i), view_.position, seam_alpha_min);
  }
  brute_force const& brute() const { return brute_; }

 private:
  static gart::render_options options() {
    gart::render_options o;
    o.alpha_min = seam_alpha_min, o.near = seam_near;
    return o;
  }
  gart::gaussians_view<float const> constant() const { return std::as_const(scene_).view(); }
  template <class Tracer>
  using frame_by = gart::frame<E, gart::scene_traits<0>, Tracer, Model>;

  E& exec_;
  Model view_;
  gart::gaussians<E> scene_;
  brute_force brute_;
};

// The hits of two tracers, pixel by pixel: how many pixels differ in a bit.
inline long other_lists(every_hit const& a, every_hit const& b) {
  long other = 0;
  for (std::size_t p = 0; p < b.of.size(); ++p)
    other += !std::equal(
        a.of[p].begin(), a.of[p].end(), b.of[p].begin(), b.of[p].end(),
        [](gart::hit const& x, gart::hit const& y) { return x.t == y.t && x.id == y.id && x.alpha == y.alpha; });
  return other;
}

// Lists by all tracers, the same bits, and what every Gaussian in double has of every ray; no hit outside of its box
// or nearer than its depth.
template <class E, class Model>
void check_hits(E& exec, Model const& view, gart::gaussian_model const& model) {
  REQUIRE(view.fault().what == nullptr);
  seam_scene<E, Model> scene(exec, model, view);
  every_hit const by_tiles = scene.template list<gart::tile_tracer<E>>();
  every_hit const by_bvh = scene.template list<gart::bvh_tracer<E>>();
  std::vector<gart::footprint> prints;
  for (gart::u32 i = 0; i < model.size(); ++i) prints.push_back(scene.footprint(model, i));
  gart::ray_depth const depth = view.depth();
  CHECK(other_lists(by_tiles, by_bvh) == 0);
#if defined(GART_WITH_EMBREE)
  if constexpr (!E::device) CHECK(other_lists(scene.template list<gart::embree_tracer<E>>(), by_bvh) == 0);
#endif
  long hits = 0, outside = 0, too_near = 0, missed = 0, invented = 0;
  double box_area = 0;
  for (gart::footprint const& f : prints) box_area += f.box.area();
  for (std::size_t p = 0; p < by_bvh.of.size(); ++p) {
    int const x = static_cast<int>(p) % view.width, y = static_cast<int>(p) / view.width;
    auto const& b = by_bvh.of[p];
    hits += static_cast<long>(b.size());
    for (gart::hit const& h : b) {
      gart::footprint const& f = prints[h.id];
      int const column = x < f.box.x0 ? x + f.seam : x;
      outside += column < f.box.x0 || column >= f.box.x1 || y < f.box.y0 || y >= f.box.y1;
      too_near += h.t * depth.per_distance(by_bvh.rays[p].direction) < f.depth;
    }
    auto const expected = scene.brute().hits(by_bvh.rays[p]);
    std::vector<gart::u32> ids, sure, likely;
    for (gart::hit const& h : b) ids.push_back(h.id);
    for (auto const& e : expected) {
      likely.push_back(e.id);
      if (e.sure) sure.push_back(e.id);
    }
    for (auto* list : {&ids, &sure, &likely}) std::sort(list->begin(), list->end());
    missed += !std::includes(ids.begin(), ids.end(), sure.begin(), sure.end());
    invented += !std::includes(likely.begin(), likely.end(), ids.begin(), ids.end());
  }
  CAPTURE(hits);
  CHECK(hits > 1000);
  CHECK(outside == 0);
  CHECK(too_near == 0);
  CHECK(missed == 0);
  CHECK(invented == 0);
  CAPTURE(box_area / static_cast<double>(hits));
}

// The image of a camera with one centre, composited in double.
template <class E, class Model>
void check_image(E& exec, Model const& view, gart::gaussian_model const& model) {
  seam_scene<E, Model> scene(exec, model, view);
  std::vector<float> const by_tiles = scene.template image<gart::tile_tracer<E>>();
  std::vector<float> const by_bvh = scene.template image<gart::bvh_tracer<E>>();
  std::vector<gart::ray> const rays = scene.template list<gart::bvh_tracer<E>>().rays;
  CHECK(by_tiles == by_bvh);
  long wrong = 0;
  double worst = 0;
  for (std::size_t p = 0; p < rays.size(); ++p) {
    double color[3] = {}, transmittance = 1, unsure = 0;
    for (auto const& h : scene.brute().hits(rays[p])) {
      if (!h.sure) {
        unsure += 2 * h.alpha * transmittance;
        continue;
      }
      for (std::size_t c = 0; c < 3; ++c)
        color[c] += transmittance * h.alpha * std::max(0.0, 0.5 + 0.28209479177387814 * model.sh[3 * h.id + c]);
      transmittance *= 1 - h.alpha;
      if (transmittance < 1e-4) break;
    }
    for (std::size_t c = 0; c < 3; ++c) {
      double const error = std::abs(by_bvh[3 * p + c] - color[c]);
      wrong += !(error < 2e-3 + 4 * unsure);
      if (unsure == 0) worst = std::max(worst, error);
    }
  }
  CAPTURE(worst);
  CHECK(wrong == 0);
}

// Gradients by primitive on tile lists are those by pixel on the tree, the filter's way back among them.
template <class E, class Model>
void check_gradients(E& exec, Model const& view, gart::gaussian_model const& model) {
  seam_scene<E, Model> scene(exec, model, view);
  for (float antialias : {0.0f, 0.3f}) {
    auto const a = scene.template gradients<gart::tile_tracer<E>, gart::primitive_method>(antialias);
    auto const b = scene.template gradients<gart::bvh_tracer<E>, gart::pixel_method>(antialias);
    auto const apart = [](std::vector<float> const& x, std::vector<float> const& y) {
      double difference = 0, size = 0;
      for (std::size_t k = 0; k < x.size(); ++k)
        difference += std::abs(double{x[k]} - y[k]), size += std::abs(double{y[k]});
      return difference / size;
    };
    CAPTURE(antialias);
    CHECK(apart(a.mean, b.mean) < 1e-4);
    CHECK(apart(a.log_scale, b.log_scale) < 1e-4);
    CHECK(apart(a.quaternion, b.quaternion) < 1e-4);
    CHECK(apart(a.opacity, b.opacity) < 1e-4);
    CHECK(apart(a.sh, b.sh) < 1e-4);
  }
}

}  // namespace gart_test
