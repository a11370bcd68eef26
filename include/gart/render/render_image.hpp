#pragma once
/// \file
/// One image to host memory: with everything a pixel can tell, or its colours alone, in bytes.

#include <gart/render/bytes.hpp>
#include <gart/render/frame.hpp>
#include <gart/render/rendered.hpp>

namespace gart { inline namespace GART_ISA {

/// Of what a view of that size was rendered to.
template <execution E>
rendered rendered_of(camera const& view, buffer<float, E> const& color, buffer<float, E> const& transmittance,
                     buffer<float, E> const& depth, buffer<u32, E> const& hits) {
  rendered out;
  out.color.width = out.transmittance.width = out.depth.width = out.hits.width = view.width;
  out.color.height = out.transmittance.height = out.depth.height = out.hits.height = view.height;
  out.transmittance.channels = out.depth.channels = out.hits.channels = 1;
  out.color.data = color.to_host(), out.transmittance.data = transmittance.to_host();
  out.depth.data = depth.to_host(), out.hits.data = hits.to_host();
  return out;
}

/// Of a frame that is prepared.
template <class Frame>
rendered render_image(Frame& frame) {
  using E = typename Frame::execution_type;
  camera const& view = frame.view();
  std::size_t const pixels = static_cast<std::size_t>(view.width) * view.height;
  buffer<float, E> color(frame.exec(), 3 * pixels), transmittance(frame.exec(), pixels), depth(frame.exec(), pixels);
  buffer<u32, E> hits(frame.exec(), pixels);
  frame.render({color.data(), transmittance.data(), depth.data(), hits.data()});
  return rendered_of(view, color, transmittance, depth, hits);
}

/// The colours of a prepared frame, the same as to_8bit of render_image's. They are made before they are copied: 3
/// bytes a pixel, where those images have 24.
template <class Frame>
image8 render_image_8bit(Frame& frame) {
  using E = typename Frame::execution_type;
  camera const& view = frame.view();
  index_t const pixels = static_cast<index_t>(view.width) * view.height;
  buffer<float, E> color(frame.exec(), std::size_t{3} * pixels);
  buffer<u8, E> bytes(frame.exec(), std::size_t{3} * pixels);
  image_targets targets;
  targets.color = color.data();
  frame.render(targets);
  color_to_bytes(frame.exec(), color.data(), pixels, bytes.data(), 3);
  image8 out;
  out.width = view.width, out.height = view.height, out.data = bytes.to_host();
  return out;
}

}}  // namespace gart::GART_ISA
