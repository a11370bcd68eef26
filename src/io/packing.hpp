#pragma once
// Shared by the formats that pack Gaussians: numbers as bytes, a spatial order, other axes, threads.

#include <gart/core/error.hpp>
#include <gart/scene/gaussians.hpp>
#include <gart/scene/select.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace gart::io {

// The nearest of the integers 0 to 2^bits - 1 to x in [0, 1].
inline u32 unorm(double x, int bits) {
  double const most = static_cast<double>((1u << bits) - 1);
  return static_cast<u32>(std::clamp(x, 0.0, 1.0) * most + 0.5);
}

// A number from `low` to `high` as one of `bits` bits, and back. Where both are one there is nothing to say.
inline u32 between(float x, float low, float high, int bits) {
  return high > low ? unorm((static_cast<double>(x) - static_cast<double>(low)) /
                                (static_cast<double>(high) - static_cast<double>(low)),
                            bits)
                    : 0;
}
inline float from_between(u32 n, float low, float high, int bits) {
  double const t = static_cast<double>(n) / static_cast<double>((1u << bits) - 1);
  return static_cast<float>(static_cast<double>(low) * (1 - t) + static_cast<double>(high) * t);
}

u8 opacity_byte(float logit);
// Nothing and all are as far from their neighbours as a millionth: a logit is finite.
float opacity_logit(u8 byte);
float opacity_logit(double opacity);

// The colour of the coefficient of degree 0, and back.
float base_color(float coefficient);
float base_coefficient(double color);

inline bool no_rotation(float const* q) { return q[0] == 0 && q[1] == 0 && q[2] == 0 && q[3] == 0; }

// The quaternion at q (w, x, y, z) divided by its norm, in double.
std::array<double, 4> unit(float const* q);

// The largest component by magnitude of four, made positive by the sign of all.
int largest_positive(std::array<double, 4>& q);

// The Gaussians by their place on a curve through space: neighbours stand together, and so do like values.
std::vector<u32> along_a_curve(gaussian_model const& model);

// Turned by half a turn about an axis (0, 1, 2: x, y, z), with the colours that depend on direction. Applied twice it
// changes nothing; every number keeps its bits, to signs.
void half_turn(gaussian_model& model, int axis);

// f(first, last) over parts of [0, n) on as many threads as there are, f free of shared writes.
void in_parts(std::size_t n, std::function<void(std::size_t, std::size_t)> const& f);

// Refuses a count of Gaussians that would take many times the file's bytes, before allocating. The densest format takes
// a twentieth.
void require_plausible(std::string const& file, u64 gaussians, int sh_degree, u64 bytes);
// Replaces infinite logits of opacities, and infinite negative logarithms of scales, by finite ones.
float settled_opacity(float logit);
float settled_scale(float log_scale);
// A quaternion too short, or too long, to be drawn: the same rotation, of length 1. Others keep their bits.
void settle_rotation(float* q);
// Does so for all Gaussians. Leaves out those with other numbers that are not finite, or with zero rotations.
void keep_usable(std::string const& file, gaussian_model& model, std::vector<std::string>* notes);
// Refuses to write numbers that are not finite: packed they would be others.
void require_packable(std::filesystem::path const& path, gaussian_model const& model);

}  // namespace gart::io
