#pragma once
/// \file
/// What options ask a training to learn besides the Gaussians. A new part is a header and a line here.

#include <gart/train/learned/depth.hpp>
#include <gart/train/learned/exposure.hpp>
#include <gart/train/learned/lenses.hpp>
#include <gart/train/learned/mirrors.hpp>
#include <gart/train/learned/poses.hpp>
#include <gart/train/learned/vignetting.hpp>

#include <memory>

namespace gart { inline namespace GART_ISA {

/// The parts of a run.
template <class Frame>
using learned_parts = std::vector<std::unique_ptr<learned_part<Frame>>>;

/// In the order in which they see an image. Depth: whether the method has depth gradients; spread: whether several
/// ranks share the Gaussians.
template <class Frame, bool Depth>
learned_parts<Frame> make_learned_parts(typename Frame::execution_type& exec, train_options const& options,
                                        dataset const& data, bool spread) {
  learned_parts<Frame> all;
  require_depth<Depth>(options, data);
  if (options.refine_poses) all.push_back(std::make_unique<learned_poses<Frame>>(exec, options, data, spread));
  if (options.refine_lens) all.push_back(std::make_unique<learned_lenses<Frame>>(exec, options, data));
  if (!data.mirrors.meshes.empty()) all.push_back(std::make_unique<learned_mirrors<Frame>>(exec, data, spread));
  if constexpr (Depth) all.push_back(std::make_unique<learned_depth<Frame>>(exec, data, options.depth_weight));
  if (options.vignetting) all.push_back(std::make_unique<learned_vignetting<Frame>>(exec, data));
  if (options.exposure) all.push_back(std::make_unique<learned_exposures<Frame>>(exec, data));
  return all;
}

}}  // namespace gart::GART_ISA
