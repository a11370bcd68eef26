#pragma once
// The search for the depth of a photograph's pixels in a few other photographs.

#include "photograph.hpp"

#include <array>

namespace gart::matching {

constexpr int patch_radius = 3;  // pixels of a patch from its middle
constexpr int most_sources = 5, least_agreeing = 3;

class depth_search {
 public:
  // For pixels of all[of]. `extent`: of the scene (dataset::extent).
  depth_search(std::vector<photograph> const& all, u32 of, float extent);

  // The inverse depth; none where photographs do not agree on one.
  std::optional<float> find(int x, int y) const;

 private:
  // Another photograph: where it sees the points of a pixel's line.
  struct source {
    photograph const* photo = nullptr;
    mat3 turn{1.0f};   // from the pixel's axes to its own
    vec3 shift{0.0f};  // for an inverse depth of 1
    float baseline = 0;
    vec3 point(vec3 const& slopes, float inverse_depth) const { return turn * slopes + shift * inverse_depth; }
  };
  struct patch;
  using likenesses = std::array<float, most_sources>;

  std::optional<patch> patch_at(int x, int y) const;
  likenesses compare(patch const& p, float inverse_depth) const;
  float agreement(likenesses all) const;
  float widest_angle(patch const& p, likenesses const& all, float inverse_depth) const;

  photograph const& of_;
  std::array<source, most_sources> sources_;
  std::size_t count_ = 0;
  int depths_ = 0;  // even steps of inverse depth
  float step_ = 0;
};

}  // namespace gart::matching
