#pragma once
/// \file
/// Sends strips of an image, or of another array of rows, between the ranks of one view. A rank gets the whole image,
/// or the rows around its own strip. Every rank calls these functions, with a unit to trace or without. They return the
/// bytes that this rank sent.

#include <gart/comm/communicator.hpp>
#include <gart/exec/stage.hpp>
#include <gart/scene/camera.hpp>
#include <gart/shard/work_units.hpp>

#include <algorithm>
#include <initializer_list>
#include <vector>

namespace gart { inline namespace GART_ISA {

/// The messages of one rank: which rows it sends to which rank, and receives from which.
struct strip_messages {
  std::vector<work_unit> const& units;  ///< of all ranks
  int rank;                             ///< this one
  std::vector<message> sends = {}, receives = {};
  u64 bytes = 0;  ///< sent

  /// Exchanges rows at `data`, so many bytes each, from the units that have them to those that read them. Both
  /// functions map a work_unit to image_rows.
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

/// A unit's rows of pixels.
inline image_rows rows_in(work_unit const& unit, int height) {
  return {unit.rows.first, std::max(std::min(unit.rows.end, height), unit.rows.first)};
}

/// Gives each rank the rows that its unit reads of an image [H][W], `bytes` a pixel. The units have the image's rows.
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

/// Gives all ranks of a view all rows of arrays, from the units that have them. Runs in parallel with queued work
/// (Comm::begin).
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
