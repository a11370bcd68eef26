#pragma once
/// \file
/// A view as a context keeps it: its frame, its pass, its images and its hits.

#include <gart/backward/backward.hpp>
#include <gart/render/bytes.hpp>
#include <gart/runtime/renderer.hpp>
#include <gart/runtime/view_channels.hpp>

namespace gart { inline namespace GART_ISA {

/// Frame, Pass: of a configuration.
template <class Frame, class Pass>
struct shown_view {
  using E = typename Frame::execution_type;                          ///< the policy
  using channels_type = view_channels<E, typename Frame::response>;  ///< of the renderer

  /// Allocates nothing; `exec` must outlive it.
  explicit shown_view(E& exec)
      : frame(exec),
        pass(exec),
        color(exec),
        transmittance(exec),
        depth(exec),
        gradients(exec, 0, Frame::sh_degree),
        hits(exec) {}

  Frame frame;                                   ///< prepared
  Pass pass;                                     ///< rendered
  buffer<float, E> color, transmittance, depth;  ///< [H][W] pixels
  gaussians<E> gradients;                        ///< where the caller has none
  view_hits<E> hits;                             ///< where channels are of them

  /// Pixels of the view.
  index_t pixels() const {
    return static_cast<index_t>(frame.view().width) * static_cast<index_t>(frame.view().height);
  }
  /// The forward pass, once the frame is prepared.
  void render(render_targets const& targets, gaussian_channels const& channels) {
    E& exec = frame.exec();
    if (!pass.prepare(frame)) throw pass.out_of_memory_error();
    index_t const n = pixels();
    color.resize(std::size_t{3} * n), transmittance.resize(n), depth.resize(n);
    bool const more = targets.channels.any();
    u32* const counts = more ? hits.count(exec, n) : targets.hits;
    hits.is_listed = false, hits.channels = channels;
    pass.render(frame,
                {.color = color.data(), .transmittance = transmittance.data(), .depth = depth.data(), .hits = counts});
    auto const copy = [&](auto* to, auto const* from, std::size_t numbers) {
      if (to && to != from) exec.copy(to, from, numbers * sizeof *to);
    };
    copy(targets.color, color.data(), color.size());
    copy(targets.transmittance, transmittance.data(), n), copy(targets.depth, depth.data(), n);
    copy(targets.hits, counts, n);
    if (targets.rgba) color_to_bytes(exec, color.data(), n, targets.rgba, 4);
    if (!more) return;
    hits.list(frame, true, true);
    sum_channels(exec, hits.table, channels, targets.channels);
  }
  /// The backward pass, to gradients in rows of the frame's degree, overwritten; by.color is there.
  void differentiate(output_gradients by, gaussians_view<float> rows, channels_type& channels) {
    image_gradients image{by.color};
    if constexpr (Pass::of_depth)
      image.depth = std::exchange(by.depth, {}), image.transmittance = std::exchange(by.transmittance, {});
    sum_gradients(frame, pass, image, rows);
    channels.add_moments(frame, hits, by, pass.moments());
    finish_gradients(frame.exec(), frame.scene(), frame.gaussians(), frame.view(), frame.options().antialias,
                     pass.moments(), rows);
  }
};

}}  // namespace gart::GART_ISA
