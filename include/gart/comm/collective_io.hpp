#pragma once
/// \file
/// File operations that all ranks finish or none does. An error of one rank is an error of all, and names that rank. A
/// file is written to a temporary name, and renamed when every rank is done.
///
///   write_collectively(comm, path, [&](shared_file& file) { file.write(place_of_mine, mine.data(), bytes); });
///
/// All ranks make the same calls. Cost: messages of a few bytes. Errors: io_error naming the file, the rank with its
/// host, the cause and the remedy. Then the temporary file is gone, and an older file is whole.

#include <gart/comm/communicator.hpp>
#include <gart/core/error.hpp>

#include <algorithm>
#include <atomic>
#include <exception>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include <unistd.h>

namespace gart { inline namespace GART_ISA {

namespace detail {

// "rank 2 of 4 (node1)"
template <class Comm>
std::string name_of_rank(Comm const& comm) {
  std::string name = "rank " + std::to_string(comm.rank()) + " of " + std::to_string(comm.size());
  if constexpr (requires { comm.host(); }) name += " (" + comm.host() + ")";
  return name;
}

// The message of the first rank that has one, on all ranks; empty where none has.
template <class Comm>
std::string first_error(Comm& comm, std::string const& mine) {
  std::vector<u64> lengths(static_cast<std::size_t>(comm.size()));
  u64 const length = mine.size();
  comm.all_gather(&length, lengths.data(), sizeof length);
  auto const speaks = std::find_if(lengths.begin(), lengths.end(), [](u64 n) { return n != 0; });
  if (speaks == lengths.end()) return {};
  std::string word = mine;
  word.resize(*speaks);
  comm.broadcast(word.data(), word.size(), static_cast<int>(speaks - lengths.begin()));
  return word;
}

}  // namespace detail

/// f() on every rank; io_error on all where one of them throws. `also`: another name that f's errors may have for the
/// file.
template <class Comm, class F>
void collective(Comm& comm, std::filesystem::path const& path, F const& f, std::filesystem::path const& also = {}) {
  std::string mine;
  try {
    f();
  } catch (std::exception const& e) {
    if (comm.size() == 1 && also.empty()) throw;
    mine = e.what();
    for (std::filesystem::path const& name : {also, path})
      if (!name.empty() && mine.starts_with(name.string() + ": ")) mine.erase(0, name.string().size() + 2);
    if (comm.size() > 1) mine = detail::name_of_rank(comm) + ": " + mine;
  }
  if (std::string const word = detail::first_error(comm, mine); !word.empty()) throw io_error(path.string(), word);
}

/// One file, of what body(file) writes on each rank.
template <class Comm>
void write_collectively(Comm& comm, std::filesystem::path const& path, std::function<void(shared_file&)> const& body) {
  static std::atomic<unsigned> serial{0};
  bool const first = comm.rank() == 0;
  u64 const own[2] = {static_cast<u64>(::getpid()), serial++};
  u64 name[2] = {own[0], own[1]};
  comm.broadcast(name, sizeof name, 0);
  std::filesystem::path temporary = path;
  temporary.replace_filename("." + path.filename().string() + "." + std::to_string(name[0]) + "-" +
                             std::to_string(name[1]) + ".tmp");
  std::unique_ptr<shared_file> file;
  bool made = false;
  try {
    collective(
        comm, path,
        [&] {
          if (first) file = comm.open_file(temporary, true), made = true;
        },
        temporary);
    collective(
        comm, path,
        [&] {
          if (!file) file = comm.open_file(temporary, false);
          body(*file);
          file->close();
        },
        temporary);
    collective(comm, path, [&] {
      std::error_code code;
      if (first) std::filesystem::rename(temporary, path, code);
      if (code)
        throw io_error(path.string(), "cannot be replaced: " + code.message(),
                       "remove what is there, or choose another name");
    });
  } catch (...) {
    file.reset();
    std::error_code ignored;
    if (made) std::filesystem::remove(temporary, ignored);
    throw;
  }
}

/// Of checksums that each rank has a share of (io/crc32c.hpp) the whole ones, on all ranks.
template <class Comm>
std::vector<u32> checksums_of(Comm& comm, std::vector<u32> const& shares) {
  std::vector<u32> all(shares.size() * static_cast<std::size_t>(comm.size())), sums(shares.size());
  comm.all_gather(shares.data(), all.data(), shares.size() * sizeof(u32));
  for (std::size_t i = 0; i < all.size(); ++i) sums[i % shares.size()] ^= all[i];
  return sums;
}

}}  // namespace gart::GART_ISA
