#include "depth_search.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

namespace gart::matching {

namespace {

// Of the other photographs by distance: near ones look alike, far ones tell depth.
constexpr std::array<std::size_t, most_sources> ranks{1, 2, 4, 7, 12};
constexpr float same_way = 0.6f;         // cosine between the axes of two cameras, at least
constexpr float least_baseline = 1e-3f;  // of the scene's extent
constexpr float nearest = 0.05f;         // depth, of the scene's extent
constexpr float farthest_shift = 0.6f;   // of the image's width, in the second photograph
constexpr int fewest_depths = 32, most_depths = 256;
constexpr int finer = 8;  // steps within a step
constexpr int side = 2 * patch_radius + 1, patch_pixels = side * side;
constexpr float least_contrast = 3;     // standard deviation of a patch's levels
constexpr float least_likeness = 0.8f;  // mean correlation of those that agree
constexpr float least_alone = 0.7f;     // of each of them
constexpr float least_margin = 0.03f;   // over all other depths
constexpr int same_depth = 3;           // steps from the best that are no other depth
constexpr float least_angle = 0.02f;    // radians, of the rays that meet in the point
constexpr float unseen = -1;

float length_of(vec3 const& v) { return std::sqrt(glm::dot(v, v)); }

}  // namespace

// Levels with mean 0 and norm 1, and the slopes of the middle and of the pixels beside and below it.
struct depth_search::patch {
  std::array<float, patch_pixels> level;
  std::array<vec3, 3> slopes;
};

depth_search::depth_search(std::vector<photograph> const& all, u32 of, float extent) : of_(all[of]) {
  if (of_.empty()) return;
  std::vector<std::pair<double, u32>> near;
  for (u32 i = 0; i < all.size(); ++i) {
    vec3d const apart = all[i].position - of_.position;
    double const distance2 = glm::dot(apart, apart), least = double{least_baseline} * extent;
    if (i != of && !all[i].empty() && distance2 > least * least &&
        glm::dot(all[i].rotation[2], of_.rotation[2]) > same_way)
      near.push_back({distance2, i});
  }
  std::sort(near.begin(), near.end());
  for (std::size_t const rank : ranks) {
    if (rank > near.size()) break;
    auto const [distance2, number] = near[rank - 1];
    photograph const& photo = all[number];
    mat3 const to_own = glm::transpose(photo.rotation);
    sources_[count_++] = {&photo, to_own * of_.rotation, to_own * vec3(of_.position - photo.position),
                          static_cast<float>(std::sqrt(distance2))};
  }
  if (count_ < least_agreeing) {
    count_ = 0;
    return;
  }
  float const least_depth =
      std::max(of_.fx * sources_[1].baseline / (farthest_shift * static_cast<float>(of_.width)), nearest * extent);
  float const shift = of_.fx * sources_[count_ / 2].baseline / least_depth;  // pixels, in the middle one of them
  depths_ = std::clamp(static_cast<int>(shift), fewest_depths, most_depths);
  step_ = 1 / (least_depth * static_cast<float>(depths_));
}

std::optional<depth_search::patch> depth_search::patch_at(int x, int y) const {
  patch out;
  float sum = 0, sum2 = 0;
  std::size_t k = 0;
  for (int j = y - patch_radius; j <= y + patch_radius; ++j) {
    for (int i = x - patch_radius; i <= x + patch_radius; ++i) {
      float const level = of_.at(i, j);
      if (level == 0) return {};
      out.level[k++] = level, sum += level, sum2 += level * level;
    }
  }
  float const mean = sum / patch_pixels, squares = sum2 - sum * mean;
  if (squares < patch_pixels * least_contrast * least_contrast) return {};
  float const scale = 1 / std::sqrt(squares);
  for (float& level : out.level) level = (level - mean) * scale;
  float const u = static_cast<float>(x) + 0.5f, v = static_cast<float>(y) + 0.5f;
  out.slopes = {of_.slopes(u, v), of_.slopes(u + 1, v), of_.slopes(u, v + 1)};
  return out;
}

depth_search::likenesses depth_search::compare(patch const& p, float inverse_depth) const {
  likenesses all;
  for (std::size_t s = 0; s < count_; ++s) {
    photograph const& photo = *sources_[s].photo;
    all[s] = unseen;
    // The patch faces the camera, so it is a parallelogram here.
    point2 at[3];
    bool before = true;
    for (std::size_t k = 0; k < 3; ++k) {
      vec3 const c = sources_[s].point(p.slopes[k], inverse_depth);
      before = before && c.z > 1e-3f;
      at[k] = {photo.fx * c.x / c.z + photo.cx - 0.5f, photo.fy * c.y / c.z + photo.cy - 0.5f};
    }
    if (!before) continue;
    point2 const across{at[1].x - at[0].x, at[1].y - at[0].y}, down{at[2].x - at[0].x, at[2].y - at[0].y};
    float const area = std::fabs(across.x * down.y - across.y * down.x);
    if (!(area > 0.1f && area < 10)) continue;  // far larger or smaller: not comparable
    float const reach_x = patch_radius * (std::fabs(across.x) + std::fabs(down.x));
    float const reach_y = patch_radius * (std::fabs(across.y) + std::fabs(down.y));
    constexpr float rounding = 1e-3f;  // the sums below are rounded otherwise than these
    if (!(at[0].x >= reach_x + rounding && at[0].y >= reach_y + rounding &&
          at[0].x + reach_x < static_cast<float>(photo.width - 1) - rounding &&
          at[0].y + reach_y < static_cast<float>(photo.height - 1) - rounding))
      continue;
    float sum = 0, sum2 = 0, product = 0;
    bool known = true;
    std::size_t k = 0;
    for (int j = -patch_radius; j <= patch_radius; ++j) {
      for (int i = -patch_radius; i <= patch_radius; ++i) {
        float const x = at[0].x + static_cast<float>(i) * across.x + static_cast<float>(j) * down.x;
        float const y = at[0].y + static_cast<float>(i) * across.y + static_cast<float>(j) * down.y;
        int const column = static_cast<int>(x), row = static_cast<int>(y);
        float const a = x - static_cast<float>(column), b = y - static_cast<float>(row);
        u8 const* const upper =
            &photo.level[static_cast<std::size_t>(row) * static_cast<std::size_t>(photo.width) + column];
        u8 const* const lower = upper + photo.width;
        known = known && upper[0] != 0;
        float const above = static_cast<float>(upper[0]) + a * static_cast<float>(upper[1] - upper[0]);
        float const below = static_cast<float>(lower[0]) + a * static_cast<float>(lower[1] - lower[0]);
        float const level = above + b * (below - above);
        sum += level, sum2 += level * level, product += level * p.level[k++];
      }
    }
    float const squares = sum2 - sum * sum / patch_pixels;
    if (known && squares >= patch_pixels) all[s] = product / std::sqrt(squares);
  }
  return all;
}

// The mean of those that agree most.
float depth_search::agreement(likenesses all) const {
  std::partial_sort(all.begin(), all.begin() + least_agreeing, all.begin() + count_, std::greater<>());
  float sum = 0;
  for (std::size_t s = 0; s < least_agreeing; ++s) {
    if (all[s] == unseen) return unseen;
    sum += all[s];
  }
  return sum / least_agreeing;
}

// Its sine, of the pixel's ray with those of the photographs that agree.
float depth_search::widest_angle(patch const& p, likenesses const& all, float inverse_depth) const {
  float widest = 0;
  for (std::size_t s = 0; s < count_; ++s) {
    if (all[s] < least_alone) continue;
    vec3 const along = sources_[s].turn * p.slopes[0], own = sources_[s].point(p.slopes[0], inverse_depth);
    widest = std::max(widest, length_of(glm::cross(along, own)) / (length_of(along) * length_of(own)));
  }
  return widest;
}

std::optional<float> depth_search::find(int x, int y) const {
  if (count_ == 0) return {};
  auto const p = patch_at(x, y);
  if (!p) return {};
  std::array<float, most_depths + 1> by_depth{};
  int best = 0;
  for (int k = 0; k <= depths_; ++k) {
    by_depth[k] = agreement(compare(*p, static_cast<float>(k) * step_));
    if (by_depth[k] > by_depth[best]) best = k;
  }
  float inverse_depth = static_cast<float>(best) * step_, most = by_depth[best];
  if (most < least_alone) return {};
  for (int k = 1 - finer; k < finer; ++k) {
    float const at = (static_cast<float>(best) + static_cast<float>(k) / finer) * step_;
    float const agreed = at > 0 ? agreement(compare(*p, at)) : unseen;
    if (agreed > most) most = agreed, inverse_depth = at;
  }
  if (most < least_likeness || !(inverse_depth > 0)) return {};
  for (int k = 0; k <= depths_; ++k)
    if (std::abs(k - best) > same_depth && by_depth[k] > most - least_margin) return {};
  likenesses const all = compare(*p, inverse_depth);
  if (widest_angle(*p, all, inverse_depth) < least_angle) return {};
  return inverse_depth;
}

}  // namespace gart::matching
