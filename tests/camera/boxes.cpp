// Boxes of all models against the silhouettes of random ellipsoids in double. GART_TEST_COUNT ellipsoids a model and
// size class; GART_TEST_TABLE=1 prints the table of docs/cameras.md.
#include "lenses.hpp"

#include <doctest/doctest.h>
#include <support/policies.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <random>

namespace {

struct silhouette {
  // Directions in the tangent cone: 0 of rho its middle, 1 its border.
  gart::vec3d middle, first, second;  // in the camera's axes

  silhouette(gart::ellipsoid const& e) {
    gart::mat3d const inverse = glm::inverse(e.axes);
    gart::vec3d const o = -(inverse * e.center);
    double const o2 = glm::dot(o, o), side = std::sqrt(1 - 1 / o2);
    gart::vec3d const n = o / std::sqrt(o2);
    gart::vec3d const a =
        glm::normalize(glm::cross(n, std::abs(n.x) < 0.6 ? gart::vec3d(1, 0, 0) : gart::vec3d(0, 1, 0)));
    middle = e.center + e.axes * (o / o2), first = e.axes * (side * a), second = e.axes * (side * glm::cross(n, a));
  }
  gart::vec3d at(double rho, double phi) const {
    return middle + first * (rho * std::cos(phi)) + second * (rho * std::sin(phi));
  }
};

struct size_class {
  double least, most;
  double bar;  // of the mean of areas over exact ones
};
constexpr size_class classes[] = {{0.001, 0.01, 1.01}, {0.01, 0.1, 1.05}, {0.1, 0.9, 1.1}};

long count() {
  char const* const text = std::getenv("GART_TEST_COUNT");
  return text ? std::atol(text) : 400;
}

}  // namespace

TEST_CASE("no silhouette of an ellipsoid leaves its tight box") {
  constexpr double pi = 3.14159265358979323846;
  constexpr int side = 16384, around = 360;
  CAPTURE(gart_test::seed());
  for (auto const& lens : gart_test::lenses()) {
    gart::camera const c = gart_test::camera_of(lens, side);
    bool const sphere = c.kind == gart::camera_kind::equirectangular;
    double const last = gart_test::last_angle(c);
    gart_test::beyond_angle const beyond(last);
    for (size_class const& size : classes) {
      long outside = 0, seen = 0, measured = 0;
      double ratio = 0;
      gart::visit_camera(c, [&](auto const& model) {
        auto const bounds = model.bounds(1e-4f);
        // Each by numbers of its own, so that they are the same on any number of threads.
        long const n = count();
        auto const lens_number = static_cast<std::uint64_t>(&lens - gart_test::lenses().data());
        std::uint64_t const stream =
            gart_test::seed() + 1000 * lens_number + 100000 * static_cast<std::uint64_t>(&size - classes);
#pragma omp parallel for schedule(dynamic, 64) reduction(+ : outside, seen, measured, ratio)
        for (long i = 0; i < n; ++i) {
          std::seed_seq numbers{stream, static_cast<std::uint64_t>(i)};
          std::minstd_rand random(numbers);
          auto const uniform = [&](double lo, double hi) {
            return std::uniform_real_distribution<double>(lo, hi)(random);
          };
          std::normal_distribution<double> normal;
          // Anywhere the camera looks; every twentieth on a pole or on the axis, on the seam, or at the rim.
          double theta = std::min(last, lens.half_angle) * std::sqrt(uniform(0, 1)), phi = uniform(-pi, pi);
          if (sphere) theta = std::acos(uniform(-1, 1));
          if (i % 20 == 0) {
            double const near = 2 * size.most * normal(random);
            if (i % 60 == 0) theta = std::abs(near);
            if (i % 60 == 20) theta = sphere ? pi - std::abs(near) : std::min(last + near, pi);
            if (i % 60 == 40) phi = sphere ? pi + near : pi * std::round(uniform(-2, 2)) / 2 + near;
          }
          double const distance = std::exp(uniform(-2, 3));
          gart::ellipsoid e;
          // About -y for the sphere, whose poles are there.
          gart::vec3d const d =
              sphere ? gart::vec3d(std::sin(theta) * std::sin(phi), -std::cos(theta), std::sin(theta) * std::cos(phi))
                     : gart::vec3d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
          e.center = distance * d;
          double const s = distance * std::exp(uniform(std::log(size.least), std::log(size.most)));
          gart::mat3d const turn(
              gart::to_matrix({static_cast<float>(normal(random)), static_cast<float>(normal(random)),
                               static_cast<float>(normal(random)), static_cast<float>(normal(random))}));
          int const longest = static_cast<int>(random() % 3);
          for (int k = 0; k < 3; ++k)
            e.axes[k] = turn[k] * (k == longest ? s : s * std::exp(uniform(-std::log(20.0), 0)));
          silhouette const cone(e);
          gart::footprint const f = bounds(e);
          // A look at the border, and at the inside, which is what is left where the rim cuts the border off.
          double lo[2] = {1e300, 1e300}, hi[2] = {-1e300, -1e300};
          bool whole = true;
          double first_u = 0;
          bool wrong = false;
          double pole = 0, least_x = 1e9, most_x = -1, least_y = 1e9, most_y = -1;
          for (double const rho : {1.0, 0.99, 0.9, 0.5, 0.0})
            for (int k = 0; k < (rho == 1 ? around : around / 4); ++k) {
              gart::vec3d const p = cone.at(rho, 2 * pi * k / (rho == 1 ? around : around / 4));
              double u, v;
              if (beyond(p)) {
                whole = false;
                continue;
              }
              gart_test::image_by_definition(c, p.x, p.y, p.z, u, v);
              bool const in = u >= 0.5 && v >= 0.5 && u <= c.width - 0.5 && v <= c.height - 0.5;
              whole = whole && (in || sphere);
              if (in) {
                // A box whose edge it is begins or ends with this pixel.
                double px = std::ceil(u - 0.5), py = std::ceil(v - 0.5);
                least_y = std::min(least_y, py), most_y = std::max(most_y, py);
                least_x = std::min(least_x, px), most_x = std::max(most_x, px);
                if (f.seam && px < f.box.x0) px += c.width;
                wrong = wrong || px < f.box.x0 || px > f.box.x1 || py < f.box.y0 || py > f.box.y1;
              }
              if (sphere && rho == 1) {
                if (k == 0) first_u = u;
                double const before = pole;
                pole = u - first_u;
                pole += c.width * std::round((before - pole) / c.width);
                u = first_u + pole;
              }
              if (rho == 1)
                lo[0] = std::min(lo[0], u), hi[0] = std::max(hi[0], u), lo[1] = std::min(lo[1], v),
                hi[1] = std::max(hi[1], v);
            }
          // Between the middles of pixels there is nothing to hold.
          outside += wrong && most_x > least_x && most_y > least_y;
          seen += !f.box.empty();
          if (!whole) continue;
          if (sphere && std::abs(pole) > 0.5 * c.width) {  // once round: a pole is inside
            lo[0] = 0, hi[0] = c.width;
            (cone.at(0, 0).y < 0 ? lo[1] : hi[1]) = cone.at(0, 0).y < 0 ? 0 : c.height;
          }
          auto const first = [](double edge) { return std::ceil(edge - 0.5); };
          double const exact = (first(hi[0]) - first(lo[0])) * (first(hi[1]) - first(lo[1]));
          if (exact < 400) continue;  // where a pixel at the border counts for little
          ++measured, ratio += f.box.area() / exact;
        }
      });
      CAPTURE(lens.name);
      CAPTURE(size.most);
      ratio /= static_cast<double>(std::max(measured, 1l));
      CAPTURE(ratio);
      if (std::getenv("GART_TEST_TABLE"))
        std::printf("| %s | %g | %g | %ld | %ld | %ld | %.4f |\n", lens.name, size.least, size.most, count(), outside,
                    measured, ratio);
      CHECK(outside == 0);
      CHECK(seen > count() / 4);
      CHECK(measured > count() / 20);
      // Of few ellipsoids the mean varies by the few that lie about a pole.
      double const chance = 0.5 / std::sqrt(static_cast<double>(std::max(measured, 1l)));
      CHECK(ratio < chance + size.bar);
    }
  }
}
