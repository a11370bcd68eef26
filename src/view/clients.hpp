#pragma once
// The state that the thread of the sockets shares with the one that renders. Each client has its newest wanted view,
// and the data waiting to be sent to it. All calls may come from any thread; times are seconds of one clock.

#include <gart/view/message.hpp>
#include <gart/view/pacing.hpp>
#include <gart/view/server.hpp>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>

namespace gart::view {

inline double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// What is to be rendered or found for a client.
struct job {
  int client = 0;
  std::variant<view_message, image_message, pick_message, path_message> wanted;
  u64 serial = 0;             // of the view among those of its client
  bool still = false;         // a view of full size
  bool more = false;          // of one that was rendered before with fewer samples
  int width = 0, height = 0;  // that it is rendered at
};

// What a client said, and what becomes of its connection: kept where the reason is empty.
struct verdict {
  int code = 0;  // of the close, where there is a reason
  std::string reason;
};

// The newest texts of their kinds, which replace those before; empty: nothing to send.
struct newest_texts {
  std::string status, curve, parts, scores;
  static constexpr std::string newest_texts::*all[] = {&newest_texts::status, &newest_texts::curve,
                                                       &newest_texts::parts, &newest_texts::scores};
};

class clients {
 public:
  clients(view_scene scene, view_server_options const& options);

  // The thread of the sockets.
  int add(bool control);  // its id
  void remove(int client);
  verdict receive(int client, std::string_view text, double now);
  bool take_text(int client, std::string& to);
  bool take_frame(int client, std::vector<u8>& to, double now);
  bool has_output(int client) const;
  bool has_output() const;           // any of them
  bool overflows(int client) const;  // it takes nothing of what it asked for

  // The thread that renders.
  std::optional<job> next_job(double now, double wait_seconds);
  // Whether its client is there, and of a view at rest has asked for no newer one.
  bool waited_for(job const& j) const;
  // Milliseconds that so many pixels of a view are expected to take; 0 where nothing is known.
  double expected_ms(double pixels) const;
  // `milliseconds` are 0 where they say nothing of other views. Unfinished: more samples are to come.
  void finish_frame(job const& done, std::vector<u8> bytes, double milliseconds, bool unfinished = false);
  void finish_image(job const& done, std::vector<u8> bytes);
  void send(int client, std::string text);
  std::optional<train_action> next_action();
  std::optional<double> next_share();
  std::optional<int> next_model();
  std::optional<part_edit> next_edit();
  std::optional<added_file> next_file();
  bool file_waits() const;
  bool add_file(added_file file);  // false: another one waits
  void set_status(view_status const& status);
  void set_curve(view_curve const& curve);
  void set_scores(std::vector<std::pair<int, double>> const& scores);
  void set_scene(view_scene scene);
  void set_parts(std::vector<view_part> parts, std::string scene_json);
  void set_end(std::string why);
  std::string why_it_ends() const;

  void send_all(std::string const& text);
  int count() const noexcept { return count_.load(std::memory_order_relaxed); }
  bool idle() const noexcept { return wishes_.load(std::memory_order_relaxed) == 0; }
  std::shared_ptr<view_scene const> scene() const;

  std::function<void()> wake = [] {};  // called when there is something to send

 private:
  struct client {
    bool control = false;
    std::optional<view_message> view;  // the newest
    double view_time = 0;              // when it came, or the last frame went
    u64 serial = 0;                    // of it
    bool dirty = false;                // not rendered in any size
    bool still_done = false;           // rendered whole
    bool growing = false;              // rendered whole, and better with every sample to come
    std::optional<image_message> image;
    std::optional<pick_message> pick;
    std::optional<path_message> path;
    std::deque<std::string> texts;
    newest_texts newest;          // to be sent
    std::vector<u8> frame, file;  // the newest, to be sent
    frame_pacing pacing;
  };
  void set_newest(std::string newest_texts::*which, std::string text);
  static bool waits(client const& c);  // whether there is something to send to it
  // All with mutex_ held.
  client* find(int id) {
    auto const found = clients_.find(id);
    return found == clients_.end() ? nullptr : &found->second;
  }
  client const* find(int id) const { return const_cast<clients*>(this)->find(id); }
  bool at_rest(client const& c, double now) const;
  std::optional<job> job_of(int id, client& c, double now, int urgency);
  std::optional<job> choose(double now);
  double next_rest(double now) const;
  int moving(double now) const;
  bool controls(client& c, char const* what, bool possible, char const* else_why) const;
  void counted();  // after a change of clients_, actions_, share_ or model_

  view_server_options const options_;
  std::mutex mutable mutex_;
  std::shared_ptr<view_scene const> scene_;
  std::condition_variable changed_;
  std::map<int, client> clients_;
  std::atomic<int> count_ = 0, wishes_ = 0;  // clients; they and what they asked of the training
  int next_id_ = 1, last_served_ = 0;
  int last_grown_ = 0;   // the client whose view the last samples were of
  frame_pacing pacing_;  // of all: what a new client starts from
  newest_texts newest_;  // what a new client is told; parts are in its hello
  std::string end_ = "gart ends";
  std::deque<train_action> actions_;
  std::optional<double> share_;
  std::optional<int> model_;
  std::map<int, part_edit> edits_;  // of each part the newest
  std::optional<added_file> file_;
};

}  // namespace gart::view
