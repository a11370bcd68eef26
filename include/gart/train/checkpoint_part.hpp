#pragma once
/// \file
/// A checkpoint (train/state.hpp) that several ranks write and read, each its own rows. The file is byte for byte that
/// of one rank. A rank's rows lie in blocks of the file (comm/row_owners.hpp). An array's checksum combines those of
/// its blocks (io/crc32c.hpp). Memory: a rank's part, and a few bytes an array.
///
/// Errors: io_error on all ranks, naming the file, the rank and the cause; the checkpoint that was there is whole.

#include <gart/comm/collective_io.hpp>
#include <gart/train/checkpoint_rows.hpp>

namespace gart { inline namespace GART_ISA {

/// `mine`: this rank's rows of the Gaussians, and the shared rest. All ranks call it.
template <class Comm>
void write_checkpoint_collectively(Comm& comm, row_owners const& owners, std::filesystem::path const& path,
                                   training_state const& mine) {
  if (comm.size() == 1) return write_checkpoint(path, mine);
  checkpoint_rows rows(mine, owners);
  std::vector<u64> bytes = rows.bytes();
  comm.all_reduce(span<u64>(bytes));
  rows.place(bytes);
  std::vector<u32> const checksums = checksums_of(comm, rows.checksum_shares());
  write_collectively(comm, path, [&](shared_file& file) { rows.write(file, checksums); });
}

/// This rank's rows of a checkpoint that any number of ranks wrote. All ranks call it.
template <class Comm>
training_state read_checkpoint_collectively(Comm& comm, row_owners const& owners, std::filesystem::path const& path) {
  if (comm.size() == 1) return read_checkpoint(path);
  training_state mine;
  std::optional<checkpoint_rows_reader> reader;
  collective(comm, path, [&] { mine = reader.emplace(path, owners).state(); });
  std::vector<u32> const checksums = checksums_of(comm, reader->checksum_shares());
  collective(comm, path, [&] { reader->require(checksums); });
  return mine;
}

}}  // namespace gart::GART_ISA
