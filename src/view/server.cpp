// The thread that renders: what each client is given for what it asked.

#include "clients.hpp"
#include "parts.hpp"
#include "sockets.hpp"

#include <gart/camera/models.hpp>
#include <gart/io/image_file.hpp>
#include <gart/view/camera_path.hpp>
#include <gart/view/image_modes.hpp>
#include <gart/view/server.hpp>

#include <chrono>
#include <tuple>

namespace gart {

namespace {

using clock = std::chrono::steady_clock;
using view::in_parts;
using view::parts_of;
using view::seconds_now;

constexpr int quality_moving = 80, quality_still = 95;

char const* type_of(view_message const&) { return "view"; }
char const* type_of(image_message const&) { return "image"; }
char const* type_of(pick_message const&) { return "pick"; }
char const* type_of(path_message const&) { return "path"; }

// A camera whose middle pixel is the image point, and the pixel that it lies in. The whole sphere has no such part: it
// is shown whole and small.
struct pick_place {
  camera view;
  int x, y;
};
pick_place place_of(pick_message const& pick) {
  camera c = pick.view;
  if (c.kind == camera_kind::equirectangular) {
    c = resized(c, std::min(c.width, 1024), std::min(c.height, 512));
    auto const pixel = [](float at, int from, int to) {
      return std::min(to - 1, static_cast<int>(at * static_cast<float>(to) / static_cast<float>(from)));
    };
    return {c, pixel(pick.x, pick.view.width, c.width), pixel(pick.y, pick.view.height, c.height)};
  }
  constexpr int side = 9;
  c.cx += 0.5f * side - pick.x, c.cy += 0.5f * side - pick.y;
  c.width = c.height = side;
  return {c, side / 2, side / 2};
}

}  // namespace

struct view_server::state {
  view_server_options options;
  view::clients all;
  view::sockets listener;
  struct {
    int client = 0;
    u64 serial = 0;
  } grown;  // the view that the renderer has samples of

  state(view_scene scene, view_server_options const& o)
      : options(o), all(std::move(scene), options), listener(all, options) {}

  // What is shown of a view, in parts where it takes long; none where nobody waits for it any more.
  template <class Message>
  std::optional<shown_image> seen(view::job const& j, Message const& m, camera const& view, view_render const& render) {
    std::optional<image8> photo;
    if (m.mode == view_mode::error && m.photo && options.photo) photo = options.photo(*m.photo);
    double const ms = all.expected_ms(static_cast<double>(view.width) * view.height);
    auto const parts = parts_of(view.height, render.in_parts ? ms : 0);
    auto const wanted = [&] { return all.waited_for(j); };
    if (m.mode == view_mode::colour && render.colours) {
      auto image = in_parts(parts, wanted, m.settings, [&](view_settings const& s) { return render.colours(view, s); });
      return image ? std::optional(shown_image{std::move(*image)}) : std::nullopt;
    }
    auto const all_of_it =
        in_parts(parts, wanted, m.settings, [&](view_settings const& s) { return render.images(view, s); });
    if (!all_of_it) return {};
    shown_image out = shown(*all_of_it, view, m.mode, photo ? &*photo : nullptr,
                            m.settings.background.value_or(all.scene()->background));
    if (m.mode == view_mode::features && render.feature_range)
      std::tie(out.low, out.high) = render.feature_range(m.settings);
    return out;
  }

  void answer(view::job const& j, view_message const& asked, view_render const& render) {
    view_message m = asked;
    bool const grows = m.mode == view_mode::colour && render.samples;
    bool const goes_on = j.more && grown.client == j.client && grown.serial == j.serial;
    m.settings.effort = !j.still ? view_effort::draft : goes_on ? view_effort::more : view_effort::begun;
    camera const view = j.still ? m.view : resized(m.view, j.width, j.height);
    auto const start = clock::now();
    auto const image = seen(j, m, view, render);
    if (!image) return;
    std::vector<u8> const jpeg = encode_jpeg(image->image, j.still ? quality_still : quality_moving);
    double const ms = std::chrono::duration<double, std::milli>(clock::now() - start).count();
    frame_header header{m.id, view.width, view.height, m.view.width, m.view.height, m.mode,
                        ms,   j.still,    false,       image->low,   image->high};
    if (grows) std::tie(header.samples, header.samples_of) = render.samples();
    bool const unfinished = j.still && header.samples < header.samples_of;
    header.still = j.still && !unfinished;
    if (unfinished) grown = {j.client, j.serial};
    all.finish_frame(j, frame_bytes(header, jpeg), grows && j.still ? 0 : ms, unfinished);
  }

  void answer(view::job const& j, image_message const& asked, view_render const& render) {
    image_message m = asked;
    auto const start = clock::now();
    auto image = seen(j, m, m.view, render);
    frame_header header{m.id, m.view.width, m.view.height, m.view.width, m.view.height, m.mode, 0, true, true};
    while (image && m.mode == view_mode::colour && render.samples) {
      std::tie(header.samples, header.samples_of) = render.samples();
      if (header.samples >= header.samples_of) break;
      m.settings.effort = view_effort::more;
      image = all.waited_for(j) ? seen(j, m, m.view, render) : std::nullopt;
    }
    if (!image) return;
    std::vector<u8> const png = encode_png(image->image);
    header.milliseconds = std::chrono::duration<double, std::milli>(clock::now() - start).count();
    header.low = image->low, header.high = image->high;
    all.finish_image(j, frame_bytes(header, png));
  }

  void answer(view::job const& j, pick_message const& m, view_render const& render) {
    pick_place const at = place_of(m);
    image_float const distances = mean_distances(render.images(at.view, m.settings));
    float const t = distances.at(at.x, at.y, 0);
    ray const through = ray_through(m.view, m.x, m.y);
    vec3d point = m.view.position;
    for (int k = 0; k < 3; ++k) point[k] += double{through.origin[k]} + double{t} * double{through.direction[k]};
    all.send(j.client, picked_text(m.id, t, point));
  }

  void answer(view::job const& j, path_message const& m, view_render const&) {
    all.send(j.client, path_text(m.id, smooth_path(m.keyframes, m.frames, m.closed, m.times)));
  }
};

view_server::view_server(view_scene scene, view_server_options options)
    : state_(std::make_unique<state>(std::move(scene), options)) {}
view_server::~view_server() = default;

std::string view_server::control_address() const { return state_->listener.address(view::access_right::control); }
std::string view_server::view_address() const { return state_->listener.address(view::access_right::view); }
int view_server::port() const { return state_->listener.port(); }
int view_server::clients() const noexcept { return state_->all.count(); }
bool view_server::idle() const noexcept { return state_->all.idle(); }

double view_server::render_next(view_render const& render, double wait_seconds) {
  auto const job = state_->all.next_job(seconds_now(), wait_seconds);
  if (!job) return 0;
  double const start = seconds_now();
  if (!job->more) state_->grown = {};
  try {
    std::visit([&](auto const& message) { state_->answer(*job, message, render); }, job->wanted);
  } catch (std::exception const& e) {
    std::visit(
        [&](auto const& message) { state_->all.send(job->client, error_text(e.what(), type_of(message), message.id)); },
        job->wanted);
  }
  return seconds_now() - start;
}

void view_server::set_status(view_status const& status) { state_->all.set_status(status); }
void view_server::set_curve(view_curve const& curve) { state_->all.set_curve(curve); }
std::optional<train_action> view_server::next_action() { return state_->all.next_action(); }
void view_server::set_scores(std::vector<std::pair<int, double>> const& scores) { state_->all.set_scores(scores); }
void view_server::tell(std::string const& note) { state_->all.send_all(note_text(note)); }
void view_server::tell_at_end(std::string why) { state_->all.set_end(std::move(why)); }
void view_server::set_scene(view_scene scene) { state_->all.set_scene(std::move(scene)); }
std::optional<int> view_server::next_model() { return state_->all.next_model(); }
std::optional<part_edit> view_server::next_edit() { return state_->all.next_edit(); }
std::optional<added_file> view_server::next_file() { return state_->all.next_file(); }
void view_server::set_parts(std::vector<view_part> parts, std::string scene_json) {
  state_->all.set_parts(std::move(parts), std::move(scene_json));
}
std::optional<double> view_server::next_share() { return state_->all.next_share(); }

}  // namespace gart
