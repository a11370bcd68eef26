// What the server says, as texts and bytes.

#include <gart/core/version.hpp>
#include <gart/io/camera_file.hpp>
#include <gart/view/message.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace gart {

namespace {

using nlohmann::json;

json list_of(auto const& v) { return {v[0], v[1], v[2]}; }

json object_of(camera const& view, std::string const& name) { return json::parse(camera_json({name, view})); }

std::string text_of(json const& value) { return value.dump(-1, ' ', false, json::error_handler_t::replace); }

json pairs_of(std::vector<std::pair<int, double>> const& points) {
  json list = json::array();
  for (auto const& [step, value] : points)
    if (std::isfinite(value)) list.push_back({step, value});
  return list;
}

json parts_of(std::vector<view_part> const& parts) {
  json list = json::array();
  for (view_part const& p : parts) {
    list.push_back({{"light", p.light}, {"name", p.name}, {"kind", p.kind}, {"place", list_of(p.place)}});
    if (p.light)
      list.back()["color"] = list_of(p.color);
    else
      list.back().update({{"min", list_of(p.low)},
                          {"max", list_of(p.high)},
                          {"rotation", p.rotation},
                          {"scale", {p.scale.x, p.scale.y, p.scale.z}}});
  }
  return list;
}

}  // namespace

std::string scene_text(std::vector<view_part> const& parts) {
  return text_of({{"type", "scene"}, {"parts", parts_of(parts)}});
}

std::string hello_text(view_scene const& scene, bool control) {
  vec3 const low = scene.bounds.low, high = scene.bounds.high, half = 0.5f * (high - low);
  json cameras = json::array();
  bool photos = false;
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    view_camera const& c = scene.cameras[i];
    photos = photos || c.photo;
    cameras.push_back(
        {{"index", i}, {"name", c.name}, {"test", c.test}, {"photo", c.photo}, {"camera", object_of(c.view, c.name)}});
  }
  auto const offered = [&](view_mode mode) {
    if (mode == view_mode::error) return photos && !scene.traced;
    if (mode == view_mode::features) return scene.features > 0 && !scene.traced;
    return mode != view_mode::hits || !scene.traced;
  };
  json modes = json::array();
  for (auto const& one : names_of(view_mode{}))
    if (offered(one.value)) modes.push_back(one.name);
  return text_of({{"type", "hello"},
                  {"version", 1},
                  {"gart", version},
                  {"right", control ? "control" : "view"},
                  {"model",
                   {{"name", scene.name},
                    {"gaussians", scene.gaussians},
                    {"sh_degree", scene.sh_degree},
                    {"kernel_degree", scene.kernel_degree},
                    {"features", scene.features},
                    {"min", list_of(low)},
                    {"max", list_of(high)},
                    {"center", list_of(low + half)},
                    {"up", list_of(scene.up)},
                    {"origin", list_of(scene.origin)},
                    {"extent", extent_of(scene)}}},
                  {"cameras", cameras},
                  {"modes", modes},
                  {"models", control ? scene.models : std::vector<std::string>()},
                  {"open", scene.model},
                  {"training", scene.training},
                  {"scene", scene.traced ? parts_of(scene.parts) : json()},
                  {"background", list_of(scene.background)}});
}

std::string status_text(view_status const& s) {
  return text_of({{"type", "status"},
                  {"step", s.step},
                  {"of", s.of},
                  {"loss", s.loss},
                  {"gaussians", s.gaussians},
                  {"seconds", s.seconds},
                  {"paused", s.paused},
                  {"steps_per_second", s.steps_per_second},
                  {"view_share", s.view_share}});
}

std::string curve_text(view_curve const& curve) {
  return text_of({{"type", "curve"}, {"loss", pairs_of(curve.loss)}, {"test", pairs_of(curve.test)}});
}

std::string picked_text(u64 id, float t, vec3d point) {
  bool const hit = t > 0 && std::isfinite(t);
  return text_of({{"type", "picked"},
                  {"id", id},
                  {"hit", hit},
                  {"t", hit ? t : 0.0f},
                  {"point", hit ? json{point[0], point[1], point[2]} : json{0, 0, 0}}});
}

std::string path_text(u64 id, std::vector<camera> const& cameras) {
  // Joined as text: a path has up to path_frames_most cameras.
  std::string text = "{\"type\":\"path\",\"id\":" + std::to_string(id) + ",\"cameras\":[";
  char name[32];
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    std::snprintf(name, sizeof name, "frame_%05zu", i);
    text += (i ? "," : "") + camera_json({name, cameras[i]});
  }
  return text + "]}";
}

std::string scores_text(std::vector<std::pair<int, double>> const& scores) {
  return text_of({{"type", "scores"}, {"psnr", pairs_of(scores)}});
}

std::string note_text(std::string_view what) { return text_of({{"type", "note"}, {"what", what}}); }
std::string refused_text(std::string_view what, std::string_view why) {
  return text_of({{"type", "refused"}, {"what", what}, {"why", why}});
}
std::string error_text(std::string_view what, std::string_view of, u64 id) {
  return text_of({{"type", "error"}, {"what", what}, {"of", of}, {"id", id}});
}
std::string bye_text(std::string_view why) { return text_of({{"type", "bye"}, {"why", why}}); }

std::vector<u8> frame_bytes(frame_header const& h, std::vector<u8> const& image) {
  std::string const header = text_of({{"type", h.file ? "image" : "frame"},
                                      {"id", h.id},
                                      {"width", h.width},
                                      {"height", h.height},
                                      {"full", {h.full_width, h.full_height}},
                                      {"mode", to_string(h.mode)},
                                      {"ms", h.milliseconds},
                                      {"still", h.still},
                                      {"samples", {h.samples, h.samples_of}},
                                      {"scale", {h.low, h.high}}});
  static_assert(std::endian::native == std::endian::little);
  u32 const length = static_cast<u32>(header.size());
  std::vector<u8> out(sizeof length + header.size() + image.size());
  std::memcpy(out.data(), &length, sizeof length);
  std::copy(header.begin(), header.end(), out.begin() + sizeof length);
  std::copy(image.begin(), image.end(), out.begin() + static_cast<std::ptrdiff_t>(sizeof length + header.size()));
  return out;
}

}  // namespace gart
