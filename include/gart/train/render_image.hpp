#pragma once
// One image to host memory, with everything a pixel can tell.

#include <gart/render/antialiased.hpp>
#include <gart/render/forward.hpp>
#include <gart/train/session.hpp>

namespace gart::inline GART_ISA {

template <int ShDegree, execution E, class Tracer>
rendered render_image(E& exec, Tracer& tracer, frame_records<E>& records, gaussians_view<float const> scene,
                      camera const& view, render_options const& options) {
  std::size_t const pixels = static_cast<std::size_t>(view.width) * view.height;
  buffer<float, E> color(exec, 3 * pixels), transmittance(exec, pixels), depth(exec, pixels);
  buffer<u32, E> hits(exec, pixels);
  antialiased<E> filter(exec);
  auto const seen = filter.of(exec, scene, view, options.antialias);
  records.template prepare<typename Tracer::response_type>(exec, seen, view, options.alpha_min);
  configure(tracer, options);
  tracer.prepare(exec, seen, records.view(), view, options.alpha_min, options.near);
  forward<ShDegree>(exec, tracer, scene, view, options, ShDegree,
                    {color.data(), transmittance.data(), depth.data(), hits.data()}, record_none{});
  rendered out;
  out.color.width = out.transmittance.width = out.depth.width = out.hits.width = view.width;
  out.color.height = out.transmittance.height = out.depth.height = out.hits.height = view.height;
  out.transmittance.channels = out.depth.channels = out.hits.channels = 1;
  out.color.data = color.to_host(), out.transmittance.data = transmittance.to_host();
  out.depth.data = depth.to_host(), out.hits.data = hits.to_host();
  return out;
}

}  // namespace gart::inline GART_ISA
