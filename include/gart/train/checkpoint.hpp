#pragma once
// The file format of checkpoints: "gart checkpoint 1\n", then named arrays (name length, name, bytes, data; little
// endian), the last one named "end". Written whole or not at all. Errors: io_error naming the file and the array that
// is missing, truncated or of another size.

#include <gart/core/span.hpp>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace gart {

class checkpoint_writer {
 public:
  template <class T>
  void add(std::string const& name, std::vector<T> const& values) {
    auto const* bytes = reinterpret_cast<char const*>(values.data());
    arrays_[name].assign(bytes, bytes + values.size() * sizeof(T));
  }
  void write(std::filesystem::path const& path) const;

 private:
  std::map<std::string, std::vector<char>> arrays_;
};

class checkpoint_reader {
 public:
  explicit checkpoint_reader(std::filesystem::path const& path);
  template <class T>
  std::vector<T> get(std::string const& name) const {
    std::vector<char> const& bytes = find(name, sizeof(T));
    auto const* values = reinterpret_cast<T const*>(bytes.data());
    return {values, values + bytes.size() / sizeof(T)};
  }
  bool has(std::string const& name) const { return arrays_.count(name) != 0; }
  [[noreturn]] void fail(std::string const& what) const;

 private:
  std::vector<char> const& find(std::string const& name, std::size_t element) const;
  std::filesystem::path path_;
  std::map<std::string, std::vector<char>> arrays_;
};

}  // namespace gart
