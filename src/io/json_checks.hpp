#pragma once
// Strict readings of a record's fields. Each is checked against its range or its names; errors give the remedy. A field
// that is absent has the value that is given for that.

#include "json_record.hpp"

#include <gart/core/names.hpp>
#include <gart/core/words.hpp>
#include <gart/math/glm.hpp>

#include <algorithm>
#include <array>

namespace gart::io {

inline constexpr double furthest = 1e12;  // what a file may say of lengths and places

// No other than these.
inline void require_keys(record const& r, std::vector<std::string> const& names) {
  if (!r.own.is_object()) throw io_error(r.where, "is not a JSON object", "write {\"...\": ...}");
  for (auto const& [key, value] : r.own.items()) {
    if (std::find(names.begin(), names.end(), key) != names.end()) continue;
    throw io_error(r.where, "has no field '" + key.substr(0, 60) + "'" + did_you_mean(key, names),
                   "there are " + joined(names));
  }
}

template <std::size_t n>
std::array<double, n> numbers(record const& r, char const* key, std::array<double, n> otherwise,
                              double least = -furthest, double most = furthest) {
  json const* const list = r.find(key);
  if (!list) return otherwise;
  std::array<double, n> out{};
  bool sound = list->is_array() && list->size() == n;
  for (std::size_t k = 0; sound && k < n; ++k) {
    sound = (*list)[k].is_number();
    if (sound) out[k] = (*list)[k].template get<double>();
    sound = sound && out[k] >= least && out[k] <= most;
  }
  if (!sound)
    throw io_error(r.where,
                   std::string("'") + key + "' is not a list of " + std::to_string(n) + " numbers from " +
                       json(least).dump() + " to " + json(most).dump(),
                   "correct it");
  return out;
}

inline vec3d three(record const& r, char const* key, vec3d const& otherwise, double least = -furthest,
                   double most = furthest) {
  auto const v = numbers<3>(r, key, {otherwise.x, otherwise.y, otherwise.z}, least, most);
  return {v[0], v[1], v[2]};
}

inline double number_within(record const& r, char const* key, double otherwise, double least, double most) {
  double const v = r.number_or(key, otherwise);
  if (!(v >= least && v <= most))
    throw io_error(r.where,
                   std::string("'") + key + "' is " + json(v).dump() + ", not between " + json(least).dump() + " and " +
                       json(most).dump(),
                   "correct it");
  return v;
}

inline bool flag(record const& r, char const* key, bool otherwise) {
  json const* const value = r.find(key);
  if (value && !value->is_boolean())
    throw io_error(r.where, std::string("'") + key + "' is not true or false", "write one of them");
  return value ? value->get<bool>() : otherwise;
}

template <named E>
E choice(record const& r, char const* key, E otherwise) {
  if (!r.has(key)) return otherwise;
  std::string const name = r.text(key);
  try {
    return from_string<E>(name);
  } catch (invalid_argument const& e) {
    throw io_error(r.where, std::string("'") + key + "': " + e.what() + did_you_mean(name, list_of_names<E>()),
                   "correct it");
  }
}

}  // namespace gart::io
