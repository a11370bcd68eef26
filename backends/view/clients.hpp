#pragma once
// What the thread of the sockets and the one that renders share: of each client the newest view that it wants, and what
// waits to be sent to it. All calls may come from any thread; times are seconds of one clock.

#include <gart/view/message.hpp>
#include <gart/view/pacing.hpp>
#include <gart/view/server.hpp>

#include <atomic>
#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>

namespace gart::view {

// What is to be rendered or found for a client.
struct job {
  int client = 0;
  std::variant<view_message, pick_message, path_message> wanted;
  bool still = false;         // a view of full size
  int width = 0, height = 0;  // that it is rendered at
};

// What a client said, and what becomes of its connection: kept where the reason is empty.
struct verdict {
  int code = 0;  // of the close, where there is a reason
  std::string reason;
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
  void finish_frame(job const& done, std::vector<u8> bytes, double milliseconds);
  void send(int client, std::string text);
  std::optional<train_action> next_action();
  std::optional<double> next_share();
  void set_status(view_status const& status);
  void set_curve(view_curve const& curve);

  void send_all(std::string const& text);
  int count() const noexcept { return count_.load(std::memory_order_relaxed); }
  bool idle() const noexcept { return wishes_.load(std::memory_order_relaxed) == 0; }
  view_scene const& scene() const { return scene_; }

  std::function<void()> wake = [] {};  // called when there is something to send

 private:
  struct client {
    bool control = false;
    std::optional<view_message> view;  // the newest
    double view_time = 0;              // when it came, or the last frame went
    bool dirty = false;                // not rendered in any size
    bool still_done = false;           // rendered whole
    std::optional<pick_message> pick;
    std::optional<path_message> path;
    std::deque<std::string> texts;
    std::string status, curve;  // the newest, to be sent
    std::vector<u8> frame;      // the newest, to be sent
    frame_pacing pacing;
  };
  static bool waits(client const& c);  // whether there is something to send to it
  // All with mutex_ held.
  bool at_rest(client const& c, double now) const;
  std::optional<job> job_of(int id, client& c, double now, int urgency);
  std::optional<job> choose(double now);
  double next_rest(double now) const;
  int moving(double now) const;
  void counted();  // after a change of clients_, actions_ or share_

  view_scene const scene_;
  view_server_options const options_;
  std::mutex mutable mutex_;
  std::condition_variable changed_;
  std::map<int, client> clients_;
  std::atomic<int> count_ = 0, wishes_ = 0;  // clients; they and what they asked of the training
  int next_id_ = 1, last_served_ = 0;
  frame_pacing pacing_;  // of all: what a new client starts from
  std::string status_, curve_;
  std::deque<train_action> actions_;
  std::optional<double> share_;
};

}  // namespace gart::view
