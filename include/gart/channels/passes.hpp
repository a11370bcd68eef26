#pragma once
/// \file
/// The list of channels: which targets, gradients and values (channels/targets.hpp) are whose. A channel is a line in
/// each function.

#include <gart/channels/depth.hpp>
#include <gart/channels/differentiate.hpp>
#include <gart/channels/features.hpp>
#include <gart/channels/targets.hpp>

namespace gart { inline namespace GART_ISA {

/// The way forward, to what is wanted.
template <execution E>
void sum_channels(E& exec, hit_table<E> const& table, gaussian_channels const& of, channel_targets const& out) {
  if (out.features) sum_channel(exec, table.view(), feature_channel<chunk_of<E>>{{}, of.features}, out.features);
}

/// Adds the channels by which geometry has a gradient.
template <execution E, class Response>
void weigh_channels(channel_gradient<E, Response>& back, gaussian_channels const& of, channel_gradients const& by) {
  if (!by.features.empty() && !by.detached) back.add(feature_channel<chunk_of<E>>{{}, of.features, by.features.data()});
}

/// dL/d what Gaussians have of them, where it is wanted; zero where there is no gradient.
template <execution E, class Response>
void pull_channels(E& exec, channel_gradient<E, Response>& back, hit_table<E>& table, gaussian_channels const& of,
                   channel_gradients const& by, channel_gradient_targets const& to) {
  if (to.features.values) {
    if (by.features.empty())
      exec.zero(to.features.values, to.features.size() * sizeof(float));
    else
      back.pull(table, feature_channel<chunk_of<E>>{{}, of.features, by.features.data()}, of.features.count,
                to.features.values);
  }
}

}}  // namespace gart::GART_ISA
