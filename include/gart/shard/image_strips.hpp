#pragma once
/// \file
/// Strips of an image that ranks have traced become the whole image on all of them, in one group of messages.

#include <gart/comm/communicator.hpp>
#include <gart/scene/camera.hpp>
#include <gart/shard/work_units.hpp>

#include <algorithm>
#include <vector>

namespace gart::inline GART_ISA {

/// Of [H][W] of `bytes` a pixel this rank has its unit's rows; all ranks that trace the same view get the others'.
/// Every rank calls it, with a unit to trace or without. Returns the bytes that this one has sent.
template <execution E, class Comm>
requires communicator<Comm, E> u64 share_strips(E& exec, Comm& comm, std::vector<work_unit> const& units, void* image,
                                                camera const& view, std::size_t bytes) {
  auto const part = [&](work_unit const& u, int rank) {
    std::size_t const end = static_cast<std::size_t>(std::min(u.rows.end, view.height)),
                      first = static_cast<std::size_t>(u.rows.first);
    std::size_t const row = static_cast<std::size_t>(view.width) * bytes;
    return message{rank, static_cast<char*>(image) + first * row, u.empty() ? 0 : (end - first) * row};
  };
  std::vector<message> sends, receives;
  u64 sent = 0;
  work_unit const& mine = units[static_cast<std::size_t>(comm.rank())];
  for (int r = 0; r < comm.size(); ++r) {
    work_unit const& other = units[static_cast<std::size_t>(r)];
    if (r == comm.rank() || other.view != mine.view) continue;
    if (message const m = part(mine, r); m.bytes) sends.push_back(m), sent += m.bytes;
    if (message const m = part(other, r); m.bytes) receives.push_back(m);
  }
  comm.exchange(exec, as_span(sends), as_span(receives));
  return sent;
}

}  // namespace gart::inline GART_ISA
