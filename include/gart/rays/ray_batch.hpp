#pragma once
/// \file
/// Rays that no image has: a batch of them, what they see, and the gradients of that. Lidars, secondary rays, queries.
///
/// Rays begin at origins relative to a frame, a point of the world in double. The rays of a view begin relative to its
/// position likewise. So a batch of a view's rays, in the frame of its position, gives the view's numbers, bit for bit.
/// A direction of unit length, to 1e-5, is taken as it stands; another is made one. Distances are in world units along
/// the ray.
///
/// What is a span lies where the call says: in memory of the policy, or in host memory.
/// Errors: invalid_argument for spans whose sizes disagree, by field, and for a ray that is none, by number. Such a ray
/// has a number that is not finite, a direction of no length, or an end before options.near.

#include <gart/channels/hit_lists.hpp>
#include <gart/channels/targets.hpp>
#include <gart/core/error.hpp>
#include <gart/core/span.hpp>
#include <gart/core/types.hpp>
#include <gart/math/glm.hpp>

#include <string>
#include <vector>

namespace gart {

/// R rays.
struct ray_batch {
  vec3d frame{0.0};                   ///< that origins are relative to
  span<float const> origins = {};     ///< [R][3]; empty: all rays begin at the frame
  span<float const> directions = {};  ///< [R][3]
  span<float const> t_max = {};       ///< [R], hits lie at t <= t_max; empty: rays have no end
  span<float const> times = {};       ///< [R], when rays look; read where models move (actors/), else not looked at

  /// R.
  index_t count() const { return static_cast<index_t>(directions.size() / 3); }
};

/// Rays that own their memory, on the host.
struct ray_list {
  vec3d frame{0.0};                               ///< that origins are relative to
  std::vector<float> origins, directions, t_max;  ///< as ray_batch has them
  std::vector<float> times = {};                  ///< the same

  /// While this is.
  ray_batch batch() const { return {frame, origins, directions, t_max, times}; }
};

/// In place of a Gaussian, where a ray has none.
inline constexpr u32 no_gaussian = 0xffffffffu;
/// In place of a distance, where a ray has no such hit.
inline constexpr float no_hit = -1;

/// Where what rays see goes, [R] each, in memory of the policy; null where it is not wanted.
struct batch_targets {
  float* color = nullptr;          ///< [R][3], background composited
  float* transmittance = nullptr;  ///< after the last hit
  float* depth = nullptr;          ///< sum of weight * t
  float* median = nullptr;         ///< t of the hit that brings the transmittance below 0.5; no_hit where none does
  float* first = nullptr;          ///< t of the first hit; no_hit where there is none
  u32* hits = nullptr;             ///< composited
  u32* first_id = nullptr;         ///< Gaussian of the first hit; no_gaussian where there is none
  u32* median_id = nullptr;        ///< of the hit at `median`
  u32* top_id = nullptr;           ///< of the largest weight, the first of equal ones
  channel_targets channels = {};   ///< features
};

/// The same in host memory, each [R].
struct traced_rays {
  std::vector<float> color;                                ///< [R][3]
  std::vector<float> transmittance, depth, median, first;  ///< as batch_targets has them
  std::vector<u32> hits, first_id, median_id, top_id;      ///< as batch_targets has them
  std::vector<float> features = {};                        ///< [R][width], where they are asked for
};

/// dL/d what a batch or a view showed, in memory of the policy; empty where there is no such gradient.
struct output_gradients {
  span<float const> color = {};          ///< [R][3]
  span<float const> depth = {};          ///< [R], of the sum of weight * t
  span<float const> transmittance = {};  ///< [R]
  channel_gradients channels = {};       ///< of features
};

/// dL/d rays, in memory of the policy; null where it is not wanted. A direction's gradient stands across it.
struct ray_gradient_targets {
  float* origins = nullptr;     ///< [R][3]
  float* directions = nullptr;  ///< [R][3]
};

/// How the gradients of Gaussians are summed. Both are the same sums.
enum class gradient_form {
  scatter,    ///< each ray is traced again and adds to its Gaussians, atomically: no memory a hit
  primitive,  ///< hits are written once, sorted by Gaussian and summed there: 44 bytes a hit, the same bits in every
              ///< run
};

/// Throws invalid_argument where the spans of a batch disagree in size.
inline void require_batch(ray_batch const& rays) {
  auto const refuse = [](char const* field, std::size_t size, std::string const& needed) {
    throw invalid_argument(std::string("ray_batch.") + field + " has " + std::to_string(size) + " numbers, and " +
                           needed);
  };
  std::size_t const n = rays.directions.size() / 3;
  if (rays.directions.size() % 3 != 0) refuse("directions", rays.directions.size(), "a ray has three");
  if (n > 0xffffffffu - 64) refuse("directions", rays.directions.size(), "a batch takes 2^32 rays: trace it in parts");
  std::string const of_rays = std::to_string(n) + " directions ask for ";
  if (!rays.origins.empty() && rays.origins.size() != 3 * n)
    refuse("origins", rays.origins.size(), of_rays + std::to_string(3 * n) + ", or none where all begin at the frame");
  if (!rays.t_max.empty() && rays.t_max.size() != n)
    refuse("t_max", rays.t_max.size(), of_rays + std::to_string(n) + ", or none where rays have no end");
  if (!rays.times.empty() && rays.times.size() != n)
    refuse("times", rays.times.size(), of_rays + std::to_string(n) + ", or none where nothing moves");
  for (int k = 0; k < 3; ++k)
    if (!(rays.frame[k] - rays.frame[k] == 0)) throw invalid_argument("ray_batch.frame is not finite");
}

/// The same of gradients of `count` rays or pixels; `what` names the call.
inline void require_gradients(output_gradients const& by, std::size_t count, char const* what) {
  auto const require = [&](char const* field, span<float const> const& values, std::size_t each) {
    if (!values.empty() && values.size() != each * count)
      throw invalid_argument(std::string(what) + ": output_gradients." + field + " has " +
                             std::to_string(values.size()) + " numbers, and there are " + std::to_string(count) +
                             " rays of " + std::to_string(each) +
                             ": give that many, or none where there is no such gradient");
  };
  require("color", by.color, 3);
  require("depth", by.depth, 1);
  require("transmittance", by.transmittance, 1);
}

}  // namespace gart
