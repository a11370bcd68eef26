#pragma once
/// \file
/// The file format of checkpoints: "gart checkpoint 2\\n", then named arrays, the last one named "end", and nothing
/// after it. An array is, little endian:
///   u64 length of the name, the name, u32 version of what the array holds, u64 bytes, the bytes, u32 checksum
/// with CRC-32C (io/crc32c.hpp) over all of the array before it, so that one flipped bit is found. Files of the format
/// "gart checkpoint 1\\n", whose arrays have neither version nor checksum, are read too. Written whole or not at all.
/// Errors: io_error naming the file and the array that is missing, truncated, damaged, of another size, or of a version
/// that is newer than the reader.

#include <gart/core/span.hpp>
#include <gart/core/types.hpp>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace gart {

/// An array as it lies in a file.
struct checkpoint_array {
  u32 version = 1;          ///< of what the array holds
  std::vector<char> bytes;  ///< its values
};

/// Collects arrays and writes them.
class checkpoint_writer {
 public:
  /// The values are copied; `layout` is the array's version.
  template <class T>
  void add(std::string const& name, std::vector<T> const& values, u32 layout = 1) {
    auto const* bytes = reinterpret_cast<char const*>(values.data());
    arrays_[name] = {layout, {bytes, bytes + values.size() * sizeof(T)}};
  }
  /// All arrays to a temporary name, then renamed. Errors: io_error.
  void write(std::filesystem::path const& path) const;

 private:
  std::map<std::string, checkpoint_array> arrays_;
};

/// The arrays of a file, in host memory.
class checkpoint_reader {
 public:
  /// Reads all arrays and checks them. Errors: io_error.
  explicit checkpoint_reader(std::filesystem::path const& path);
  /// Throws io_error where there is none of that name, of whole values of T, of at most that version.
  template <class T>
  std::vector<T> get(std::string const& name, u32 newest_version = 1) const {
    std::vector<char> const& bytes = find(name, sizeof(T), newest_version);
    auto const* values = reinterpret_cast<T const*>(bytes.data());
    return {values, values + bytes.size() / sizeof(T)};
  }
  /// Whether there is an array of that name.
  bool has(std::string const& name) const { return arrays_.count(name) != 0; }
  /// All of them, in order.
  std::vector<std::string> names() const;
  /// Throws io_error with the path before `what`.
  [[noreturn]] void fail(std::string const& what) const;

 private:
  std::vector<char> const& find(std::string const& name, std::size_t element, u32 newest_version) const;
  std::filesystem::path path_;
  std::map<std::string, checkpoint_array> arrays_;
};

}  // namespace gart
