// gart's camera JSON, there and back; a camera's model and lens in JSON of any kind.

#include "bytes.hpp"
#include "camera_formats.hpp"
#include "capture.hpp"
#include "json_checks.hpp"

#include <gart/io/camera_file.hpp>

#include <algorithm>
#include <set>

namespace gart::io {
namespace fs = std::filesystem;

std::vector<u8> with_words_quoted(std::vector<u8> const& bytes) {
  std::vector<u8> out;
  out.reserve(bytes.size() + bytes.size() / 8);
  std::string_view rest(reinterpret_cast<char const*>(bytes.data()), bytes.size());
  bool in_text = false;
  while (!rest.empty()) {
    std::size_t taken = 1;
    bool quoted = false;
    if (in_text && rest[0] == '\\') {
      taken = std::min<std::size_t>(2, rest.size());
    } else if (rest[0] == '"') {
      in_text = !in_text;
    } else if (!in_text) {
      for (std::string_view const word : {"NaN", "Infinity", "-Infinity"})
        if (rest.starts_with(word)) taken = word.size(), quoted = true;
    }
    if (quoted) out.push_back('"');
    out.insert(out.end(), rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(taken));
    if (quoted) out.push_back('"');
    rest.remove_prefix(taken);
  }
  return out;
}

camera_format const* camera_model_of(record const& r, char const* otherwise) {
  std::string const name = r.has("camera_model") ? r.text("camera_model") : otherwise;
  camera_format const* const model = camera_format_of(name);
  if (!model || !model->kind) {
    throw unsupported(r.where + ": the camera model is " + name.substr(0, 60) + "; gart traces " +
                      traced_camera_formats() + " (undistort the capture)");
  }
  return model;
}

namespace {
// The coefficients of a polynomial are 0 where a file does not give them.
bool has_polynomial(camera_kind kind) {
  return kind == camera_kind::perspective || kind == camera_kind::fisheye || kind == camera_kind::fisheye624;
}
}  // namespace

void read_lens_members(record const& r, camera_format const& model, camera& view) {
  if (view.kind == camera_kind::equirectangular) return;
  // Captures write all of a pinhole's terms, and name any of its models.
  camera_format const& form =
      view.kind == camera_kind::perspective && model.number != 6 ? *camera_format_of("PERSPECTIVE") : model;
  for (int k = 0; k < form.parameters(); ++k) {
    if (is_pinhole_member(form.member(k))) continue;
    std::string const key(form.field(k));
    set_member(view, form.member(k), has_polynomial(view.kind) ? r.number_or(key.c_str(), 0) : r.number(key.c_str()));
  }
  for (char const* key : {"k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"})
    if (!form.has(key) && r.number_or(key, 0) != 0)
      throw unsupported(r.where + ": '" + key + "' is not zero, and " + std::string(model.name) +
                        " has no such term (correct camera_model, or undistort the capture)");
}

namespace {

struct shutter_name {
  shutter_kind kind;
  char const* name;  // 3dgrut's and gsplat's
};
constexpr shutter_name shutter_names[] = {{shutter_kind::global, "GLOBAL"},
                                          {shutter_kind::top_to_bottom, "ROLLING_TOP_TO_BOTTOM"},
                                          {shutter_kind::left_to_right, "ROLLING_LEFT_TO_RIGHT"},
                                          {shutter_kind::bottom_to_top, "ROLLING_BOTTOM_TO_TOP"},
                                          {shutter_kind::right_to_left, "ROLLING_RIGHT_TO_LEFT"}};

}  // namespace

void read_shutter(record const& r, char const* key, bool opengl_axes, camera& view) {
  std::string const end = std::string("'") + key + "'";
  if (!r.has("shutter_type")) {
    if (r.has(key))
      throw io_error(r.where, end + " is there, and 'shutter_type' is missing",
                     "say which way the image is read, as ROLLING_TOP_TO_BOTTOM");
    return;
  }
  std::string const name = r.text("shutter_type");
  auto const* const found = std::find_if(std::begin(shutter_names), std::end(shutter_names),
                                         [&](shutter_name const& s) { return name == s.name; });
  if (found == std::end(shutter_names)) {
    throw io_error(r.where, "'shutter_type' is " + name.substr(0, 60),
                   "write one of " + joined(shutter_names, [](shutter_name const& s) { return s.name; }));
  }
  if (found->kind == shutter_kind::global) return;
  if (!r.has(key))
    throw io_error(r.where, end + " is missing", "add the pose of the last line that is read: the shutter is " + name);
  if (!view.width || !view.height)
    throw io_error(r.where, "'w' and 'h' are missing", "add them: with a rolling shutter each line has a pose");
  camera last = view;
  read_pose(r, key, opengl_axes, last);
  if (last.position == view.position && last.rotation == view.rotation)
    throw io_error(r.where, end + " is the pose of the first line too: nothing moves while the image is read",
                   "correct it, or make 'shutter_type' GLOBAL");
  camera const first = view;
  view.shutter = found->kind;
  if (shutter_lines(view) < 2)
    throw io_error(r.where, "the image has one line, and a rolling shutter", "make 'shutter_type' GLOBAL");
  view = rolling_between(first, last, found->kind);
}

bool is_json_list(fs::path const& file) {
  for (u8 byte : read_file(file)) {
    if (byte == '[') return true;
    if (!is_space(static_cast<char>(byte)) && byte < 0x80) return false;  // a byte order mark may come first
  }
  return false;
}

bool looks_like_camera(json const& value) {
  if (!value.is_object() || value.contains("frames")) return false;
  return value.contains("c2w") || value.contains("fx") || (value.contains("position") && value.contains("rotation"));
}

namespace {

// 3DGS' cameras.json: the middle of the image for cx and cy, and the pose in two parts.
void read_position_and_rotation(record const& r, camera& view) {
  json rows = json::array();
  json const &position = r.at("position"), &rotation = r.at("rotation");
  for (std::size_t i = 0; i < 3; ++i) {
    json row = rotation.is_array() && rotation.size() == 3 ? rotation[i] : json();
    if (!row.is_array() || row.size() != 3 || !position.is_array() || position.size() != 3)
      throw io_error(r.where, "'rotation' and 'position' are not 3 x 3 and 3 numbers", "export it again");
    row.push_back(position[i]);
    rows.push_back(std::move(row));
  }
  json const whole = {{"rotation", rows}};
  read_pose({whole, nullptr, r.where}, "rotation", false, view);
}

// Other programs' cameras have fields of their own. One within two letters of this is meant for it.
void refuse_misspelt(record const& r, char const* key) {
  if (r.has(key)) return;
  for (auto const& [name, value] : r.own.items())
    if (name != key && letters_between(name, key) <= 2)
      throw io_error(r.where, "has no field '" + name.substr(0, 60) + "'" + did_you_mean(name, {key}), "correct it");
}

named_camera camera_of(record const& r) {
  for (char const* key : {"camera_model", "shutter_type"}) refuse_misspelt(r, key);
  named_camera c;
  c.view.width = r.size("width"), c.view.height = r.size("height");
  camera_format const* const model = camera_model_of(r, "PINHOLE");
  c.view.kind = *model->kind;
  if (c.view.kind != camera_kind::equirectangular)
    for (char const* key : {"fx", "fy", "cx", "cy"}) {
      bool const middle = !r.has("c2w") && r.has("position") && !r.has(key) && key[0] == 'c';
      set_member(c.view, key, middle ? 0.5 * (key[1] == 'x' ? c.view.width : c.view.height) : r.number(key));
    }
  read_lens_members(r, *model, c.view);
  if (!r.has("c2w") && r.has("position"))
    read_position_and_rotation(r, c.view);
  else
    read_pose(r, "c2w", false, c.view);
  read_shutter(r, "c2w_end", false, c.view);
  c.view.position += three(r, "origin", vec3d(0.0), -1e18, 1e18);
  check_camera(c.view, r.where);
  return c;
}

json object_of(named_camera const& c) {
  camera const& v = c.view;
  camera_fields const fields = fields_of(v);
  json one = {{"name", c.name}, {"width", v.width}, {"height", v.height}};
  if (fields.model != "PINHOLE") one["camera_model"] = fields.model;
  for (auto const& [key, value] : fields.values) one[key] = value;
  auto const pose = [](camera const& at) {
    json rows = json::array();
    for (int i = 0; i < 3; ++i)
      rows.push_back({at.rotation[0][i], at.rotation[1][i], at.rotation[2][i], at.position[i]});
    rows.push_back({0, 0, 0, 1});
    return rows;
  };
  if (v.shutter == shutter_kind::global) {
    one["c2w"] = pose(v);
  } else {
    line_poses const lines = poses_of_lines(v);
    one["shutter_type"] = shutter_type_of(v);
    one["c2w"] = pose(lines.first), one["c2w_end"] = pose(lines.last);
  }
  return one;
}

}  // namespace

std::vector<named_camera> read_camera_json(fs::path const& file) {
  json const root = read_json(file);
  std::vector<named_camera> cameras;
  for (std::size_t i = 0; i < root.size(); ++i) {
    record const r{root[i], nullptr, file.string() + ", camera " + std::to_string(i)};
    if (!r.own.is_object()) throw io_error(r.where, "is not a JSON object", "write {\"name\", \"width\", ...}");
    std::string const name = r.text(!r.has("name") && r.has("img_name") ? "img_name" : "name");
    cameras.push_back(camera_of(r));
    cameras.back().name = name;
  }
  if (cameras.empty()) throw io_error(file.string(), "holds no camera", "add one");
  std::vector<std::string*> names;
  for (named_camera& c : cameras) names.push_back(&c.name);
  make_file_names(names);
  return cameras;
}

}  // namespace gart::io

namespace gart {

camera_fields fields_of(camera const& view) {
  io::camera_format const& model = io::camera_format_for(view);
  camera_fields out{std::string(model.name), {}};
  for (int k = 0; k < model.parameters(); ++k)
    if (view.kind != camera_kind::equirectangular)
      out.values.emplace_back(model.field(k), io::member_of(view, model.member(k)));
  return out;
}

std::string shutter_type_of(camera const& view) {
  for (io::shutter_name const& s : io::shutter_names)
    if (s.kind == view.shutter) return s.name;
  return {};
}

namespace {

// The focal length at which a lens sees so many degrees across the image's shorter side.
float focal_length_by(double angle, camera const& c, std::string const& where) {
  bool const flat = c.kind == camera_kind::perspective;
  if (!(angle > 0 && (flat ? angle < 180 : angle <= 360)))
    throw invalid_argument(
        where + ": the angle " + io::json(angle).dump() + " is not " +
        (flat ? "between 0 and 180 (correct it, or take a FISHEYE)" : "above 0, up to 360 (correct it)"));
  constexpr double furthest = 1e6;  // focal lengths from the axis
  double q, slope, value, ignored;
  lens_curve const curve(c.kind, c.lens);
  curve.curve(angle * 3.141592653589793 / 360, q, slope);
  curve.radial(q * q, value, ignored);
  if (!(slope > 0 && q * value > 0 && q * value < furthest))
    throw invalid_argument(where + ": the lens does not see " + io::json(angle).dump() +
                           " degrees (give a smaller angle, or fx)");
  return static_cast<float>(0.5 * std::min(c.width, c.height) / (q * value));
}

// Refuses one that leaves out a parameter which has no default.
void require_lens_members(io::camera_format const& model, std::set<std::string_view> const& given,
                          std::string const& where) {
  if (*model.kind == camera_kind::equirectangular || io::has_polynomial(*model.kind)) return;
  for (int k = 0; k < model.parameters(); ++k) {
    std::string const field(model.field(k));
    if (!io::is_pinhole_member(field) && !given.contains(model.field(k)))
      throw invalid_argument(where + ": '" + field + "' is missing (add " + field + "=NUMBER)");
  }
}

}  // namespace

camera seen_through(camera const& view, std::string const& text) {
  std::string const name = text.substr(0, text.find(',')), where = "camera " + text;
  io::camera_format const* const model = io::camera_format_of(name);
  if (!model || !model->kind) throw unsupported(where + ": gart traces " + io::traced_camera_formats());
  camera c;
  c.kind = *model->kind;
  c.width = view.width, c.height = view.height, c.position = view.position, c.rotation = view.rotation;
  if (c.kind == camera_kind::equirectangular) c.width = 2 * c.height;
  bool const parallel = c.kind == camera_kind::orthographic;
  bool const wide = c.kind != camera_kind::perspective && c.kind != camera_kind::division;
  double angle = wide ? 180 : 60, extent = 0;
  c.cx = 0.5f * static_cast<float>(c.width), c.cy = 0.5f * static_cast<float>(c.height);
  std::set<std::string_view> given;
  for (std::size_t at = name.size(); at < text.size();) {
    std::string const pair = text.substr(at + 1, text.find(',', at + 1) - at - 1);
    std::string const key = pair.substr(0, pair.find('='));
    double value = 0;
    if (pair.find('=') == pair.npos || !io::parse_number(std::string_view(pair).substr(key.size() + 1), value))
      throw invalid_argument(where + ": '" + pair + "' is not NAME=NUMBER");
    bool known = key == (parallel ? "extent" : "angle");
    if (known) (parallel ? extent : angle) = value;
    for (int k = 0; k < model->parameters(); ++k)
      if (model->field(k) == key)
        io::set_member(c, model->member(k), value), given.insert(model->field(k)), known = true;
    if (!known)
      throw invalid_argument(where + ": " + name + " has no '" + key + "' (it has " + std::string(model->fields) + ")");
    at += 1 + pair.size();
  }
  require_lens_members(*model, given, where);
  bool const has_focal = given.contains("f") || given.contains("fx");
  if (parallel && !has_focal) {
    if (!(extent > 0))
      throw invalid_argument(where +
                             ": give extent=UNITS, what it sees across the image's shorter side, or fx, the "
                             "pixels a world unit");
    c.fx = static_cast<float>(std::min(c.width, c.height) / extent);
  } else if (c.kind != camera_kind::equirectangular && !has_focal) {
    c.fx = focal_length_by(angle, c, where);
  }
  if (!given.contains("fy")) c.fy = c.fx;
  io::check_camera(c, where);
  return c;
}

std::string camera_json(named_camera const& camera) {
  return io::object_of(camera).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

named_camera parse_camera_json(std::string_view object, std::string const& where) {
  io::json root;
  try {
    root = io::json::parse(object);
  } catch (io::json::exception const& e) {
    throw io_error(where, "is not valid JSON: " + json_fault_of(e.what()).what, "write {\"width\", ...}");
  }
  io::record const r{root, nullptr, where};
  if (!r.own.is_object()) throw io_error(where, "is not a JSON object", "write {\"width\", ...}");
  named_camera c = io::camera_of(r);
  if (r.has("name")) c.name = r.text("name");
  return c;
}

void write_cameras(std::filesystem::path const& path, std::vector<named_camera> const& cameras) {
  using nlohmann::json;
  json out = json::array();
  for (named_camera const& c : cameras) out.push_back(io::object_of(c));
  write_file(path, out.dump(1, ' ', false, json::error_handler_t::replace) + "\n");
}

}  // namespace gart
