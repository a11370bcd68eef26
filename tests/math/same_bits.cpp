// What decides a hit gives the same bits on every policy: kernels against the same functions called here.
#include <gart/camera/pixel_rays.hpp>
#include <gart/exec/buffer.hpp>
#include <gart/math/ray_gaussian.hpp>
#include <support/policies.hpp>

#include <random>
#include <vector>

// A host built without FMA rounds twice where others round once.
#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)

namespace {

struct sample {
  gart::gaussian_parameters gaussian;
  gart::vec3 direction;
};

struct outcome {
  float exponential, logarithm, sigma, cutoff, t, d2, alpha;
  gart::gaussian_parameters filtered;
};

using lens_filter = gart::slope_filter<gart::opencv_lens>;

GART_HD outcome outcome_of(sample const& s, lens_filter const& filter) {
  gart::ray_gaussian const g = gart::prepare(s.gaussian, gart::vec3d(0.0), 1.0f / 255);
  gart::ray_peak const r = gart::evaluate(g, gart::primary_ray{s.direction});
  float const x = s.gaussian.log_scale.x;
  float const e = gart::exponential(x);
  return {e,
          gart::logarithm(e),
          g.sigma,
          g.cutoff,
          r.t,
          r.d2,
          gart::hit_alpha(g, r.d2),
          gart::filtered(s.gaussian, filter)};
}

struct evaluate_samples {
  lens_filter filter;
  gart::span<sample const> samples;
  gart::span<outcome> out;
  GART_KERNEL void operator()(gart::index_t i) const { out[i] = outcome_of(samples[i], filter); }
};

template <class Model>
GART_HD gart::vec3 ray_of(Model const& view, gart::index_t i) {
  auto const k = static_cast<int>(i);
  return view.ray(static_cast<float>(k % view.width) + 0.5f, static_cast<float>(k / view.width) + 0.5f).direction;
}

template <class Model>
struct cast_rays {
  Model view;
  gart::span<gart::vec3> out;
  GART_KERNEL void operator()(gart::index_t i) const { out[i] = ray_of(view, i); }
};

struct take_reciprocals {
  gart::span<float> values;  // in fours
  GART_KERNEL void operator()(gart::index_t i) const {
    float four[4];
    for (int k = 0; k < 4; ++k) four[k] = values[4 * i + k];
    gart::reciprocals(four);
    for (int k = 0; k < 4; ++k) values[4 * i + k] = four[k];
  }
};

bool same(float a, float b) { return gart::float_to_bits(a) == gart::float_to_bits(b) || (a != a && b != b); }

}  // namespace

TEST_CASE_TEMPLATE("the same bits on every policy", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  std::normal_distribution<float> n;
  std::vector<sample> samples(50000);
  for (sample& s : samples) {
    s.gaussian = {{n(random), n(random), 4 + n(random)},
                  {3 * n(random) - 2, 3 * n(random) - 2, 3 * n(random) - 2},
                  {n(random), n(random), n(random), n(random)},
                  3 * n(random)};
    gart::vec3 const d(0.3f * n(random), 0.3f * n(random), 1.0f);
    s.direction = d / std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
  }
  gart::camera view;
  view.width = 640, view.height = 480, view.fx = view.fy = 500, view.cx = 320, view.cy = 240;
  view.lens = {0.05f, 0.01f, 0.001f, -0.002f};
  lens_filter const filter = gart::opencv(view).filter(0.3f);
  E exec;
  gart::buffer<sample, E> in(exec, samples);
  gart::buffer<outcome, E> out(exec, samples.size());
  gart::parallel_for(exec, "evaluate", static_cast<gart::index_t>(samples.size()), evaluate_samples{filter, in, out});
  auto const got = out.to_host();
  long other[11] = {};
  for (std::size_t i = 0; i < samples.size(); ++i) {
    outcome const e = outcome_of(samples[i], filter), g = got[i];
    other[0] += !same(e.exponential, g.exponential), other[1] += !same(e.logarithm, g.logarithm);
    other[2] += !same(e.sigma, g.sigma), other[3] += !same(e.cutoff, g.cutoff), other[4] += !same(e.t, g.t);
    other[5] += !same(e.d2, g.d2), other[6] += !same(e.alpha, g.alpha);
    for (int k = 0; k < 3; ++k) other[7 + k] += !same(e.filtered.log_scale[k], g.filtered.log_scale[k]);
    other[10] += !same(e.filtered.opacity, g.filtered.opacity);
  }
  for (long count : other) CHECK(count == 0);
}

TEST_CASE_TEMPLATE("the same rays on every policy, whatever the lens", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  std::normal_distribution<float> n;
  for (int k = 0; k < 8; ++k) {
    gart::camera view;
    view.width = 160, view.height = 120;
    view.fx = 110 + 10 * n(random), view.fy = 110 + 10 * n(random);
    view.cx = 80 + n(random), view.cy = 60 + n(random);
    if (k % 2) view.lens = {0.05f * n(random), 0.02f * n(random), 0.01f * n(random), 0.01f * n(random)};
    view.rotation = gart::to_matrix({n(random), n(random), n(random), n(random)});
    E exec;
    auto const count = static_cast<gart::index_t>(view.width) * view.height;
    gart::buffer<gart::vec3, E> out(exec, static_cast<std::size_t>(count));
    gart::camera_rays<E> rays(exec);
    rays.cast(exec, view);
    long other = 0;
    gart::visit_camera(view, [&]<class Model>(Model const& model) {
      gart::parallel_for(exec, "cast", count, cast_rays<Model>{model, out});
      auto const got = out.to_host();
      std::vector<gart::vec3> table(got);
      if (gart::vec3 const* const from = rays.view().directions)
        exec.copy_out(table.data(), from, table.size() * sizeof(gart::vec3));
      for (gart::index_t i = 0; i < count; ++i) {
        gart::vec3 const expected = ray_of(model, i);
        for (int c = 0; c < 3; ++c) {
          other += !same(expected[c], got[static_cast<std::size_t>(i)][c]);
          other += !same(expected[c], table[static_cast<std::size_t>(i)][c]);
        }
      }
    });
    CHECK(other == 0);
  }
}

TEST_CASE_TEMPLATE("reciprocals of several numbers are correctly rounded", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  constexpr int fours = 1 << 19;
  std::vector<float> values;
  for (int i = 0; i < fours; ++i) {
    bool const any = i % 8 == 0;  // of some fours any bits at all, of the others usual numbers
    for (int k = 0; k < 4; ++k) {
      gart::u32 const bits = static_cast<gart::u32>(random());
      values.push_back(gart::bits_to_float(any ? bits : (bits & 0x807fffffu) | (1 + (bits >> 8) % 252) << 23));
    }
  }
  E exec;
  gart::buffer<float, E> on(exec, values);
  gart::parallel_for(exec, "reciprocals", gart::index_t{fours}, take_reciprocals{on});
  auto const got = on.to_host();
  long other = 0;
  for (std::size_t i = 0; i < values.size(); ++i) other += !same(got[i], 1.0f / values[i]);
  CHECK(other == 0);
}

#endif
