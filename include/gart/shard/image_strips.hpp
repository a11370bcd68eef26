#pragma once
/// \file
/// Strips that ranks have of an array of rows, an image or what is made of one, on their way to the ranks of the same
/// view that read them: whole images, or the rows around a strip of one's own. Every rank calls these, with a unit to
/// trace or without; they return the bytes that this one has sent.

#include <gart/comm/communicator.hpp>
#include <gart/exec/stage.hpp>
#include <gart/scene/camera.hpp>
#include <gart/shard/work_units.hpp>

#include <algorithm>
#include <initializer_list>
#include <vector>

namespace gart { inline namespace GART_ISA {

/// The messages of one rank: to whom and from whom rows go.
struct strip_messages {
  std::vector<work_unit> const& units;  ///< of all ranks
  int rank;                             ///< this one
  std::vector<message> sends = {}, receives = {};
  u64 bytes = 0;  ///< sent

  /// Of the rows at `data`, so many bytes each: those that a unit has go to those that read them. Both are functions
  /// of a work_unit to image_rows.
  void add(void* data, std::size_t row_bytes, auto const& has, auto const& reads) {
    work_unit const& mine = units[static_cast<std::size_t>(rank)];
    auto const part = [&](int other, image_rows const& there, image_rows const& wanted) {
      image_rows const both{std::max(there.first, wanted.first), std::min(there.end, wanted.end)};
      return message{other, static_cast<char*>(data) + static_cast<std::size_t>(both.first) * row_bytes,
                     static_cast<std::size_t>(both.count()) * row_bytes};
    };
    for (int r = 0; r < static_cast<int>(units.size()); ++r) {
      work_unit const& other = units[static_cast<std::size_t>(r)];
      if (r == rank || other.view != mine.view) continue;
      if (message const m = part(r, has(mine), reads(other)); m.bytes) sends.push_back(m), bytes += m.bytes;
      if (message const m = part(r, has(other), reads(mine)); m.bytes) receives.push_back(m);
    }
  }
};

/// The rows of pixels of an image that a unit has.
inline image_rows rows_in(work_unit const& unit, int height) {
  return {unit.rows.first, std::max(std::min(unit.rows.end, height), unit.rows.first)};
}

/// Of an image [H][W] of `bytes` a pixel, of which a rank has its unit's rows: the rows that a unit reads.
template <execution E, class Comm>
requires communicator<Comm, E> u64 share_strips(E& exec, Comm& comm, std::vector<work_unit> const& units, void* image,
                                                camera const& view, std::size_t bytes, auto const& reads) {
  stage_scope stage(exec, "exchange/image");
  strip_messages all{units, comm.rank()};
  all.add(
      image, static_cast<std::size_t>(view.width) * bytes,
      [&](work_unit const& unit) { return rows_in(unit, view.height); }, reads);
  comm.exchange(exec, as_span(all.sends), as_span(all.receives));
  return all.bytes;
}

/// Of arrays of so many rows each: all of them, from the unit that has them; beside what is queued (Comm::begin).
template <execution E, class Comm>
requires communicator<Comm, E> u64 begin_sharing_rows(E& exec, Comm& comm, std::vector<work_unit> const& units,
                                                      std::initializer_list<span<float>> arrays, int rows,
                                                      auto const& has) {
  strip_messages all{units, comm.rank()};
  for (span<float> const array : arrays)
    all.add(array.data(), array.size() / static_cast<std::size_t>(rows) * sizeof(float), has, [&](work_unit const&) {
      return image_rows{0, rows};
    });
  comm.begin(exec, as_span(all.sends), as_span(all.receives));
  return all.bytes;
}

}}  // namespace gart::GART_ISA
