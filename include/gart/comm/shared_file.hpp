#pragma once
/// \file
/// A file that several ranks write at once, each its own bytes at any place. A communicator's open_file makes it
/// (comm/communicator.hpp); compiled code that writes a rank's part takes it.

#include <gart/core/types.hpp>

#include <cstddef>

namespace gart {

/// One rank's handle of it. Closes without a word where it was not closed.
class shared_file {
 public:
  /// No part of it is renamed or removed.
  virtual ~shared_file() = default;
  /// `bytes` of them, from byte `at` of the file on. Errors: io_error naming the file and the cause, for a full disk.
  virtual void write(u64 at, void const* data, std::size_t bytes) = 0;
  /// Brings what this rank has written to the disk. Errors: io_error.
  virtual void close() = 0;
};

}  // namespace gart
