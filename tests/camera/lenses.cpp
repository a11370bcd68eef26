// Every model with a lens, and the sphere, held to the seam; their rays to the models' definitions in double.
#include "lenses.hpp"
#include "seam.hpp"

TEST_CASE_TEMPLATE("lenses and the sphere are traced through the seam", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  std::normal_distribution<float> normal;
  E exec;
  for (auto const& lens : gart_test::lenses()) {
    CAPTURE(std::string(lens.name));
    gart::camera c = gart_test::camera_of(lens, 45);
    c.rotation = gart::to_matrix({normal(random), normal(random), normal(random), normal(random)});
    c.position = {10 * normal(random), 10 * normal(random), 10 * normal(random)};
    auto const model = gart_test::gaussians_around(c.position, 3, 500, random);
    gart::visit_camera(c, [&](auto const& view) {
      CHECK(view.one_to_one());
      using model_type = std::decay_t<decltype(view)>;
      if constexpr (std::is_same_v<model_type, gart::radial_lens> ||
                    std::is_same_v<model_type, gart::equirectangular>) {
        gart_test::check_hits(exec, view, model);
        gart_test::check_image(exec, view, model);
        gart_test::check_gradients(exec, view, model);
      }
    });
  }
}

TEST_CASE_TEMPLATE("a lens that shows much measures boxes later, to the same", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  std::normal_distribution<float> normal;
  E exec;
  gart::serial_exec host;
  constexpr float alpha_min = 1.0f / 255, near = 0.01f;
  for (auto const& lens : gart_test::lenses()) {
    CAPTURE(std::string(lens.name));
    gart::camera c = gart_test::camera_of(lens, 1000);
    c.rotation = gart::to_matrix({normal(random), normal(random), normal(random), normal(random)});
    auto const model = gart_test::gaussians_around(c.position, 3, 2000, random);
    gart::gaussians<E> const scene(exec, model);
    gart::gaussians<gart::serial_exec> const same(host, model);
    gart::visit_camera(c, [&](auto const& view) {
      auto const bounds = view.bounds(near);
      if constexpr (gart::detail::staged_bounds<std::remove_const_t<decltype(bounds)>>) {
        gart::footprints<E, 8> prints(exec);
        prints.measure(exec, scene.view(), view, alpha_min, near);
        std::vector<gart::footprint_slots> ranges(model.size());
        exec.copy_out(ranges.data(), prints.ranges().data(), ranges.size() * sizeof ranges[0]);
        int late = 0, worst = 0;
        for (gart::index_t i = 0; i < model.size(); ++i) {
          gart::gaussian_parameters const g = gart::load_parameters(same.view(), i);
          gart::ellipsoid e;
          if (!gart::ellipsoid_of<>(g, view.position, alpha_min, e)) continue;
          bool wide = false;
          gart::pixel_box const whole = bounds(e).box, first = bounds.narrow(e, wide).box, got = ranges[i].box;
          late += wide;
          auto const apart = [](gart::pixel_box const& a, gart::pixel_box const& b) {
            auto const least = [](gart::pixel_box const& x) {
              return static_cast<int>(std::min(x.width(), x.height()));
            };
            if (a.empty() || b.empty()) return least(a) + least(b);
            return std::max(
                {std::abs(a.x0 - b.x0), std::abs(a.x1 - b.x1), std::abs(a.y0 - b.y0), std::abs(a.y1 - b.y1)});
          };
          if (!wide) CHECK(apart(first, whole) == 0);
          worst = std::max(worst, apart(got, whole));
        }
        CHECK(worst <= (E::device ? 1 : 0));  // a device contracts other products
        CHECK(late > 20);
      }
    });
  }
}

TEST_CASE("rays are their models' in double; where none is, zero") {
  for (auto const& lens : gart_test::lenses()) {
    CAPTURE(std::string(lens.name));
    gart::camera const c = gart_test::camera_of(lens, 300);
    double worst = 0;
    long given = 0, crooked = 0;
    for (int y = 0; y < c.height; ++y)
      for (int x = 0; x < c.width; ++x) {
        float const u = static_cast<float>(x) + 0.5f, v = static_cast<float>(y) + 0.5f;
        gart::vec3 const d = gart::ray_direction(c, u, v);
        if (d == gart::vec3(0.0f)) continue;
        ++given;
        crooked += !(std::abs(glm::dot(gart::vec3d(d), gart::vec3d(d)) - 1) < 1e-6);
        double a, b;
        gart_test::image_by_definition(c, d.x, d.y, d.z, a, b);
        // A rounding of the direction is more pixels where a pixel is a smaller angle: next to a pole.
        double const across = lens.kind == gart::camera_kind::equirectangular ? std::hypot(d.x, d.z) : 1;
        worst = std::max({worst, std::abs(a - u) * across, std::abs(b - v)});
      }
    CAPTURE(worst);
    CHECK(crooked == 0);
    CHECK(worst < 2e-3);
    CHECK(given > 0.7 * c.width * c.height);
  }
  // An image circle within the image: its corners see nothing.
  gart::camera c;
  c.kind = gart::camera_kind::fisheye;
  c.width = c.height = 101, c.fx = c.fy = 12, c.cx = c.cy = 50.5f;
  CHECK(gart::ray_direction(c, 0.5f, 0.5f) == gart::vec3(0.0f));
  CHECK(gart::ray_direction(c, 50.5f + 12 * 3.15f, 50.5f) == gart::vec3(0.0f));
  CHECK(gart::ray_direction(c, 50.5f + 12 * 3.13f, 50.5f).z == doctest::Approx(std::cos(3.13)));
  CHECK(gart::ray_direction(c, 50.5f, 50.5f).z == 1);
  // A lens whose distances stop to grow: past that there is none.
  c.lens.k1 = -0.2f;
  double const turn = std::sqrt(1 / (3 * 0.2)), last = turn * (1 - 0.2 * turn * turn);
  CHECK(gart::ray_direction(c, 50.5f + 12 * static_cast<float>(0.999 * last), 50.5f) != gart::vec3(0.0f));
  CHECK(gart::ray_direction(c, 50.5f + 12 * static_cast<float>(1.001 * last), 50.5f) == gart::vec3(0.0f));
}

TEST_CASE("pixels of lenses and sphere have the filter's solid angle") {
  for (auto const& lens : gart_test::lenses()) {
    CAPTURE(std::string(lens.name));
    gart::camera const c = gart_test::camera_of(lens, 200);
    double worst = 0;
    // Towards the rim a lens may see a quarter of the sphere in a few pixels.
    bool const sphere = lens.kind == gart::camera_kind::equirectangular;
    double const rim = sphere ? 4 : 0.7 * gart_test::last_angle(c);
    gart::visit_camera(c, [&](auto const& model) {
      auto const filter = model.filter(1.0f);
      for (int y = 10; y < c.height - 10; y += 9)
        for (int x = 10; x < c.width - 10; x += 9) {
          auto const at = [&](double dx, double dy) {
            return gart::vec3d(model.ray(static_cast<float>(x + dx), static_cast<float>(y + dy)).direction);
          };
          gart::vec3d const d = at(0, 0);
          if (at(0.5, 0.5) == gart::vec3d(0.0) || at(-0.5, -0.5) == gart::vec3d(0.0)) continue;
          if (std::acos(d.z) > rim) continue;
          double const area = glm::length(glm::cross(at(0.5, 0) - at(-0.5, 0), at(0, 0.5) - at(0, -0.5)));
          worst = std::max(worst, std::abs(filter.sigma_at(gart::vec3(3.0 * d)) / (3 * std::sqrt(area)) - 1));
          // How it changes, by differences.
          gart::vec3 const m(3.0 * d);
          auto const change = filter.at(m);
          for (int k = 0; k < 3; ++k) {
            gart::vec3 up = m, down = m;
            up[k] += 0.01f, down[k] -= 0.01f;
            double const slope =
                (std::log(double{filter.sigma_at(up)}) - std::log(double{filter.sigma_at(down)})) / 0.02;
            CHECK(std::abs(slope - change.log_slope[k]) < 0.03);
          }
        }
    });
    CAPTURE(worst);
    CHECK(worst < 0.02);  // tangential terms are left out
  }
}

TEST_CASE_TEMPLATE("a camera that turns half round rolls its sphere's image", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  std::normal_distribution<float> normal;
  E exec;
  gart::camera c;
  c.kind = gart::camera_kind::equirectangular;
  c.width = 92, c.height = 47;
  c.rotation = gart::to_matrix({normal(random), normal(random), normal(random), normal(random)});
  c.position = {normal(random), normal(random), normal(random)};
  auto const model = gart_test::gaussians_around(c.position, 3, 800, random);
  gart::camera turned = c;
  turned.rotation[0] = -c.rotation[0], turned.rotation[2] = -c.rotation[2];
  auto const image = [&](gart::camera const& view) {
    return gart_test::seam_scene<E, gart::equirectangular>(exec, model, gart::equirectangular(view))
        .template image<gart::tile_tracer<E>>();
  };
  std::vector<float> const a = image(c), b = image(turned);
  float worst = 0;
  for (std::size_t y = 0; y < 47; ++y)
    for (std::size_t x = 0; x < 92; ++x)
      for (std::size_t k = 0; k < 3; ++k)
        worst = std::max(worst, std::abs(a[3 * (92 * y + x) + k] - b[3 * (92 * y + (x + 46) % 92) + k]));
  CHECK(worst < 1e-5f);
}
