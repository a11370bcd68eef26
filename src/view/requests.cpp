#include "requests.hpp"

#include "page.hpp"

#include <gart/core/words.hpp>
#include <gart/io/image_file.hpp>

#include <algorithm>
#include <charconv>
#include <iterator>

namespace gart::view {

namespace {

// What a scene takes: one file each, which names no others.
constexpr char const* added_endings[] = {".glb", ".obj", ".ply", ".hdr", ".exr"};
constexpr int thumbnail_side = 192;  // pixels, at most, of the longer side

image8 opaque(image8 const& image, vec3 background) {
  if (image.channels != 4) return image;
  image8 out(image.width, image.height, 3);
  for (std::size_t p = 0; p < out.data.size() / 3; ++p) {
    float const alpha = static_cast<float>(image.data[4 * p + 3]) / 255;
    for (std::size_t k = 0; k < 3; ++k)
      out.data[3 * p + k] = static_cast<u8>(alpha * static_cast<float>(image.data[4 * p + k]) +
                                            (1 - alpha) * 255 * background[static_cast<int>(k)] + 0.5f);
  }
  return out;
}

image8 small(image8 const& image) {
  int const side = std::max(image.width, image.height), factor = (side + thumbnail_side - 1) / thumbnail_side;
  return factor > 1 && factor <= std::min(image.width, image.height) ? box_downscale(image, factor) : image;
}

}  // namespace

std::vector<std::string> requests::safe_headers(http_request const& asked) const {
  std::string const host(asked.header("host"));
  std::string const socket = gate_.host_is_ours(host) ? " ws://" + host + " wss://" + host : std::string();
  return {"content-security-policy: default-src 'self'; img-src 'self' blob:; connect-src 'self'" + socket,
          "x-content-type-options: nosniff",
          "referrer-policy: no-referrer",
          "cache-control: no-store",
          "cross-origin-resource-policy: same-origin",
          "x-frame-options: DENY"};
}

// Whether the request is from a page of ours, or from none.
bool requests::from_here(http_request const& asked, bool origin_required) const {
  std::string_view const host = asked.header("host"), origin = asked.header("origin");
  if (!gate_.host_is_ours(host)) return false;
  return origin.empty() ? !origin_required : gate_.origin_is_ours(origin, host);
}

// "photo/INDEX.jpg" or, small, "thumb/INDEX.jpg"; empty where there is none.
std::vector<u8> requests::photograph(std::string_view name) const {
  bool const thumb = name.starts_with("thumb/");
  if (!(thumb || name.starts_with("photo/")) || !name.ends_with(".jpg") || !options_.photo) return {};
  std::string_view const number = name.substr(6, name.size() - 10);
  int index = 0;
  auto const [end, wrong] = std::from_chars(number.data(), number.data() + number.size(), index);
  auto const scene = all_.scene();
  if (wrong != std::errc() || end != number.data() + number.size() || index < 0 ||
      index >= static_cast<int>(scene->cameras.size()) || !scene->cameras[static_cast<std::size_t>(index)].photo)
    return {};
  image8 const image = options_.photo(index);
  return encode_jpeg(opaque(thumb ? small(image) : image, scene->background), thumb ? 80 : 90);
}

http_answer requests::answer(http_request const& asked) const {
  auto const refusal = [](int status, std::string const& why, std::string const& log = {}) {
    return http_answer{status, "text/plain; charset=utf-8", std::to_string(status) + ": " + why + "\n", log};
  };
  request_path const path = gate_.path_of(asked.path);
  if (path.of == access_right::none)
    return refusal(403, "not the address that gart printed", "403: a request with another token");
  if (!from_here(asked, false))
    return refusal(403, "this host is none that the viewer answers to; what lets it in stands where gart runs",
                   "403: a request for the host '" + std::string(asked.header("host")) + "' from the origin '" +
                       std::string(asked.header("origin")) +
                       "' (view_server_options.allowed_hosts = NAME lets a host in)");
  if (asked.method != "GET") return refusal(405, "GET alone");
  std::string const name = path.rest.empty() ? "index.html" : path.rest.substr(0, path.rest.find('?'));
  if (page_file const* const file = find_page_file(name))
    return {200, content_type_of(name), std::string(reinterpret_cast<char const*>(file->bytes), file->size), {}};
  if (auto const scene = all_.scene(); name == "scene.json" && !scene->scene_json.empty())
    return {200, "application/json", scene->scene_json, {}};
  try {
    std::vector<u8> const jpeg = photograph(name);
    if (!jpeg.empty()) return {200, "image/jpeg", std::string(jpeg.begin(), jpeg.end()), {}};
  } catch (std::exception const& e) {
    return refusal(404, "this photograph cannot be read", "a photograph could not be sent: " + std::string(e.what()));
  }
  return refusal(404, "there is no such file");
}

// The name of a file as its sender has it, without a folder.
std::string requests::sent_name(http_request const& asked) const {
  std::string const coded = gate_.path_of(asked.path).rest.substr(std::string_view("add/").size());
  std::string name;
  for (std::size_t i = 0; i < coded.size(); ++i) {
    unsigned value = 0;
    bool const is_code = coded[i] == '%' && i + 2 < coded.size() &&
                         std::from_chars(&coded[i + 1], &coded[i + 1] + 2, value, 16).ptr == &coded[i + 1] + 2;
    name += is_code ? static_cast<char>(value) : coded[i];
    if (is_code) i += 2;
  }
  name = name.substr(name.find_last_of("/\\") + 1);
  std::erase_if(name, [](unsigned char c) { return c < ' ' || c == 0x7f; });
  return name.size() > 100 ? name.substr(name.size() - 100) : name;
}

http_answer requests::may_send(http_request const& asked) const {
  auto const refusal = [](int status, std::string const& why) {
    return http_answer{status, "text/plain; charset=utf-8", why + "\n", {}};
  };
  request_path const path = gate_.path_of(asked.path);
  if (path.of == access_right::none || !from_here(asked, true)) return refusal(403, "403: not let in");
  if (path.of != access_right::control) return refusal(403, "this address may look, and not control");
  if (!path.rest.starts_with("add/")) return refusal(405, "files are sent to add/NAME");
  if (!all_.scene()->traced) return refusal(403, "there is no scene to add to");
  std::string const name = lower(sent_name(asked));
  if (std::none_of(std::begin(added_endings), std::end(added_endings),
                   [&](char const* e) { return name.ends_with(e); }))
    return refusal(415, "a scene takes .glb, .obj and .ply meshes and .hdr and .exr images");
  if (asked.body_bytes == 0) return refusal(400, "the file is empty");
  if (asked.body_bytes > added_bytes_most)
    return refusal(413, "the file is larger than " + std::to_string(added_bytes_most >> 20) + " MiB");
  if (all_.file_waits()) return refusal(503, "another file is on its way: send this one again in a moment");
  return {202, "text/plain; charset=utf-8", "taken\n", {}};
}

int requests::upgrade(http_request const& asked) const {
  request_path const path = gate_.path_of(asked.path);
  if (path.of == access_right::none || path.rest != "socket" || !from_here(asked, true)) return 403;
  bool const known = asked.method == "GET" && asked.lists("upgrade", "websocket") &&
                     asked.lists("connection", "upgrade") && asked.header("sec-websocket-version") == "13" &&
                     asked.header("sec-websocket-key").size() == 24 &&
                     asked.header("sec-websocket-protocol") == "gart-view";
  return known ? 101 : 400;
}

}  // namespace gart::view
