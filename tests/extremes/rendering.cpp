// Every extreme scene by every tracer and method: finite, the same image bit for bit, and the oracle's image and
// gradients within what float can do. Broken, huge and tiny parameters. How far float is off, and why.
#include <extremes/scenes.hpp>
#include <extremes/ways.hpp>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <cstdio>

using namespace gart_test;

namespace {

struct prepared_extreme {
  extreme e;
  oracle::picture picture;
  std::vector<float> color_gradient;
  oracle::parameters gradients;
  double decided = 0;
};

// Where rounding alone may move a pixel's gradient too far to compare. One pixel may carry much of a group: so where
// another branch may be taken (there the derivative of either side is right), where an undecided order counts more than
// a group may be off by, and where a response is off by more than three times that, bounded from above: a needle all
// but along the ray.
bool too_rounded(oracle::pixel const& pixel, double tolerance) {
  return pixel.edge || pixel.kink || pixel.slope_rounding > std::min(1e-3, tolerance) ||
         std::any_of(pixel.list.begin(), pixel.list.end(),
                     [&](oracle::hit const& h) { return h.alpha_slack > 3 * tolerance; });
}

// With a gradient of zero there.
std::vector<prepared_extreme> const& prepared() {
  static std::vector<prepared_extreme> const all = [] {
    std::vector<prepared_extreme> out;
    number_source random(seed() + 1);
    for (auto& e : extremes(seed())) {
      oracle::parameters const parameters(e.scene.model);
      prepared_extreme p{std::move(e), {}, {}, {}, 0};
      oracle::scene const& s = p.e.scene;
      p.picture = oracle::render(parameters, s.view, s.options, s.active_degree);
      for (auto const& pixel : p.picture.pixels) {
        bool const aside = too_rounded(pixel, p.e.tolerance);
        p.decided += !aside / static_cast<double>(p.picture.pixels.size());
        // Where nothing is decided the gradient is still taken: it must be finite.
        for (int c = 0; c < 3; ++c)
          p.color_gradient.push_back(
              aside && p.e.tolerance != undecided ? 0.0f : static_cast<float>(random.uniform(p.e.least, 1)));
      }
      if (p.e.tolerance != undecided)
        p.gradients = oracle::gradients(parameters, s.view, s.options, s.active_degree,
                                        {p.color_gradient.begin(), p.color_gradient.end()});
      out.push_back(std::move(p));
    }
    return out;
  }();
  return all;
}

bool finite(std::vector<float> const& v) {
  return std::all_of(v.begin(), v.end(), [](float x) { return gart::is_finite(x); });
}

// The gradient of a quaternion goes as 1 / its norm: times the norm, so that no Gaussian drowns the others.
template <class T>
std::vector<T> by_norm(std::vector<T> gradient, gart::gaussian_model const& m) {
  for (std::size_t i = 0; i < m.size(); ++i) {
    double norm2 = 0;
    for (int k = 0; k < 4; ++k) norm2 += double{m.quaternion[4 * i + k]} * m.quaternion[4 * i + k];
    for (int k = 0; k < 4; ++k) gradient[4 * i + k] = static_cast<T>(gradient[4 * i + k] * std::sqrt(norm2));
  }
  return gradient;
}

struct image_errors {
  double beyond_rounding = 0;           // in units of 1e-5 and twice what rounding explains: above 1 is wrong
  double color = 0, transmittance = 0;  // of the pixels that rounding leaves decided to 1e-5
};

image_errors errors_of(outcome const& got, oracle::picture const& picture) {
  image_errors worst;
  for (std::size_t i = 0; i < picture.pixels.size(); ++i) {
    oracle::pixel const& p = picture.pixels[i];
    double const transmittance = std::abs(got.transmittance[i] - p.transmittance);
    double color = 0;
    for (int c = 0; c < 3; ++c) color = std::max(color, std::abs(got.color[3 * i + c] - p.color[c]));
    worst.beyond_rounding = std::max(worst.beyond_rounding, color / (1e-5 + 2 * p.rounding));
    // A hit of the colour behind it hardly shows in the colour, whatever its alpha: T has its own rounding.
    if (!p.edge)
      worst.beyond_rounding = std::max(worst.beyond_rounding, transmittance / (1e-5 + 2 * p.transmittance_rounding));
    if (p.edge || p.rounding > 1e-5) continue;
    worst.color = std::max(worst.color, color), worst.transmittance = std::max(worst.transmittance, transmittance);
  }
  return worst;
}

double group_error(std::size_t group, gart::gaussian_model const& got, oracle::parameters const& expected,
                   gart::gaussian_model const& model) {
  auto const& g = got.*parameter_groups[group].got;
  auto const& e = expected.*oracle_groups[group];
  return std::string(parameter_groups[group].name) == "quaternion"
             ? relative_error(by_norm(g, model), by_norm(e, model))
             : relative_error(g, e);
}

void check_finite(outcome const& o) {
  CHECK(finite(o.color));
  CHECK(finite(o.transmittance));
  CHECK(finite(o.depth));
  for (auto const& group : parameter_groups) CHECK(finite(o.gradients.*group.got));
}

void check_same_image(outcome const& a, outcome const& b) {
  CHECK(a.color == b.color);
  CHECK(a.transmittance == b.transmittance);
  CHECK(a.depth == b.depth);
  CHECK(a.hits == b.hits);
}

// The largest relative distance of a group.
double gradient_distance(outcome const& a, outcome const& b) {
  double worst = 0;
  for (auto const& group : parameter_groups) {
    auto const& e = b.gradients.*group.got;
    worst = std::max(worst, relative_error(a.gradients.*group.got, {e.begin(), e.end()}));
  }
  return worst;
}

gart::camera small_camera() { return looking_along_z(17, 13, 16); }

void append_copy(gart::gaussian_model& to, gart::gaussian_model const& from, std::size_t i) {
  for (auto const& group : parameter_groups) {
    auto const begin = (from.*group.got).begin() + static_cast<std::ptrdiff_t>(i * group.width);
    (to.*group.got).insert((to.*group.got).end(), begin, begin + group.width);
  }
}

// Slot 0-2 mean, 3-5 log-scale, 6-9 quaternion, 10 opacity, of the last Gaussian.
float& last_slot(gart::gaussian_model& m, int slot) {
  auto const from_end = [](std::vector<float>& v, int k) -> float& {
    return v[v.size() - static_cast<std::size_t>(k)];
  };
  return slot < 3    ? from_end(m.mean, 3 - slot)
         : slot < 6  ? from_end(m.log_scale, 6 - slot)
         : slot < 10 ? from_end(m.quaternion, 10 - slot)
                     : from_end(m.opacity, 1);
}

template <class T>
std::vector<T> rows(std::vector<T> const& v, int width, std::vector<bool> const& wanted, bool value) {
  std::vector<T> out;
  for (std::size_t i = 0; i < wanted.size(); ++i)
    if (wanted[i] == value)
      for (int k = 0; k < width; ++k) out.push_back(v[i * static_cast<std::size_t>(width) + k]);
  return out;
}

// Every way: `model` without its broken Gaussians gives what `expected` does, and they get no gradient.
template <class E>
void check_same(number_source& random, gart::gaussian_model const& model, std::vector<bool> const& broken,
                gart::gaussian_model const& expected) {
  E exec;
  gart::camera const view = small_camera();
  auto const gradient = random_gradient(random, view);
  auto const wanted = run_all(exec, expected, view, {}, gradient), got = run_all(exec, model, view, {}, gradient);
  for (std::size_t i = 0; i < got.size(); ++i) {
    CAPTURE(got[i].way);
    check_finite(got[i]);
    check_same_image(got[i], wanted[i]);
    for (auto const& group : parameter_groups) {
      CAPTURE(group.name);
      auto const& all = got[i].gradients.*group.got;
      auto const kept = rows(all, group.width, broken, false), lost = rows(all, group.width, broken, true);
      CHECK(std::all_of(lost.begin(), lost.end(), [](float x) { return x == 0; }));
      auto const& e = wanted[i].gradients.*group.got;
      CHECK(relative_error(kept, {e.begin(), e.end()}) < 1e-5);  // threads add in another order
    }
  }
}

}  // namespace

TEST_CASE_TEMPLATE("extremes through the filter are finite for all tracers", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  for (prepared_extreme const& p : prepared()) {
    oracle::scene const& s = p.e.scene;
    CAPTURE(s.name);
    gart::render_options options = s.options;
    options.antialias = gart::default_antialias;
    std::vector<outcome> const all = run_all(exec, s.model, s.view, options, p.color_gradient);
    for (outcome const& o : all) {
      CAPTURE(o.way);
      check_finite(o);
      check_same_image(o, all.front());
    }
  }
}

// Prints what docs/accuracy.md quotes: GART_TEST_SEED=1 test_extremes --test-case=*budget*
TEST_CASE_TEMPLATE("error budget: every extreme by every tracer and method", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  for (prepared_extreme const& p : prepared()) {
    oracle::scene const& s = p.e.scene;
    CAPTURE(s.name);
    std::vector<outcome> const all = run_all(exec, s.model, s.view, s.options, p.color_gradient);
    for (outcome const& o : all) {
      CAPTURE(o.way);
      check_finite(o);
      check_same_image(o, all.front());
    }
    // What is a hit is decided once: `primitive` decides again what `cleared` reads. The same terms, in another order.
    for (outcome const& o : all)
      if (o.way == "tiles, cleared") CHECK(gradient_distance(all.front(), o) < 1e-4);
    if (p.e.tolerance == undecided) continue;

    CHECK(p.decided >= p.e.decided);
    image_errors const image = errors_of(all.front(), p.picture);
    CHECK(image.beyond_rounding <= 1);
    std::printf("budget (%s): %-46s colour %.0e T %.0e", E::name, s.name.c_str(), image.color, image.transmittance);
    for (std::size_t g = 0; g < std::size(parameter_groups); ++g) {
      CAPTURE(parameter_groups[g].name);
      double recorded = 0, traced_again = 0;
      for (outcome const& o : all) {
        CAPTURE(o.way);
        REQUIRE((o.gradients.*parameter_groups[g].got).size() == (p.gradients.*oracle_groups[g]).size());
        double const error = group_error(g, o.gradients, p.gradients, s.model);
        CHECK(error <= p.e.tolerance);
        bool const again = o.way.find("pixel") != std::string::npos || o.way.find("hybrid") != std::string::npos;
        double& worst = again ? traced_again : recorded;
        worst = std::max(worst, error);
      }
      std::printf(" %s %.0e/%.0e", parameter_groups[g].name, recorded, traced_again);
    }
    std::printf("\n");
  }
}

TEST_CASE_TEMPLATE("NaN and infinity in geometry; quaternions without direction", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  number_source random(seed + 2);
  gart::gaussian_model const good = cloud(random, 60);
  gart::gaussian_model mixed;
  mixed.sh_degree = good.sh_degree;
  std::vector<bool> broken;
  auto const add = [&](std::size_t i, auto const& breaks) {
    append_copy(mixed, good, i), broken.push_back(false);
    append_copy(mixed, good, i), broken.push_back(true);
    breaks();
  };
  std::size_t next = 0;
  for (float const bad : {NAN, INFINITY, -INFINITY})
    for (int slot = 0; slot < 11; ++slot) add(next++, [&] { last_slot(mixed, slot) = bad; });
  for (float const norm : {0.0f, 1e-38f, 1e-10f, 3e-5f, 1e20f})
    add(next++, [&] {
      for (int k = 6; k < 10; ++k) last_slot(mixed, k) *= norm;
    });
  for (float const log_scale : {-40.0f, 41.0f, -FLT_MAX, FLT_MAX})
    add(next++, [&] { last_slot(mixed, 4) = log_scale; });
  for (; next < good.size(); ++next) append_copy(mixed, good, next), broken.push_back(false);

  check_same<E>(random, mixed, broken, good);
}

TEST_CASE_TEMPLATE("NaN and infinity in colours show black alone", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  number_source random(seed + 3);
  gart::gaussian_model broken = cloud(random, 60), black;
  black = broken;
  std::size_t i = 0;
  for (float const bad : {NAN, INFINITY, -INFINITY})
    for (std::size_t slot = 0; slot < 12; ++slot, ++i) {
      broken.sh[12 * i + slot] = bad;
      for (std::size_t k = 0; k < 4; ++k) black.sh[12 * i + 3 * k + slot % 3] = k == 0 ? -1000.0f : 0.0f;
    }
  check_same<E>(random, broken, std::vector<bool>(broken.size(), false), black);
}

TEST_CASE_TEMPLATE("largest and smallest finite numbers in the geometry", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  number_source random(seed + 4);
  gart::gaussian_model m = cloud(random, 20);
  gart::gaussian_model const good = m;
  for (float const extreme : {FLT_MAX, -FLT_MAX, 1e30f, FLT_MIN, 1e-42f, -0.0f})
    for (int slot = 0; slot < 11; ++slot) {
      append_copy(m, good, static_cast<std::size_t>(slot));
      bool const mean = slot < 3 && std::abs(extreme) > 1;
      last_slot(m, slot) = mean ? std::copysign(1e18f, extreme) : extreme;
    }
  E exec;
  gart::render_options const options;
  gart::camera const view = small_camera();
  auto const gradient = random_gradient(random, view);
  auto const all = run_all(exec, m, view, options, gradient);
  for (outcome const& o : all) {
    CAPTURE(o.way);
    check_finite(o);
    check_same_image(o, all.front());
  }
  // Farther than Embree's coordinates go it says so; the others do without.
  for (int slot = 0; slot < 3; ++slot)
    for (float const place : {FLT_MAX, -FLT_MAX}) {
      append_copy(m, good, 0);
      last_slot(m, slot) = place;
    }
  auto const tiles = run_one(exec, tracer_kind::tiles, "primitive", m, view, options, gradient);
  auto const bvh = run_one(exec, tracer_kind::bvh, "primitive", m, view, options, gradient);
  check_finite(tiles), check_finite(bvh), check_same_image(tiles, bvh);
  CHECK(tiles.color == all.front().color);
#if defined(GART_WITH_EMBREE)
  if constexpr (!E::device)
    CHECK_THROWS_AS(run_one(exec, tracer_kind::embree, "primitive", m, view, options, gradient), gart::unsupported);
#endif
}
