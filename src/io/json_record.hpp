#pragma once
// The parts that the readers of JSON share: a file, an object whose fields are named in errors, a pose.

#include "capture.hpp"

#include <gart/core/error.hpp>
#include <gart/io/file.hpp>
#include <gart/io/json_fault.hpp>

#include <nlohmann/json.hpp>

#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace gart::io {

using nlohmann::json;

struct camera_format;

// Python writes NaN, Infinity and -Infinity where JSON has no word: texts of these, which readers name or leave out.
std::vector<u8> with_words_quoted(std::vector<u8> const& bytes);

// A number, or one of these words; nothing where it is neither.
inline std::optional<double> number_of(json const& value) {
  if (value.is_number()) return value.get<double>();
  if (value == "NaN") return std::nan("");
  if (value == "Infinity") return HUGE_VAL;
  if (value == "-Infinity") return -HUGE_VAL;
  return std::nullopt;
}

inline json read_json(std::filesystem::path const& path) {
  std::vector<u8> const bytes = read_file(path);
  if (json value = json::parse(bytes.begin(), bytes.end(), nullptr, false); !value.is_discarded()) return value;
  std::vector<u8> const quoted = with_words_quoted(bytes);
  try {
    return json::parse(quoted.begin(), quoted.end());
  } catch (json::exception const& e) {
    json_fault const fault = json_fault_of(e.what());
    throw io_error(path.string(), "is not valid JSON: " + fault.what,
                   fault.cut ? "the file is truncated: copy or export it again" : "correct it at that place");
  }
}

// A JSON object, and the one its missing keys are looked up in.
struct record {
  json const& own;
  json const* fallback;
  std::string where;

  json const* find(char const* key) const {
    if (auto const it = own.find(key); it != own.end() && !it->is_null()) return &*it;
    if (!fallback) return nullptr;
    auto const it = fallback->find(key);
    return it != fallback->end() && !it->is_null() ? &*it : nullptr;
  }
  bool has(char const* key) const { return find(key) != nullptr; }
  json const& at(char const* key) const {
    json const* value = find(key);
    if (!value) throw io_error(where, std::string("'") + key + "' is missing", "add it");
    return *value;
  }
  double number(char const* key) const {
    std::optional<double> const v = number_of(at(key));
    if (!v) throw io_error(where, std::string("'") + key + "' is not a number", "write a number");
    if (!std::isfinite(*v))
      throw io_error(where, std::string("'") + key + (std::isnan(*v) ? "' is NaN" : "' is not finite"),
                     "write a finite number");
    return *v;
  }
  double number_or(char const* key, double other) const { return has(key) ? number(key) : other; }
  int size(char const* key) const {
    double const v = number(key);
    if (!(v >= 1 && v <= 1e6)) {
      throw io_error(where, std::string("'") + key + "' is not a size in pixels", "write a number from 1 to 1000000");
    }
    return static_cast<int>(std::lround(v));
  }
  std::string text(char const* key) const {
    json const& value = at(key);
    if (!value.is_string()) throw io_error(where, std::string("'") + key + "' is not a text", "write it in quotes");
    return value.get<std::string>();
  }
  bool flag(char const* key) const {
    json const* value = find(key);
    return value && value->is_boolean() && value->get<bool>();
  }
};

// A 3x4 or 4x4 matrix, row by row, camera to world.
inline void read_pose(record const& r, char const* key, bool opengl_axes, camera& view) {
  json const& rows = r.at(key);
  auto const refuse = [&] {
    throw io_error(r.where, std::string("'") + key + "' is not a matrix of 4 x 4 numbers", "export it again");
  };
  if (!rows.is_array() || rows.size() < 3 || rows.size() > 4) refuse();
  mat3d axes(1.0);
  vec3d center(0.0);
  for (int i = 0; i < 3; ++i) {
    json const& row = rows[static_cast<std::size_t>(i)];
    if (!row.is_array() || row.size() != 4) refuse();
    for (int j = 0; j < 4; ++j) {
      std::optional<double> const value = number_of(row[static_cast<std::size_t>(j)]);
      if (!value) refuse();
      (j < 3 ? axes[j][i] : center[i]) = *value;
    }
  }
  if (opengl_axes) axes[1] = -axes[1], axes[2] = -axes[2];
  set_pose(view, axes, center, r.where);
}

// Sets the motion where 'shutter_type' names a rolling one: `view` has the first line's pose, `key` the last's. The
// view's size must be known.
void read_shutter(record const& r, char const* key, bool opengl_axes, camera& view);

// The model that 'camera_model' names; refuses one that is not traced.
camera_format const* camera_model_of(record const& r, char const* otherwise);

// Whether an object is one of a camera JSON, and no transforms.json.
bool looks_like_camera(json const& value);

// The parameters of its lens, all but focal lengths and principal point; refuses those that the model lacks.
void read_lens_members(record const& r, camera_format const& model, camera& view);

}  // namespace gart::io
