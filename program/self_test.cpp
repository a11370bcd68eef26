#include "self_test.hpp"

#include "timing.hpp"

#include <gart/reference/reference.hpp>
#include <gart/runtime/renderer.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace gart_cli {

namespace {

constexpr int side = 40;            // of the image, pixels
constexpr int gaussians = 300;      // of the scene
constexpr double off_image = 1e-4;  // most that a colour may be off by

// And a gradient, in parts of the largest of its kind.
double off_gradient(gart::configuration_info const& c) {
  return c.hit_format == gart::hit_format_kind::half ? 0.02 : 1e-3;
}

// Numbers in [-1, 1], the same on every machine.
struct numbers {
  gart::u64 state = 1;
  float operator()() {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return static_cast<float>(static_cast<double>(state >> 40) / (1 << 23) - 1);
  }
};

gart::gaussian_model scene_of(int degree) {
  gart::gaussian_model out;
  out.resize(gaussians, degree);
  numbers next;
  for (float& v : out.mean) v = next();
  for (std::size_t i = 2; i < out.mean.size(); i += 3) out.mean[i] += 3;
  for (float& v : out.log_scale) v = -2.2f + 0.5f * next();
  for (float& v : out.quaternion) v = next();
  for (float& v : out.opacity) v = 1 + next();
  for (float& v : out.sh) v = 0.5f * next();
  return out;
}

gart::camera view() {
  gart::camera out;
  out.width = out.height = side;
  out.fx = out.fy = out.cx = out.cy = side / 2;
  return out;
}

// Without steps where a Gaussian begins to count, so that both agree about which do.
gart::render_options options() {
  gart::render_options out;
  out.alpha_min = 1e-9f, out.transmittance_min = 0, out.background = gart::vec3(0.2f, 0.5f, 0.9f);
  return out;
}

std::vector<double> image_gradient() {
  numbers next{7};
  std::vector<double> out(std::size_t{3} * side * side);
  for (double& v : out) v = static_cast<double>(next());
  return out;
}

double largest(std::vector<double> const& values) {
  double most = 0;
  for (double const v : values) most = std::max(most, std::abs(v));
  return most;
}

template <class Values>
double difference(Values const& got, std::vector<double> const& expected) {
  if (got.size() != expected.size()) return HUGE_VAL;
  double most = 0;
  for (std::size_t k = 0; k < expected.size(); ++k) {
    double const off = std::abs(static_cast<double>(got[k]) - expected[k]);
    most = off <= most ? most : off;  // what is not a number is the most
  }
  return most;
}

// By (SH degree, kernel degree).
gart::reference_image const& definition(int degree, int kernel_degree) {
  static std::map<std::pair<int, int>, gart::reference_image> known;
  auto const [place, is_new] = known.try_emplace({degree, kernel_degree});
  if (is_new)
    place->second = gart::trace_reference(scene_of(degree), view(), options(), degree, gart::all_pixels(view()),
                                          image_gradient(), kernel_degree);
  return place->second;
}

struct differences {
  double image = 0, gradient = 0;
  bool small(gart::configuration_info const& c) const { return image <= off_image && gradient <= off_gradient(c); }
};

differences measure(gart::configuration_info const& c) {
  gart::configuration_request request;
  request.backend = c.backend, request.tracer = c.tracer, request.backward = c.backward;
  request.sh_degree = c.stored_degree, request.kernel_degree = c.kernel_degree;
  request.hit_format = c.hit_format, request.depth = c.depth;
  auto const renderer = gart::make_renderer(request);
  renderer->set_model(scene_of(c.stored_degree));
  gart::reference_image const& expected = definition(c.stored_degree, c.kernel_degree);
  differences out;
  out.image = difference(renderer->render(view(), options()).color.data, expected.color);
  std::vector<double> const by = image_gradient();
  gart::image_float color_gradient(side, side, 3);
  std::transform(by.begin(), by.end(), color_gradient.data.begin(), [](double v) { return static_cast<float>(v); });
  renderer->differentiate(view(), options(), color_gradient);
  gart::for_each_array(
      [&](gart::parameter_array const&, std::vector<float> const& got, std::vector<double> const& wanted) {
        out.gradient = std::max(out.gradient, difference(got, wanted) / largest(wanted));
      },
      renderer->gradients(), expected.gradients);
  return out;
}

}  // namespace

int self_test() {
  int wrong = 0, right = 0;
  stopwatch const whole;
  std::puts("backend  tracer  backward            kernel  hit format  SH  image    gradients");
  for (gart::configuration_info const& c : gart::compiled_configurations()) {
    if (c.ranks || c.tracer == gart::tracer_kind::own) continue;  // ranks train, and have the others' kernels
    std::printf("%-8s %-7s %-19s %-7d %-10s %-3d ", to_string(c.backend), to_string(c.tracer),
                (c.backward + (c.depth ? "+depth" : "")).c_str(), c.kernel_degree, to_string(c.hit_format),
                c.stored_degree);
    try {
      differences const off = measure(c);
      ++(off.small(c) ? right : wrong);
      std::printf("%-8.1e %-8.1e %s\n", off.image, off.gradient, off.small(c) ? "" : "WRONG");
    } catch (gart::unsupported const& e) {
      std::printf("not here: %s\n", e.what());
    } catch (gart::error const& e) {
      ++wrong;
      std::printf("FAILED: %s\n", e.what());
    }
    std::fflush(stdout);
  }
  std::printf("\n%d configurations agree with the definition, %d do not; %.1f s\n", right, wrong, whole.seconds());
  return wrong;
}

}  // namespace gart_cli
