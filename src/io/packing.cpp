#include "packing.hpp"

#include "bulk.hpp"
#include "parallel.hpp"
#include "unusable.hpp"

#include <gart/bvh/morton.hpp>
#include <gart/math/logit.hpp>
#include <gart/math/sh.hpp>

#include <thread>
#include <utility>

namespace gart::io {

namespace {

// Largest bytes of a model's floats over its file's bytes: a model and a copy take 64 times the file. Then the memory
// that any file may use.
constexpr u64 most_growth = 30, small_model = u64{1} << 20;
constexpr float least_log_scale = -69;  // of a scale of about 1e-30

// The signs of the basis functions under half a turn about an axis. One direction in no plane of symmetry shows them.
std::array<float, 16> signs_of_half_turn(int axis) {
  vec3 d(0.48f, 0.36f, 0.8f);
  sh_basis<3> const before(d);
  for (int k = 0; k < 3; ++k)
    if (k != axis) d[k] = -d[k];
  sh_basis<3> const after(d);
  std::array<float, 16> signs;
  for (std::size_t k = 0; k < signs.size(); ++k) signs[k] = before.y[k] * after.y[k] < 0 ? -1.0f : 1.0f;
  return signs;
}

// The first Gaussian with a number that is not finite, and the array; none: the model's size.
std::pair<std::size_t, char const*> first_not_finite(gaussian_model const& model) {
  std::pair<std::size_t, char const*> first{model.size(), ""};
  for_each_array(
      [&](parameter_array const& a, std::vector<float> const& values) {
        auto const bad = std::find_if(values.begin(), values.end(), [](float v) { return !std::isfinite(v); });
        if (bad == values.end()) return;
        auto const at = static_cast<std::size_t>(bad - values.begin()) / a.width(model.sh_degree);
        if (at < first.first) first = {at, a.title};
      },
      model);
  return first;
}

}  // namespace

u8 opacity_byte(float logit) { return static_cast<u8>(unorm(sigmoid_in_double(static_cast<double>(logit)), 8)); }
float opacity_logit(double opacity) { return static_cast<float>(logit_in_double(std::clamp(opacity, 1e-6, 1 - 1e-6))); }
float opacity_logit(u8 byte) { return opacity_logit(byte / 255.0); }

float base_color(float coefficient) { return static_cast<float>(static_cast<double>(coefficient) * sh_constant + 0.5); }
float base_coefficient(double color) { return static_cast<float>((color - 0.5) / sh_constant); }

std::array<double, 4> unit(float const* q) {
  std::array<double, 4> u;
  double norm = 0;
  for (std::size_t k = 0; k < 4; ++k) u[k] = static_cast<double>(q[k]), norm += u[k] * u[k];
  if (norm == 0) return {1, 0, 0, 0};
  for (double& v : u) v /= std::sqrt(norm);
  return u;
}

int largest_positive(std::array<double, 4>& q) {
  std::size_t largest = 0;
  for (std::size_t k = 1; k < 4; ++k)
    if (std::abs(q[k]) > std::abs(q[largest])) largest = k;
  if (q[largest] < 0)
    for (double& v : q) v = -v;
  return static_cast<int>(largest);
}

std::vector<u32> along_a_curve(gaussian_model const& model) {
  // Strays are outside of the box, and go to its edge.
  std::vector<char> stray(model.size(), 0);
  for (u32 const i : bulk_of(model).strays) stray[i] = 1;
  box bounds = empty_box();
  auto const mean = [&](std::size_t i) {
    return vec3(model.mean[3 * i], model.mean[3 * i + 1], model.mean[3 * i + 2]);
  };
  for (std::size_t i = 0; i < model.size(); ++i)
    for (int k = 0; k < 3 && !stray[i]; ++k) {
      bounds.lo[k] = std::min(bounds.lo[k], mean(i)[k]);
      bounds.hi[k] = std::max(bounds.hi[k], mean(i)[k]);
    }
  std::vector<std::pair<u64, u32>> keys(model.size());
  for (std::size_t i = 0; i < keys.size(); ++i) keys[i] = {morton_code(mean(i), bounds), static_cast<u32>(i)};
  std::sort(keys.begin(), keys.end());
  std::vector<u32> order(keys.size());
  std::transform(keys.begin(), keys.end(), order.begin(), [](auto const& key) { return key.second; });
  return order;
}

void half_turn(gaussian_model& model, int axis) {
  auto const signs = signs_of_half_turn(axis);
  std::size_t const n = model.size(), coefficients = static_cast<std::size_t>(sh_coefficients(model.sh_degree));
  for (std::size_t i = 0; i < n; ++i) {
    // Conjugation by the half turn keeps the part of the quaternion along its axis.
    for (int k = 0; k < 3; ++k) {
      if (k == axis) continue;
      model.mean[3 * i + static_cast<std::size_t>(k)] *= -1;
      model.quaternion[4 * i + 1 + static_cast<std::size_t>(k)] *= -1;
    }
    for (std::size_t k = 1; k < coefficients; ++k)
      for (std::size_t c = 0; c < 3; ++c) model.sh[3 * (coefficients * i + k) + c] *= signs[k];
  }
}

void in_parts(std::size_t n, std::function<void(std::size_t, std::size_t)> const& f) {
  std::size_t const parts = std::clamp<std::size_t>(std::thread::hardware_concurrency(), 1, n / 4096 + 1);
  for_each_parallel(parts, [&](std::size_t i) { f(n * i / parts, n * (i + 1) / parts); });
}

void require_plausible(std::string const& file, u64 gaussians, int sh_degree, u64 bytes) {
  u64 const a_gaussian = sizeof(float) * (11 + 3 * static_cast<u64>(sh_coefficients(sh_degree)));
  if (gaussians > most_gaussians || gaussians * a_gaussian > most_growth * bytes + small_model)
    throw io_error(file,
                   "promises " + std::to_string(gaussians) + " Gaussians, more than its " + std::to_string(bytes) +
                       " bytes can hold",
                   "the file is truncated or damaged: copy or export it again");
}

float settled_opacity(float logit) { return std::isinf(logit) ? opacity_logit(logit > 0 ? 1.0 : 0.0) : logit; }
float settled_scale(float log_scale) { return std::isinf(log_scale) && log_scale < 0 ? least_log_scale : log_scale; }

void settle_rotation(float* q) {
  // Squares of these are what float has no digits or no room for (math/quaternion.hpp).
  constexpr double shortest = 2e-4, longest = 1e18;
  double norm = 0;
  for (int k = 0; k < 4; ++k) norm += static_cast<double>(q[k]) * static_cast<double>(q[k]);
  norm = std::sqrt(norm);
  if (!(norm > 0) || !std::isfinite(norm) || (norm >= shortest && norm <= longest)) return;
  auto const u = unit(q);
  for (std::size_t k = 0; k < 4; ++k) q[k] = static_cast<float>(u[k]);
}

void keep_usable(std::string const& file, gaussian_model& model, std::vector<std::string>* notes) {
  for (float& v : model.opacity) v = settled_opacity(v);
  for (float& v : model.log_scale) v = settled_scale(v);
  for (std::size_t i = 0; i < model.size(); ++i) settle_rotation(&model.quaternion[4 * i]);
  unusable bad;
  for (std::size_t i = 0; i < model.size(); ++i) {
    auto const named = [&] { return "Gaussian " + std::to_string(i) + ", "; };
    for_each_array(
        [&](parameter_array const& a, std::vector<float> const& values) {
          std::size_t const width = a.width(model.sh_degree);
          for (std::size_t c = 0; c < width; ++c)
            if (!std::isfinite(values[i * width + c])) bad.add(i, [&] { return named() + a.title + " is not finite"; });
        },
        model);
    if (no_rotation(&model.quaternion[4 * i]))
      bad.add(i, [&] { return named() + "rotation is all zero, which is no rotation"; });
  }
  if (!bad.records().empty()) model = selected(model, bad.others(model.size(), "Gaussian", file, notes));
}

void require_packable(std::filesystem::path const& path, gaussian_model const& model) {
  auto const [at, array] = first_not_finite(model);
  if (at < model.size())
    throw io_error(path.string(),
                   "Gaussian " + std::to_string(at) + ", " + array + " is not finite and cannot be packed",
                   "remove that Gaussian, or write a .ply");
}

}  // namespace gart::io
