#pragma once
/// \file
/// What Gaussians, views and batches of rays have of each channel besides colour and depth. Each has a line a channel;
/// so have its checks. Memory is the policy's. Errors: invalid_argument naming the member whose size disagrees, and
/// what was asked for without being there.

#include <gart/core/span.hpp>
#include <gart/scene/features.hpp>

#include <string>

namespace gart {

/// What Gaussians have of them.
struct gaussian_channels {
  feature_view<float const> features = {};  ///< of all Gaussians; none where its width is 0
};

/// Where what R rays or pixels sum goes; null where it is not wanted.
struct channel_targets {
  float* features = nullptr;  ///< [R][width]: sum of weight * features

  /// Whether anything is wanted.
  bool any() const { return features; }
};

/// dL/d these; empty where there is no such gradient.
struct channel_gradients {
  span<float const> features = {};  ///< [R][width]
  /// Features then have gradients, and through them neither Gaussians nor rays: no hit is weighed.
  bool detached = false;

  /// Whether there is any.
  bool any() const { return !features.empty(); }
};

/// Where dL/d what Gaussians have goes, overwritten.
struct channel_gradient_targets {
  feature_view<float> features = {};  ///< as the features; null where it is not wanted

  /// Whether anything is wanted.
  bool any() const { return features.values; }
};

/// Throws invalid_argument where channels are not of so many Gaussians. `call` names who asks.
inline void require_channels(gaussian_channels const& channels, std::size_t gaussians, std::string const& call) {
  require_features(channels.features, gaussians, call);
}
/// The same where what is to be shown is not there.
inline void require_channels(gaussian_channels const& channels, channel_targets const& out, std::string const& call) {
  if (out.features && channels.features.width == 0)
    throw invalid_argument(call +
                           ": channel_targets.features is set, and the Gaussians have no features: bind them first");
}
/// The same of gradients, of so many rays or pixels.
inline void require_channels(gaussian_channels const& channels, channel_gradients const& by,
                             channel_gradient_targets const& to, std::size_t rays, std::string const& call) {
  feature_view<float const> const& f = channels.features;
  std::size_t const needed = rays * static_cast<std::size_t>(f.width);
  if ((!by.features.empty() || to.features.values) && f.width == 0)
    throw invalid_argument(call +
                           ": there are gradients of features, and the Gaussians have none: bind them before forward");
  if (!by.features.empty() && by.features.size() != needed)
    throw invalid_argument(call + ": channel_gradients.features has " + std::to_string(by.features.size()) +
                           " numbers, and " + std::to_string(rays) + " rays of " + std::to_string(f.width) +
                           " features ask for " + std::to_string(needed));
  if (!to.features.values) return;
  if (to.features.count != f.count || to.features.width != f.width)
    throw invalid_argument(call + ": channel_gradient_targets.features is of " + std::to_string(to.features.count) +
                           " Gaussians and " + std::to_string(to.features.width) + " features, and what was shown of " +
                           std::to_string(f.count) + " and " + std::to_string(f.width) + ": give that");
}

}  // namespace gart
