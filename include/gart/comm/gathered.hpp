#pragma once
/// \file
/// Gathers each rank's data on all ranks, in their order: values of one size, and words of any length. Every rank calls
/// it. Of host memory; cost: an all-gather, of words two.

#include <gart/comm/communicator.hpp>

#include <algorithm>
#include <string>
#include <type_traits>
#include <vector>

namespace gart { inline namespace GART_ISA {

/// A value of each.
template <class Comm, class T>
requires std::is_trivially_copyable_v<T> std::vector<T> gathered(Comm& comm, T const& mine) {
  std::vector<T> all(static_cast<std::size_t>(comm.size()), mine);
  comm.all_gather(&mine, all.data(), sizeof mine);
  return all;
}

/// Words of each.
template <class Comm>
std::vector<std::string> gathered(Comm& comm, std::string const& mine) {
  std::vector<u64> const lengths = gathered(comm, u64{mine.size()});
  std::size_t const most = *std::max_element(lengths.begin(), lengths.end());
  std::string padded = mine, every(most * lengths.size(), '\0');
  padded.resize(most);
  comm.all_gather(padded.data(), every.data(), most);
  std::vector<std::string> all;
  for (std::size_t r = 0; r < lengths.size(); ++r) all.push_back(every.substr(r * most, lengths[r]));
  return all;
}

}}  // namespace gart::GART_ISA
