#pragma once
/// \file
/// What is wrong with JSON, in the words of the library that parses it.

#include <string>
#include <string_view>

namespace gart {

/// Of an exception's text.
struct json_fault {
  std::string what;  ///< without the exception's name in brackets
  bool cut = false;  ///< the text ended where more of it was due
};

/// Of what nlohmann::json::exception says.
inline json_fault json_fault_of(std::string_view what) {
  auto const has = [&](std::string_view part) { return what.find(part) != what.npos; };
  json_fault out;
  // A string has no end where the text ends in it.
  out.cut = has("unexpected end of input") || has("empty input") || has("missing closing quote");
  if (auto const end = what.find("] "); what.starts_with("[json.exception") && end != what.npos)
    what.remove_prefix(end + 2);
  out.what = what;
  return out;
}

}  // namespace gart
