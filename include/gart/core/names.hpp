#pragma once
/// \file
/// Enumerations with names: one word for a value in a program's options, its files and the library's messages. An
/// enumeration gets them by a function beside it, in the order in which a user reads them:
///   enum class fruit { apple, pear };
///   constexpr auto names_of(fruit) { return std::array<name_of<fruit>, 2>{{{fruit::apple, "apple"}, ...}}; }
/// Errors: from_string throws invalid_argument with the names there are.

#include <gart/core/error.hpp>

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace gart {

/// A value of an enumeration and its name.
template <class E>
struct name_of {
  E value;           ///< of the enumeration
  char const* name;  ///< as users read it
};

/// An enumeration with names_of.
template <class E>
concept named = requires(E value) {
  names_of(value)[0].name;
};

/// The name of a value; "?" where it has none.
template <named E>
constexpr char const* to_string(E value) {
  for (auto const& one : names_of(value))
    if (one.value == value) return one.name;
  return "?";
}

/// The value of a name; `otherwise` where no value has it.
template <named E>
constexpr E from_string(std::string_view name, E otherwise) {
  for (auto const& one : names_of(E{}))
    if (name == one.name) return one.value;
  return otherwise;
}

/// All names, in their order.
template <named E>
std::vector<std::string> list_of_names() {
  std::vector<std::string> all;
  for (auto const& one : names_of(E{})) all.push_back(one.name);
  return all;
}

/// The value of a name; invalid_argument where no value has it.
template <named E>
E from_string(std::string_view name) {
  std::string all;
  for (auto const& one : names_of(E{})) {
    if (name == one.name) return one.value;
    all += std::string(all.empty() ? "" : ", ") + one.name;
  }
  throw invalid_argument("'" + std::string(name) + "' is none of " + all);
}

}  // namespace gart
