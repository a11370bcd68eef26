#pragma once
// How closely a picture, a list of hits and gradients of the library agree with the oracle's.

#include <oracle/oracle.hpp>
#include <oracle/scenes.hpp>
#include <support/policies.hpp>
#include <support/relative_error.hpp>
#include <support/scene_by_kind.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <vector>

namespace gart_test {

inline double const image_tolerance = 1e-5;

// In units of the tolerance, what a pixel may be off by that rounding alone moves by this: an undecided hit or order,
// or an ill-conditioned one.
inline double allowed(double rounding) { return rounding > image_tolerance ? 1 + 2 * rounding / image_tolerance : 1; }

// The largest errors of a picture, over what rounding explains: every pixel is checked, and beyond the tolerance by no
// more than rounding allows, in few pixels only (aside).
struct image_errors {
  double color = 0, transmittance = 0, depth = 0;
  std::size_t aside = 0;
};

template <class E>
image_errors image_error(traced<E> const& got, oracle::picture const& picture) {
  std::size_t const pixels = picture.pixels.size();
  REQUIRE(got.color.size() == 3 * pixels);
  REQUIRE(got.transmittance.size() == pixels);
  REQUIRE(got.depth.size() == pixels);
  REQUIRE(got.hits.size() == pixels);

  image_errors error;
  for (std::size_t i = 0; i < pixels; ++i) {
    auto const& p = picture.pixels[i];
    double difference = 0;
    for (int c = 0; c < 3; ++c) {
      REQUIRE(std::isfinite(got.color[3 * i + c]));
      difference = std::max(difference, std::abs(got.color[3 * i + c] - p.color[c]));
    }
    error.aside += difference > image_tolerance;
    error.color = std::max(error.color, difference / allowed(p.rounding));
    if (p.edge) continue;

    double farthest = 1;
    for (auto const& h : p.list) farthest = std::max(farthest, std::abs(h.t) + h.t_slack / image_tolerance);
    // A hit of the colour behind it hardly shows in the colour, whatever its alpha: T has its own rounding.
    error.transmittance = std::max(
        error.transmittance, std::abs(got.transmittance[i] - p.transmittance) / allowed(p.transmittance_rounding));
    error.depth = std::max(error.depth, std::abs(got.depth[i] - p.depth) / (farthest * allowed(p.rounding)));
    REQUIRE(got.hits[i] == p.hits);
  }
  return error;
}

// Every hit that rounding cannot undo is there, nothing that rounding cannot make, t and alpha within rounding, and in
// an order that rounding can give. Returns what is wrong, or nothing; `differs` says that the list is not the oracle's.
inline std::string complaint(std::vector<gart::hit> const& got, oracle::pixel const& p, bool& differs) {
  std::map<gart::u32, oracle::hit const*> listed;
  std::size_t sure = 0;
  std::vector<gart::u32> ids;
  for (auto const& h : p.list) {
    listed[h.id] = &h, sure += h.counted && !h.marginal;
    if (h.counted) ids.push_back(h.id);
  }
  differs = !std::equal(got.begin(), got.end(), ids.begin(), ids.end(),
                        [](auto const& h, gart::u32 id) { return h.id == id; });

  oracle::hit const* farthest = nullptr;  // by t - t_slack
  for (std::size_t i = 0; i < got.size(); ++i) {
    auto const& h = got[i];
    auto const found = listed.find(h.id);
    std::string const who = "hit " + std::to_string(i) + ", Gaussian " + std::to_string(h.id) + ": ";
    if (found == listed.end()) return who + "is no hit, or was reported twice";
    oracle::hit const& o = *found->second;
    listed.erase(found);
    sure -= o.counted && !o.marginal;
    if (!(std::abs(h.t - o.t) <= o.t_slack + 1e-6 * std::abs(o.t)))
      return who + "t is " + std::to_string(h.t) + ", not " + std::to_string(o.t);
    if (!(std::abs(h.alpha - o.alpha) <= (1e-5 + 2 * o.alpha_slack) * o.alpha))
      return who + "alpha is " + std::to_string(h.alpha) + ", not " + std::to_string(o.alpha);
    if (i && !gart::before(got[i - 1].t, got[i - 1].id, h.t, h.id)) return who + "out of order by its own (t, id)";
    if (farthest && farthest->t - farthest->t_slack > o.t + o.t_slack + 1e-6 * std::abs(o.t)) return who + "too late";
    if (farthest && farthest->t == o.t && farthest->id > o.id) return who + "a tie not ordered by id";
    if (!farthest || o.t - o.t_slack >= farthest->t - farthest->t_slack) farthest = &o;
  }
  return sure ? std::to_string(sure) + " hits are missing" : "";
}

struct gradient_group {
  std::string name;
  std::vector<float> gart::gaussian_model::*got;
  std::vector<double> oracle::parameters::*expected;
};
inline gradient_group const gradient_groups[] = {
    {"mean", &gart::gaussian_model::mean, &oracle::parameters::mean},
    {"log_scale", &gart::gaussian_model::log_scale, &oracle::parameters::log_scale},
    {"quaternion", &gart::gaussian_model::quaternion, &oracle::parameters::quaternion},
    {"opacity", &gart::gaussian_model::opacity, &oracle::parameters::opacity},
    {"sh", &gart::gaussian_model::sh, &oracle::parameters::sh}};

// What the undecided orders of a pixel's hits may do to its gradient, where it is compared. One swap does all of it or
// nothing, and one pixel may carry much of a group: no more than gradients may be off by. Among hundreds of hits it is
// a sum over as many swaps that may be, of which few are.
inline double order_tolerance(oracle::pixel const& p) { return p.list.size() < 200 ? 1e-4 : 1e-3; }

// A random linear function of the image, and its gradient by the oracle. Zero where rounding may take another branch:
// there the gradient of either side is right.
struct weighted_image {
  std::vector<float> color_gradient;
  oracle::parameters gradients;
  std::size_t aside = 0;
};

inline weighted_image weighted(oracle::scene const& s, oracle::parameters const& p, oracle::picture const& picture,
                               std::mt19937_64& engine) {
  std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
  weighted_image w;
  for (auto const& pixel : picture.pixels) {
    bool const aside = pixel.edge || pixel.kink || pixel.slope_rounding > order_tolerance(pixel);
    w.aside += aside;
    for (int c = 0; c < 3; ++c) w.color_gradient.push_back(aside ? 0.0f : uniform(engine));
  }
  w.gradients =
      oracle::gradients(p, s.view, s.options, s.active_degree, {w.color_gradient.begin(), w.color_gradient.end()});
  return w;
}

}  // namespace gart_test
