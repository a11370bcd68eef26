#pragma once
/// \file
/// The channels of a renderer's views (channels/): its Gaussians' values, and the passes over a view's hits. These
/// passes follow those of its colours.

#include <gart/channels/passes.hpp>
#include <gart/channels/pixel_hits.hpp>
#include <gart/rays/ray_batch.hpp>

namespace gart { inline namespace GART_ISA {

/// The data that a view keeps of its hits.
template <execution E>
struct view_hits {
  /// None yet.
  explicit view_hits(E& exec) : counts(exec), table(exec) {}
  buffer<u32, E> counts;       ///< [H][W]
  hit_table<E> table;          ///< a ray a pixel, row-major
  bool is_listed = false;      ///< they are those of the view
  gaussian_channels channels;  ///< that could be shown

  /// Views whose hits are counted as they are rendered, to what this returns.
  u32* count(E& exec, std::size_t pixels) {
    counts.resize(pixels);
    exec.zero(counts.data(), pixels * sizeof(u32));
    return counts.data();
  }
  /// Lists them, where they are not.
  template <class Frame>
  void list(Frame& frame, bool differentiable, bool counted) {
    if (!is_listed) list_hits(frame, table, differentiable, counted ? span<u32 const>(counts) : span<u32 const>());
    is_listed = true;
  }
};

/// Of one renderer.
template <execution E, class Response>
class view_channels {
 public:
  /// Allocates nothing; `exec` must outlive it.
  explicit view_channels(E& exec) : exec_(&exec), features_(exec), hits_(exec), back_(exec) {}

  /// Those that the model has on the host, copied.
  void set_model(gaussian_model const& model) {
    features_.assign(model.features);
    now_ = {{features_.data(), static_cast<index_t>(model.size()), model.feature_count}};
  }
  /// Those that somebody else owns, of so many Gaussians.
  void bind(gaussian_channels const& channels, index_t gaussians) {
    require_channels(channels, gaussians, "renderer.bind_channels");
    now_ = channels;
  }
  /// The values of the Gaussians.
  gaussian_channels const& now() const { return now_; }

  /// Shows them of a frame that is prepared; counted: by hits().count() of this view.
  template <class Frame>
  void show(Frame& frame, channel_targets const& out, bool counted) {
    hits_.is_listed = false;
    hits_.list(frame, false, counted);
    sum_channels(*exec_, hits_.table, now_, out);
  }
  /// Of the view that is shown without a context.
  view_hits<E>& hits() { return hits_; }

  /// Adds the channels' part to the moments of the Gaussians. Where the colours' pass left out depth and transmittance,
  /// adds these too.
  template <class Frame>
  void add_moments(Frame& frame, view_hits<E>& hits, output_gradients const& by, span<float> moments) {
    bool const channels = by.channels.any() && !by.channels.detached;
    if (!channels && by.depth.empty() && by.transmittance.empty()) return;
    hits.list(frame, true, false);
    back_.begin(hits.table);
    if (channels) weigh_channels(back_, hits.channels, by.channels);
    if (!by.depth.empty()) back_.add(depth_channel{{}, by.depth.data()});
    if (!by.transmittance.empty()) back_.add(transmittance_channel{{}, by.transmittance.data()});
    back_.add_moments(hits.table, frame.gaussians(), moments);
  }
  /// dL/d what the Gaussians have.
  template <class Frame>
  void pull(Frame& frame, view_hits<E>& hits, channel_gradients const& by, channel_gradient_targets const& to) {
    if (!to.any()) return;
    hits.list(frame, true, false);
    pull_channels(*exec_, back_, hits.table, hits.channels, by, to);
  }

 private:
  E* exec_;
  buffer<float, E> features_;
  gaussian_channels now_;
  view_hits<E> hits_;
  channel_gradient<E, Response> back_;
};

}}  // namespace gart::GART_ISA
