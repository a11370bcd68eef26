#include "test_split.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace gart::io {

namespace {

// Where each camera stands around the mean of all, as the angle to the first. The axis is the mean of their upward
// axes.
std::vector<double> angles_around(std::vector<frame> const& frames) {
  vec3d middle(0.0), up(0.0);
  for (frame const& f : frames) {
    middle += f.view.position / static_cast<double>(frames.size());
    up -= vec3d(f.view.rotation[1]);
  }
  auto const across = [&](vec3d const& v) {
    return glm::dot(up, up) > 0 ? v - up * (glm::dot(v, up) / glm::dot(up, up)) : v;
  };
  vec3d const first = across(frames.front().view.position - middle);
  std::vector<double> angles;
  for (frame const& f : frames) {
    vec3d const at = across(f.view.position - middle);
    angles.push_back(std::atan2(glm::length(glm::cross(first, at)), glm::dot(first, at)));
  }
  return angles;
}

// The cameras on both sides of the first by name: training sees this part of the scene from elsewhere alone.
std::string split_sector(std::vector<frame>& frames, int test_every) {
  std::vector<double> const angle = angles_around(frames);
  std::vector<std::size_t> order(frames.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return angle[a] < angle[b]; });
  std::size_t const count =
      (frames.size() + static_cast<std::size_t>(test_every) - 1) / static_cast<std::size_t>(test_every);
  for (std::size_t i = 0; i < order.size(); ++i) frames[order[i]].role = i < count ? part::test : part::train;
  return "test = a sector, the " + std::to_string(count) + " cameras around the first by name";
}

}  // namespace

std::string assign_roles(capture& c, dataset_options const& options) {
  if (!c.own_split.empty()) return c.own_split;
  int const test_every = options.test_every;
  std::stable_sort(c.frames.begin(), c.frames.end(), [](frame const& a, frame const& b) { return a.name < b.name; });
  if (test_every > 0 && options.test_split == split_kind::sector && !c.frames.empty())
    return split_sector(c.frames, test_every);
  for (std::size_t i = 0; i < c.frames.size(); ++i) {
    bool const test = test_every > 0 && i % static_cast<std::size_t>(test_every) == 0;
    c.frames[i].role = test ? part::test : part::train;
  }
  if (test_every == 0) return "no test views";
  std::string const nth = std::to_string(test_every);
  return "test = every " + nth +
         (test_every == 1   ? "st"
          : test_every == 2 ? "nd"
          : test_every == 3 ? "rd"
                            : "th") +
         " by name (index % " + nth + " == 0)" + (c.format == "COLMAP" ? "" : "; the files name no split");
}

}  // namespace gart::io
