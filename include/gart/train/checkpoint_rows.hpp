#pragma once
/// \file
/// The file format of a checkpoint: the position of one rank's rows, and their part of its checksums. The ranks agree
/// by train/checkpoint_part.hpp; one rank by itself has all rows.
///
/// The file is "gart checkpoint 2\\n", then named arrays, the last one named "end", and nothing after it. An array is
/// little endian. It has the u64 length of the name, the name, u32 version of the content, u64 bytes, the bytes. Last
/// comes the u32 CRC-32C (io/crc32c.hpp) of everything before it. So one flipped bit is found. Files that begin with
/// "gart checkpoint 1\\n", whose arrays have neither version nor checksum, are read too.
///
/// Errors: io_error naming the file and the array that is missing, truncated, damaged or of another size. The same for
/// a version that is newer than the reader.

#include <gart/comm/row_owners.hpp>
#include <gart/comm/shared_file.hpp>
#include <gart/train/state.hpp>

#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

namespace gart {

/// A rank's writer. Rank 0 also writes the arrays that are not of Gaussians.
class checkpoint_rows {
 public:
  /// The state must outlive it; of each Gaussian it has the rows of `owners`.
  checkpoint_rows(training_state const& mine, row_owners const& owners);
  /// Bytes of this rank in each array.
  std::vector<u64> bytes() const;
  /// Where arrays lie that have so many bytes: the sums over the ranks.
  void place(std::vector<u64> const& bytes_of_all);
  /// This rank's part of each array's checksum. The exclusive or of all ranks' parts is the checksum.
  std::vector<u32> checksum_shares() const;
  /// This rank's bytes of the file.
  void write(shared_file& file, std::vector<u32> const& checksums) const;

 private:
  struct array {
    std::string name;
    std::vector<char> small;     // the values of an array of the run
    char const* data = nullptr;  // or this rank's rows
    u64 row = 0;                 // bytes for each Gaussian; 0: an array of the run
    u64 bytes = 0, total = 0;    // of this rank, of all
    u64 begin = 0;               // in the file
  };
  std::string head(array const& a) const;
  // f(byte in the array, first of them, how many) for what this rank has of an array's values.
  template <class F>
  void for_each_piece(array const& a, F const& f) const;
  row_owners owners_;
  std::vector<array> arrays_;  // in the order of the file
};

/// A rank's reader.
class checkpoint_rows_reader {
 public:
  /// Reads where the arrays lie.
  checkpoint_rows_reader(std::filesystem::path const& path, row_owners const& owners);
  /// This rank's rows of arrays of Gaussians, and all of the rest.
  training_state state() const;
  /// This rank's part in the checksums of the arrays of rows, once the state was read.
  std::vector<u32> const& checksum_shares() const { return shares_; }
  /// io_error where these are not the checksums of the file.
  void require(std::vector<u32> const& checksums) const;

  /// An array's values: of rows this rank's.
  template <class T>
  std::vector<T> get(std::string const& name, u32 newest_version = 1) const;
  /// All of them, in order.
  std::vector<std::string> names() const;
  /// Throws io_error with the path before `what`.
  [[noreturn]] void fail(std::string const& what) const;

 private:
  struct array {
    u32 version = 1;
    u64 begin = 0, at = 0, bytes = 0;  // of its head and of its values, in the file
    u64 row = 0;                       // bytes of a Gaussian; 0: of the run
    u32 checksum = 0;
  };
  array const& find(std::string const& name) const;
  void read(u64 at, void* to, u64 bytes) const;

  std::filesystem::path path_;
  row_owners owners_;
  mutable std::ifstream file_;
  u64 size_ = 0, gaussians_ = 0;
  bool checked_ = true;
  std::map<std::string, array> arrays_;
  mutable std::vector<u32> shares_;
  mutable std::vector<std::string> shared_;  // their names
};

}  // namespace gart
