// What a client sends, read strictly: every field there, in its range, and no other one.

#include <gart/core/error.hpp>
#include <gart/io/camera_file.hpp>
#include <gart/light/scene.hpp>
#include <gart/scene/features.hpp>
#include <gart/view/message.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <utility>

namespace gart {

namespace {

using nlohmann::json;

[[noreturn]] void refuse(std::string const& field, std::string const& what) {
  throw invalid_argument("'" + field + "' " + what);
}

// A message, whose fields are asked for by name; `done` refuses those that nobody asked for.
class fields {
 public:
  explicit fields(json const& object) : object_(object) {}

  json const& at(char const* key) {
    json const* const value = find(key);
    if (!value) refuse(key, "is missing");
    return *value;
  }
  json const* find(char const* key) {
    asked_.push_back(key);
    auto const it = object_.find(key);
    return it == object_.end() ? nullptr : &*it;
  }
  double number(char const* key, double least, double most) { return in_range(at(key), key, least, most); }
  int whole(char const* key, int least, int most) {
    double const v = number(key, least, most);
    if (v != std::floor(v)) refuse(key, "is not a whole number");
    return static_cast<int>(v);
  }
  // Ids are counted by the client: what a double holds exactly.
  u64 id() {
    double const v = number("id", 0, 9007199254740991.0);
    if (v != std::floor(v)) refuse("id", "is not a whole number");
    return static_cast<u64>(v);
  }
  bool flag(char const* key) {
    json const& value = at(key);
    if (!value.is_boolean()) refuse(key, "is not true or false");
    return value.get<bool>();
  }
  std::string const& text(char const* key) {
    json const& value = at(key);
    if (!value.is_string()) refuse(key, "is not a text");
    return value.get_ref<std::string const&>();
  }
  template <named E>
  E name(char const* key) {
    try {
      return from_string<E>(text(key).substr(0, 40));
    } catch (invalid_argument const& e) {
      refuse(key, e.what());
    }
  }
  camera view(char const* key, int most = view_size_most) { return camera_of(at(key), key, most); }

  static camera camera_of(json const& value, std::string const& field, int most = view_size_most) {
    if (!value.is_object()) refuse(field, "is not an object");
    try {
      camera const view = parse_camera_json(value.dump(), field).view;
      if (view.width > most || view.height > most)
        refuse(field, "is larger than " + std::to_string(most) + " pixels a side");
      return view;
    } catch (json::exception const&) {
      refuse(field, "holds text that is not UTF-8");
    } catch (io_error const& e) {
      throw invalid_argument(e.what());
    } catch (unsupported const& e) {
      throw invalid_argument(e.what());
    }
  }
  static double in_range(json const& value, std::string const& field, double least, double most) {
    if (!value.is_number()) refuse(field, "is not a number");
    double const v = value.get<double>();
    if (!(v >= least && v <= most)) refuse(field, "is out of its range");
    return v;
  }
  template <std::size_t N>
  static std::array<double, N> numbers(json const& value, std::string const& field, double most) {
    if (!value.is_array() || value.size() != N) refuse(field, "is not a list of " + std::to_string(N) + " numbers");
    std::array<double, N> out;
    for (std::size_t k = 0; k < N; ++k) out[k] = in_range(value[k], field, -most, most);
    return out;
  }
  static vec3 point(json const& value, std::string const& field) {
    auto const [x, y, z] = numbers<3>(value, field, 1e18);
    return vec3(vec3d(x, y, z));
  }
  view_settings settings() {
    view_settings s;
    if (json const* const crop = find("crop"); crop && !crop->is_null()) {
      if (!crop->is_object() || crop->size() != 2 || !crop->contains("min") || !crop->contains("max"))
        refuse("crop", "is not {\"min\", \"max\"}");
      s.crop = view_box{point((*crop)["min"], "crop.min"), point((*crop)["max"], "crop.max")};
      for (int k = 0; k < 3; ++k)
        if (s.crop->low[k] > s.crop->high[k]) refuse("crop", "has a min that is larger than its max");
    }
    if (json const* const near = find("near"); near && !near->is_null())
      s.near = static_cast<float>(in_range(*near, "near", 1e-6, 1e9));
    if (json const* const background = find("background"); background && !background->is_null()) {
      s.background = point(*background, "background");
      for (int k = 0; k < 3; ++k)
        if (!((*s.background)[k] >= 0 && (*s.background)[k] <= 1)) refuse("background", "is no colour from 0 to 1");
    }
    for (auto const& [key, value] : {std::pair{"opacity", &s.opacity}, std::pair{"size", &s.size}})
      if (json const* const factor = find(key); factor && !factor->is_null())
        *value = static_cast<float>(in_range(*factor, key, 1e-3, 1e3));
    if (json const* const shape = find("shape"); shape && !shape->is_null()) s.shape = name<view_shape>("shape");
    return s;
  }
  // Of a view in the mode of features: the places of one or three; of none, principal directions.
  std::optional<std::vector<int>> features(view_mode mode) {
    std::vector<int> places;
    if (json const* const list = find("features"); list && !list->is_null()) {
      if (!list->is_array() || (list->size() != 1 && list->size() != 3)) refuse("features", "is not a list of 1 or 3");
      for (json const& one : *list) {
        double const place = in_range(one, "features", 0, most_features - 1);
        if (place != std::floor(place)) refuse("features", "holds a number that is not whole");
        places.push_back(static_cast<int>(place));
      }
    }
    return mode == view_mode::features ? std::optional(places) : std::nullopt;
  }
  std::optional<int> photo() {
    json const* const index = find("photo");
    return index && !index->is_null() ? std::optional(whole("photo", 0, 1 << 24)) : std::nullopt;
  }
  std::vector<double> times() {
    std::vector<double> out;
    json const* const list = find("times");
    if (!list || list->is_null()) return out;
    if (!list->is_array()) refuse("times", "is not a list of numbers");
    for (json const& one : *list) out.push_back(in_range(one, "times", 0, 1e6));
    return out;
  }
  void done() const {
    for (auto const& [key, value] : object_.items()) {
      bool known = key == "type";
      for (char const* one : asked_) known = known || key == one;
      if (!known) refuse(key.substr(0, 40), "is no field of this message");
    }
  }

 private:
  json const& object_;
  std::vector<char const*> asked_;
};

json object_in(std::string_view text) {
  if (text.size() > message_bytes) throw invalid_argument("the message is longer than 16384 bytes");
  int deepest = 0;
  // Nothing below the depth is kept, so that what is nested without end costs no stack.
  auto const keep = [&](int depth, json::parse_event_t, json&) {
    deepest = std::max(deepest, depth);
    return depth <= message_depth;
  };
  json const root = json::parse(text.begin(), text.end(), keep, false);
  if (root.is_discarded() && deepest <= message_depth) throw invalid_argument("the message is not valid JSON");
  if (deepest > message_depth) throw invalid_argument("the message is nested too deep");
  if (!root.is_object()) throw invalid_argument("the message is not a JSON object");
  return root;
}

}  // namespace

client_message parse_message(std::string_view text) {
  json const root = object_in(text);
  fields f(root);
  std::string const type = f.text("type");
  client_message out;
  if (type == "view") {
    view_message m;
    m.id = f.id(), m.view = f.view("camera"), m.mode = f.name<view_mode>("mode"), m.moving = f.flag("moving");
    m.settings = f.settings(), m.photo = f.photo(), m.settings.features = f.features(m.mode);
    out = m;
  } else if (type == "image") {
    image_message m;
    m.id = f.id(), m.view = f.view("camera", image_size_most), m.mode = f.name<view_mode>("mode");
    if (static_cast<double>(m.view.width) * m.view.height > image_pixels_most)
      refuse("camera", "has more than " + std::to_string(image_pixels_most) + " pixels");
    m.settings = f.settings(), m.photo = f.photo(), m.settings.features = f.features(m.mode);
    out = m;
  } else if (type == "pick") {
    pick_message m;
    m.id = f.id(), m.view = f.view("camera");
    m.x = static_cast<float>(f.number("x", 0, m.view.width)), m.y = static_cast<float>(f.number("y", 0, m.view.height));
    m.settings = f.settings();
    out = m;
  } else if (type == "path") {
    path_message m;
    m.id = f.id(), m.frames = f.whole("frames", 2, path_frames_most), m.closed = f.flag("closed");
    json const& list = f.at("keyframes");
    if (!list.is_array() || list.size() < 2) refuse("keyframes", "is not a list of 2 cameras or more");
    for (std::size_t i = 0; i < list.size(); ++i)
      m.keyframes.push_back(fields::camera_of(list[i], "keyframes[" + std::to_string(i) + "]"));
    m.times = f.times();
    out = m;
  } else if (type == "model") {
    out = model_message{f.whole("index", 0, 1 << 24)};
  } else if (type == "part") {
    part_edit e;
    e.index = f.whole("index", 0, 1 << 24);
    if (json const* const place = f.find("place")) e.place = fields::point(*place, "place");
    if (f.find("material")) {
      e.material = f.text("material");
      if (*e.material != "own") f.name<light::material_kind>("material");
    }
    if (json const* const color = f.find("color")) {
      e.color = fields::point(*color, "color");
      for (int k = 0; k < 3; ++k) fields::in_range((*color)[static_cast<std::size_t>(k)], "color", 0, 1e12);
    }
    if (json const* const rotation = f.find("rotation")) {
      e.rotation = fields::numbers<4>(*rotation, "rotation", 1e9);
      auto const [w, x, y, z] = *e.rotation;
      if (!(w * w + x * x + y * y + z * z > 1e-12)) refuse("rotation", "is all zero");
    }
    if (json const* const scale = f.find("scale")) {
      auto const [x, y, z] = fields::numbers<3>(*scale, "scale", 1e9);
      e.scale = vec3d(x, y, z);
      if (!(std::min({std::fabs(x), std::fabs(y), std::fabs(z)}) >= 1e-9)) refuse("scale", "has a zero");
    }
    if (json const* const about = f.find("about")) e.about = fields::point(*about, "about");
    out = part_message{e};
  } else if (type == "train") {
    out = train_message{f.name<train_action>("action")};
  } else if (type == "share") {
    out = share_message{f.number("value", 0.01, 1)};
  } else {
    refuse("type", "is none of view, image, pick, path, model, part, train, share");
  }
  f.done();
  return out;
}

}  // namespace gart
