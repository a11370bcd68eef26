// Light at surfaces and sRGB's curve, against their textbooks in double.
#include <gart/math/optics.hpp>
#include <gart/math/srgb.hpp>

#include <doctest/doctest.h>

#include <cmath>
#include <initializer_list>

namespace {

using gart::vec3;
using gart::vec3d;

// Amplitudes of both polarisations, by the angles on both sides (Born and Wolf, "Principles of Optics", 1.5.2).
double reflected_part(double in, double out) {
  if (in < 1e-9) return -1;  // no angle: by the indices alone
  double const s = std::sin(in - out) / std::sin(in + out), p = std::tan(in - out) / std::tan(in + out);
  return 0.5 * (s * s + p * p);
}

}  // namespace

TEST_CASE("refraction keeps Snell's law; beyond it all is reflected") {
  vec3 const n(0, 0, 1);
  for (double const ratio : {1 / 1.5, 1 / 2.4, 1.0001, 1.33, 1.5}) {
    for (double degrees = 1; degrees < 90; degrees += 1.7) {
      CAPTURE(ratio);
      CAPTURE(degrees);
      double const in = degrees * 3.14159265358979 / 180, sine = ratio * std::sin(in);
      vec3 const direction(vec3d(std::sin(in) * 0.6, std::sin(in) * 0.8, -std::cos(in)));
      float const back = gart::fresnel(-glm::dot(direction, n), static_cast<float>(ratio));
      vec3 const mirrored = gart::reflected(direction, n);
      CHECK(glm::length(mirrored - vec3(direction.x, direction.y, -direction.z)) < 1e-6f);
      if (std::fabs(sine - 1) < 1e-3) continue;
      if (sine > 1) {
        CHECK(back == 1);
        continue;
      }
      CHECK(double{back} == doctest::Approx(reflected_part(in, std::asin(sine))).epsilon(2e-4).scale(1e-3));
      vec3d const through(gart::refracted(direction, n, static_cast<float>(ratio)));
      CHECK(std::fabs(glm::length(through) - 1) < 1e-6);
      CHECK(through.z < 0);
      CHECK(std::fabs(std::hypot(through.x, through.y) - sine) < 1e-5);
      CHECK(std::fabs(through.x * 0.8 - through.y * 0.6) < 1e-6);  // in the plane that it came in
    }
    double const r = (ratio - 1) / (ratio + 1);
    CHECK(double{gart::fresnel(1, static_cast<float>(ratio))} == doctest::Approx(r * r).epsilon(1e-4).scale(1e-4));
  }
}

TEST_CASE("sRGB's curve is that of IEC 61966-2-1, there and back") {
  for (int k = 0; k <= 4096; ++k) {
    CAPTURE(k);
    double const shown = k / 4096.0, light = shown <= 0.04045 ? shown / 12.92 : std::pow((shown + 0.055) / 1.055, 2.4);
    CHECK(std::fabs(double{gart::linear_light(static_cast<float>(shown))} - light) < 2e-6);
    CHECK(std::fabs(gart::linear_light(shown) - light) < 1e-12);
    CHECK(std::fabs(double{gart::displayed(static_cast<float>(light))} - shown) < 3e-6);
  }
}
