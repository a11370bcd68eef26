#pragma once
/// \file
/// Words of messages: lists, counts, and the known name nearest to what was typed.

#include <algorithm>
#include <numeric>
#include <string>
#include <string_view>
#include <vector>

namespace gart {

/// "1 view", "3 views".
inline std::string counted(std::size_t n, char const* noun) {
  return std::to_string(n) + " " + noun + (n == 1 ? "" : "s");
}

/// "a, b, c": of(x), a text, for each x of a list.
template <class List, class Of>
std::string joined(List const& list, Of const& of, std::string_view between = ", ") {
  std::string all;
  for (auto const& x : list) (all += all.empty() ? "" : between) += of(x);
  return all;
}
/// The same of texts.
template <class List>
std::string joined(List const& list) {
  return joined(list, [](auto const& text) { return std::string_view(text); });
}

/// In small letters, where they are of ASCII.
inline std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return out;
}

/// Letters to add, remove, exchange or swap with the next (the restricted Damerau-Levenshtein distance).
inline std::size_t letters_between(std::string const& a, std::string const& b) {
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), now(b.size() + 1);
  std::iota(last.begin(), last.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    now[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      now[j] = std::min({last[j] + 1, now[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) now[j] = std::min(now[j], before[j - 2] + 1);
    }
    std::swap(before, last), std::swap(last, now);
  }
  return last[b.size()];
}

/// "; did you mean X?" for the nearest name if at most a third of its letters differ; else "".
inline std::string did_you_mean(std::string const& typed, std::vector<std::string> const& names) {
  std::string const* nearest = nullptr;
  std::size_t least = 0;
  for (std::string const& name : names) {
    std::size_t const letters = letters_between(typed, name);
    if (3 * letters <= std::max(typed.size(), name.size()) && (!nearest || letters < least))
      nearest = &name, least = letters;
  }
  return nearest ? "; did you mean " + *nearest + "?" : "";
}

}  // namespace gart
