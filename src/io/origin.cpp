#include "bulk.hpp"
#include "bytes.hpp"

#include <gart/core/error.hpp>
#include <gart/io/origin.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace gart {

namespace {

constexpr double farthest = 64;  // spreads from zero, where a float's step is 8e-6 of one at the most
constexpr char key[] = "origin";

using io::quantile;

// What most of the places keep from the middle, along the axis that is worst; place(i) for i < n.
template <class F>
double spread_around(vec3d const& middle, std::size_t n, F const& place) {
  std::vector<double> distance(n);
  for (std::size_t i = 0; i < n; ++i) {
    vec3d const d = glm::abs(place(i) - middle);
    distance[i] = std::max({d.x, d.y, d.z});
  }
  return n ? quantile(distance, io::most_of_all) : 0;
}

}  // namespace

vec3d origin_for(std::vector<vec3d> const& places, std::vector<double> const& others) {
  vec3d middle(0.0);
  std::size_t const n = places.size();
  if (n == 0) return middle;
  std::vector<double> values(n);
  for (int k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < n; ++i) values[i] = places[i][k];
    middle[k] = quantile(values, 0.5);
  }
  double spread = spread_around(middle, n, [&](std::size_t i) { return places[i]; });
  auto const other = [&](std::size_t i) { return vec3d(others[3 * i], others[3 * i + 1], others[3 * i + 2]); };
  if (!(spread > 0)) spread = spread_around(middle, others.size() / 3, other);
  if (!(spread > 0)) spread = 1;
  if (std::max({std::abs(middle.x), std::abs(middle.y), std::abs(middle.z)}) <= farthest * spread) return vec3d(0.0);
  // A round number is short in files. Past 2^53 steps there is none to round to.
  double const step = std::pow(10.0, std::floor(std::log10(spread)));
  for (int k = 0; k < 3; ++k) {
    double const rounded = std::round(middle[k] / step) * step;
    if (std::abs(rounded - middle[k]) <= step) middle[k] = rounded;
  }
  return middle + vec3d(0.0);  // no -0
}

std::string to_text(vec3d const& origin) {
  std::string text;
  for (int k = 0; k < 3; ++k) {
    std::array<char, 400> digits;
    auto const [end, code] =
        std::to_chars(digits.data(), digits.data() + digits.size(), origin[k], std::chars_format::fixed);
    text += (k ? "," : "") + std::string(digits.data(), code == std::errc() ? end : digits.data());
  }
  return text;
}

vec3d origin_of(splat_traits const& traits, std::string const& file) {
  auto const found = traits.find(key);
  if (found == traits.end()) return vec3d(0.0);
  vec3d origin(0.0);
  std::string_view rest = found->second;
  for (int k = 0; k < 3; ++k) {
    std::string_view const word = rest.substr(0, k < 2 ? rest.find(',') : rest.npos);
    if (!io::parse_number(word, origin[k]) || !(std::abs(origin[k]) <= 1e18))
      throw io_error(file, "the trait origin is '" + found->second.substr(0, 80) + "'",
                     "three numbers belong there, as 500000,4000000,100; remove it for zero");
    rest.remove_prefix(std::min(word.size() + 1, rest.size()));
  }
  return origin;
}

splat_traits with_origin(splat_traits traits, vec3d const& origin) {
  if (origin == vec3d(0.0))
    traits.erase(key);
  else
    traits[key] = to_text(origin);
  return traits;
}

void move_origin(gaussian_model& model, vec3d const& from, vec3d const& to) {
  if (from == to) return;
  vec3d const by = from - to;
  for (std::size_t i = 0; i < model.mean.size(); ++i)
    model.mean[i] = static_cast<float>(static_cast<double>(model.mean[i]) + by[static_cast<int>(i % 3)]);
}

}  // namespace gart
