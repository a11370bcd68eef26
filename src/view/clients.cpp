#include "clients.hpp"

#include "websocket.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

namespace gart::view {

namespace {

// What waits for a client that reads nothing is bounded: answers, which may be long, and all texts.
constexpr std::size_t answers_most = 2, texts_most = 64, actions_most = 64;

}  // namespace

clients::clients(view_scene scene, view_server_options const& options)
    : options_(options), scene_(std::make_shared<view_scene const>(std::move(scene))) {}

std::shared_ptr<view_scene const> clients::scene() const {
  std::lock_guard const lock(mutex_);
  return scene_;
}

int clients::add(bool control) {
  std::lock_guard const lock(mutex_);
  int const id = next_id_++;
  client& c = clients_[id];
  c.control = control;
  c.texts.push_back(hello_text(*scene_, control));
  c.newest = newest_;
  counted();
  return id;
}

void clients::remove(int id) {
  std::lock_guard const lock(mutex_);
  clients_.erase(id);
  counted();
}

void clients::counted() {
  count_ = static_cast<int>(clients_.size());
  wishes_ = static_cast<int>(clients_.size() + actions_.size() + share_.has_value() + model_.has_value() +
                             edits_.size() + file_.has_value());
}

verdict clients::receive(int id, std::string_view text, double now) {
  client_message message;
  try {
    message = parse_message(text);
  } catch (invalid_argument const& e) {
    return {ws::policy_violation, e.what()};
  }
  std::lock_guard const lock(mutex_);
  client* const asking = find(id);
  if (!asking) return {};
  client& c = *asking;
  auto const index_in_range = [&](int i) { return i < static_cast<int>(scene_->cameras.size()); };
  auto const no_camera = verdict{ws::policy_violation, "'photo' is no camera of the scene"};
  auto const features_there = [&](view_settings const& s) {
    return !s.features ||
           std::all_of(s.features->begin(), s.features->end(), [&](int k) { return k < scene_->features; });
  };
  auto const no_feature = verdict{ws::policy_violation, "'features' is no feature of the model"};
  if (auto* const view = std::get_if<view_message>(&message)) {
    if (view->photo && !index_in_range(*view->photo)) return no_camera;
    if (!features_there(view->settings)) return no_feature;
    c.view = std::move(*view), c.view_time = now, c.dirty = true, c.still_done = c.growing = false, ++c.serial;
  } else if (auto* const image = std::get_if<image_message>(&message)) {
    if (image->photo && !index_in_range(*image->photo)) return no_camera;
    if (!features_there(image->settings)) return no_feature;
    c.image = std::move(*image);
  } else if (auto* const pick = std::get_if<pick_message>(&message)) {
    c.pick = std::move(*pick);
  } else if (auto* const path = std::get_if<path_message>(&message)) {
    c.path = std::move(*path);
  } else if (auto const* const model = std::get_if<model_message>(&message)) {
    bool const there = model->index < static_cast<int>(scene_->models.size());
    if (controls(c, "model", there, "there is no such model to open")) model_ = model->index;
  } else if (auto const* const part = std::get_if<part_message>(&message)) {
    part_edit const& e = part->edit;
    bool const there = e.index < static_cast<int>(scene_->parts.size());
    if (controls(c, "part", there, "there is no such part of the scene")) {
      part_edit& kept = edits_[e.index];
      kept.index = e.index;
      if (e.place) kept.place = e.place;
      if (e.material) kept.material = e.material;
      if (e.color) kept.color = e.color;
      if (e.rotation) kept.rotation = e.rotation;
      if (e.scale) kept.scale = e.scale;
      if (e.about) kept.about = e.about;
    }
  } else if (auto const* const train = std::get_if<train_message>(&message)) {
    if (controls(c, "train", scene_->training, "there is no training here") && actions_.size() < actions_most)
      actions_.push_back(train->action);
  } else if (auto const* const share = std::get_if<share_message>(&message)) {
    if (controls(c, "share", scene_->training, "there is no training here")) share_ = share->value;
  }
  counted();
  changed_.notify_all();
  return {};
}

// Whether a client may do what takes the right of control; it is told where not.
bool clients::controls(client& c, char const* what, bool possible, char const* else_why) const {
  if (c.control && possible) return true;
  c.texts.push_back(refused_text(what, c.control ? else_why : "this address may look, and not control"));
  return false;
}

bool clients::take_text(int id, std::string& to) {
  std::lock_guard const lock(mutex_);
  client* const taking = find(id);
  if (!taking) return false;
  client& c = *taking;
  if (!c.texts.empty()) {
    to = std::move(c.texts.front());
    c.texts.pop_front();
    changed_.notify_all();
    return true;
  }
  for (auto const which : newest_texts::all)
    if (to = std::exchange(c.newest.*which, {}); !to.empty()) return true;
  return false;
}

bool clients::take_frame(int id, std::vector<u8>& to, double now) {
  std::lock_guard const lock(mutex_);
  client* const c = find(id);
  if (!c) return false;
  if (!c->file.empty()) {
    to = std::exchange(c->file, {});
    return true;
  }
  if (c->frame.empty()) return false;
  to = std::exchange(c->frame, {});
  c->view_time = now;     // a moving page sends its next view when it has this frame
  changed_.notify_all();  // the next one may be rendered
  return true;
}

bool clients::waits(client const& c) {
  return !c.texts.empty() || !c.frame.empty() || !c.file.empty() ||
         std::any_of(std::begin(newest_texts::all), std::end(newest_texts::all),
                     [&](auto const which) { return !(c.newest.*which).empty(); });
}

bool clients::has_output(int id) const {
  std::lock_guard const lock(mutex_);
  client const* const c = find(id);
  return c && waits(*c);
}

bool clients::has_output() const {
  std::lock_guard const lock(mutex_);
  return std::any_of(clients_.begin(), clients_.end(), [](auto const& one) { return waits(one.second); });
}

bool clients::overflows(int id) const {
  std::lock_guard const lock(mutex_);
  client const* const c = find(id);
  return c && c->texts.size() > texts_most;
}

bool clients::at_rest(client const& c, double now) const {
  return !c.view->moving || now - c.view_time >= options_.rest_seconds;
}

int clients::moving(double now) const {
  int n = 0;
  for (auto const& [id, c] : clients_) n += c.view && c.frame.empty() && !at_rest(c, now);
  return n;
}

// Single requests come first, then moving views, then views at rest, which take longer. Their further samples follow,
// and files are last.
std::optional<job> clients::job_of(int id, client& c, double now, int urgency) {
  if (urgency == 0) {
    if (c.texts.size() >= answers_most) return {};
    if (c.pick) return job{id, *std::exchange(c.pick, {})};
    if (c.path) return job{id, *std::exchange(c.path, {})};
    return {};
  }
  if (urgency == 4 && c.image && c.file.empty()) return job{id, *std::exchange(c.image, {})};
  if (!c.view || !c.frame.empty()) return {};
  int const width = c.view->view.width, height = c.view->view.height;
  if (urgency == 1 && c.dirty && !at_rest(c, now)) {
    c.dirty = false;
    c.pacing.start_from(pacing_);
    auto const [w, h] = c.pacing.size(width, height, 1000 * options_.frame_seconds / std::max(1, moving(now)));
    return job{id, *c.view, c.serial, false, false, w, h};
  }
  if (urgency == 2 + c.growing && at_rest(c, now) && !c.still_done) {
    // One goes on to its end before the next: two in turn would begin anew each time.
    client const* const grown = find(last_grown_);
    if (c.growing && last_grown_ != id && grown && grown->growing) return {};
    c.dirty = false, c.still_done = true;
    return job{id, *c.view, c.serial, true, c.growing, width, height};
  }
  return {};
}

std::optional<job> clients::choose(double now) {
  for (int urgency = 0; urgency < 5; ++urgency) {
    // Each in turn, from the one after the last that was served.
    auto const first = clients_.upper_bound(last_served_);
    auto const serve = [&](auto from, auto to) -> std::optional<job> {
      for (auto i = from; i != to; ++i) {
        if (auto found = job_of(i->first, i->second, now, urgency)) {
          last_served_ = i->first;
          return found;
        }
      }
      return {};
    };
    if (auto found = serve(first, clients_.end())) return found;
    if (auto found = serve(clients_.begin(), first)) return found;
  }
  return {};
}

// Seconds until a view that moved comes to rest; infinite where none does.
double clients::next_rest(double now) const {
  double least = HUGE_VAL;
  for (auto const& [id, c] : clients_)
    if (c.view && c.frame.empty() && !c.still_done && !at_rest(c, now))
      least = std::min(least, c.view_time + options_.rest_seconds - now);
  return least;
}

std::optional<job> clients::next_job(double now, double wait_seconds) {
  using clock = std::chrono::steady_clock;
  auto const began = clock::now();
  std::unique_lock lock(mutex_);
  for (;;) {
    double const passed = std::chrono::duration<double>(clock::now() - began).count();
    if (!edits_.empty() || file_) return {};  // they come before the views that follow them
    if (auto found = choose(now + passed)) return found;
    double const left = std::min(wait_seconds - passed, next_rest(now + passed) + 1e-3);
    if (passed >= wait_seconds) return {};
    changed_.wait_for(lock, std::chrono::duration<double>(std::max(left, 1e-3)));
  }
}

bool clients::waited_for(job const& j) const {
  std::lock_guard const lock(mutex_);
  client const* const c = find(j.client);
  // One that moves is always followed by another: without it nothing would be seen.
  return c && (!j.still || c->serial == j.serial);
}

double clients::expected_ms(double pixels) const {
  std::lock_guard const lock(mutex_);
  return pacing_.rate() * pixels;
}

void clients::finish_image(job const& done, std::vector<u8> bytes) {
  {
    std::lock_guard const lock(mutex_);
    client* const c = find(done.client);
    if (!c) return;
    c->file = std::move(bytes);
  }
  wake();
}

void clients::finish_frame(job const& done, std::vector<u8> bytes, double milliseconds, bool unfinished) {
  {
    std::lock_guard const lock(mutex_);
    double const pixels = static_cast<double>(done.width) * done.height;
    pacing_.measured(milliseconds, pixels);
    client* const shown = find(done.client);
    if (!shown) return;
    client& c = *shown;
    c.pacing.measured(milliseconds, pixels);
    if (!c.view) return;  // the scene is another one by now
    c.frame = std::move(bytes);
    bool const newest = c.serial == done.serial;
    if (unfinished && newest) c.still_done = false, c.growing = true, last_grown_ = done.client;
    if (!unfinished && newest) c.growing = false;
  }
  wake();
}

void clients::send(int id, std::string text) {
  {
    std::lock_guard const lock(mutex_);
    client* const c = find(id);
    if (!c) return;
    c->texts.push_back(std::move(text));
  }
  wake();
}

void clients::send_all(std::string const& text) {
  {
    std::lock_guard const lock(mutex_);
    for (auto& [id, c] : clients_) c.texts.push_back(text);
  }
  wake();
}

std::optional<train_action> clients::next_action() {
  std::lock_guard const lock(mutex_);
  if (actions_.empty()) return {};
  train_action const first = actions_.front();
  actions_.pop_front();
  counted();
  return first;
}

std::optional<double> clients::next_share() {
  std::lock_guard const lock(mutex_);
  auto const asked = std::exchange(share_, {});
  counted();
  return asked;
}

std::optional<int> clients::next_model() {
  std::lock_guard const lock(mutex_);
  auto const asked = std::exchange(model_, {});
  counted();
  return asked;
}

// What comes from many moves of a handle is the last of them.
std::optional<part_edit> clients::next_edit() {
  std::lock_guard const lock(mutex_);
  if (edits_.empty()) return {};
  part_edit const first = edits_.begin()->second;
  edits_.erase(edits_.begin());
  counted();
  return first;
}

std::optional<added_file> clients::next_file() {
  std::lock_guard const lock(mutex_);
  auto taken = std::exchange(file_, {});
  counted();
  return taken;
}
bool clients::file_waits() const {
  std::lock_guard const lock(mutex_);
  return file_.has_value();
}
bool clients::add_file(added_file file) {
  {
    std::lock_guard const lock(mutex_);
    if (file_) return false;
    file_ = std::move(file);
    counted();
  }
  changed_.notify_all();
  return true;
}

// Views at rest are rendered anew.
void clients::set_parts(std::vector<view_part> parts, std::string scene_json) {
  {
    std::lock_guard const lock(mutex_);
    view_scene next = *scene_;
    next.parts = std::move(parts), next.scene_json = std::move(scene_json);
    scene_ = std::make_shared<view_scene const>(std::move(next));
    for (auto& [id, c] : clients_) {
      c.newest.parts = scene_text(scene_->parts);
      c.dirty = c.view.has_value(), c.still_done = c.growing = false, ++c.serial;
    }
  }
  changed_.notify_all();
  wake();
}

// Cameras, photographs and picks of the scene before are no longer what they were.
void clients::set_scene(view_scene scene) {
  {
    std::lock_guard const lock(mutex_);
    scene_ = std::make_shared<view_scene const>(std::move(scene));
    newest_.scores.clear(), edits_.clear();
    for (auto& [id, c] : clients_) {
      ++c.serial;
      c.view = {}, c.image = {}, c.pick = {}, c.path = {}, c.frame = {}, c.dirty = false;
      c.newest.scores.clear(), c.newest.parts.clear();
      c.texts.push_back(hello_text(*scene_, c.control));
    }
  }
  wake();
}

void clients::set_end(std::string why) {
  std::lock_guard const lock(mutex_);
  end_ = std::move(why);
}

std::string clients::why_it_ends() const {
  std::lock_guard const lock(mutex_);
  return end_;
}

void clients::set_newest(std::string newest_texts::*which, std::string text) {
  {
    std::lock_guard const lock(mutex_);
    newest_.*which = std::move(text);
    for (auto& [id, c] : clients_) c.newest.*which = newest_.*which;
  }
  wake();
}

void clients::set_scores(std::vector<std::pair<int, double>> const& scores) {
  set_newest(&newest_texts::scores, scores_text(scores));
}

void clients::set_status(view_status const& status) { set_newest(&newest_texts::status, status_text(status)); }

void clients::set_curve(view_curve const& curve) { set_newest(&newest_texts::curve, curve_text(curve)); }

}  // namespace gart::view
