#pragma once
/// \file
/// Arrays of numbers by name, in host memory. The parts of a run write their state to them (train/state.hpp), and read
/// it back. Errors: invalid_argument, naming the array, for one of another size than what reads it.

#include <gart/core/error.hpp>
#include <gart/core/types.hpp>

#include <cstring>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace gart {

/// A name and the bytes of its numbers, for each array.
class named_arrays {
 public:
  std::map<std::string, std::vector<char>> bytes;  ///< all of them

  /// A copy of the values.
  template <class T>
  void set(std::string const& name, std::vector<T> const& values) {
    auto const* const from = reinterpret_cast<char const*>(values.data());
    bytes[name].assign(from, from + values.size() * sizeof(T));
  }
  /// The values; none where no array has that name.
  template <class T>
  std::vector<T> get(std::string const& name) const {
    auto const at = bytes.find(name);
    std::size_t const size = at == bytes.end() ? 0 : at->second.size();
    std::vector<T> values(size / sizeof(T));
    if (size % sizeof(T) != 0) throw invalid_argument("state: array " + name + " is not a whole number of elements");
    if (size) std::memcpy(values.data(), at->second.data(), size);
    return values;
  }
  /// The values take the place of as many.
  template <class T>
  void take(std::string const& name, std::vector<T>& values) const {
    std::vector<T> taken = get<T>(name);
    if (taken.size() != values.size())
      throw invalid_argument("state: array " + name + " has " + std::to_string(taken.size()) +
                             " numbers, and the run " + std::to_string(values.size()) +
                             ": take the state of a run with the same training views and options");
    values = std::move(taken);
  }
};

}  // namespace gart
