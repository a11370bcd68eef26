#include "sockets.hpp"

#include "log_lines.hpp"
#include "requests.hpp"
#include "websocket.hpp"

#include <gart/core/error.hpp>

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <list>
#include <optional>
#include <thread>
#include <utility>

namespace gart::view {

namespace {

constexpr char const* protocol_name = "gart-view";
// What waits in the system for a slow line is old before it arrives.
constexpr int send_buffer = 256 * 1024;
// Connections that are no viewers: the one that was longest of no use makes room for the next.
constexpr std::size_t requests_most = 64;
// Limits in seconds. First a request's head and each part of its answer. Then a viewer's silence until it is asked, and
// until it is closed. Then a viewer that reads nothing, and a close.
constexpr double request_seconds = 15, ping_seconds = 20, unheard_seconds = 60, stalled_seconds = 30, close_seconds = 2;
constexpr int tick_ms = 250;

class descriptor {
 public:
  explicit descriptor(int number) : number_(number) {}
  descriptor(descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  descriptor& operator=(descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  int number() const { return number_; }

 private:
  int number_;
};

// A browser's request, or a viewer.
struct connection {
  enum phase { open, closing, lingering, gone };

  connection(descriptor own, double seconds_now) : socket(std::move(own)), heard(seconds_now) {}

  descriptor socket;
  double heard;         // when bytes came last, or a request was done
  int client = 0;       // 0: no viewer
  double said = 0;      // when the viewer's last message came
  bool pinged = false;  // since it was heard
  phase now = open;
  double ends = 0;                    // when a close is given up
  std::string came;                   // what is not read yet
  std::string out;                    // what is not sent yet
  std::size_t sent = 0;               // of it
  double moved = 0;                   // when the system took some of it, or it began
  std::optional<http_request> sends;  // a file: what came is its body
  ws::reader messages{message_bytes};
};

descriptor listening_at(listen_place const& place, view_server_options const& options) {
  descriptor own(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  int const yes = 1;
  setsockopt(own.number(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in at{};
  at.sin_family = AF_INET, at.sin_port = htons(static_cast<std::uint16_t>(options.port));
  inet_pton(AF_INET, place.address.c_str(), &at.sin_addr);
  if (own.number() < 0 || ::bind(own.number(), reinterpret_cast<sockaddr const*>(&at), sizeof at) != 0 ||
      ::listen(own.number(), 128) != 0)
    throw error("the viewer cannot listen at " + options.listen + ", port " + std::to_string(options.port) +
                " (view_server_options.port = 0 takes one that is free)");
  return own;
}

int port_of(descriptor const& listener) {
  sockaddr_in at{};
  socklen_t size = sizeof at;
  getsockname(listener.number(), reinterpret_cast<sockaddr*>(&at), &size);
  return ntohs(at.sin_port);
}

view_server_options const& checked(view_server_options const& options) {
  if (options.port < 0 || options.port > 65535)
    throw invalid_argument("view_server_options.port must lie between 0 and 65535, not " +
                           std::to_string(options.port));
  return options;
}

}  // namespace

struct sockets::state {
  clients& all;
  view_server_options const options;
  listen_place const place;
  descriptor listener;
  int const port;
  access const gate;
  requests const answers;
  descriptor woken{eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)};
  std::list<connection> connections;
  log_rate lines;
  std::atomic<bool> ends = false;
  std::thread thread;

  state(clients& c, view_server_options const& o)
      : all(c),
        options(checked(o)),
        place(listen_place_of(options.listen)),
        listener(listening_at(place, options)),
        port(port_of(listener)),
        gate(place.hosts, options.allowed_hosts, port),
        answers(gate, all, options) {
    if (woken.number() < 0) throw error("the viewer cannot start: the system gives no descriptor");
  }

  void wake() const { static_cast<void>(!eventfd_write(woken.number(), 1)); }
  void log(std::string_view line) {
    if (!options.log) return;
    std::string const text = lines.line(escaped(line, 300), seconds_now());
    if (!text.empty()) options.log(text);
  }

  // ---- one connection

  void put(connection& c, std::string_view bytes) const {
    if (c.out.empty()) c.moved = seconds_now();
    c.out += bytes;
  }

  void end_after_output(connection& c) const {
    c.now = connection::closing, c.ends = seconds_now() + close_seconds;
    c.came.clear();
  }

  void take_leave(connection& c, int code, std::string_view why) const {
    all.remove(std::exchange(c.client, 0));
    put(c, ws::close_frame(code, escaped(why, 120)));
    end_after_output(c);
  }
  void close(connection& c, int code, std::string_view why) {
    log("a client was closed: " + std::string(why));
    take_leave(c, code, why);
  }

  void drop(connection& c) const {
    if (c.client) all.remove(std::exchange(c.client, 0));
    c.now = connection::gone;
  }

  // Received data is discarded during a close: the system would withdraw sent data if it stayed unread.
  void read(connection& c) {
    char bytes[16384];
    ssize_t const n = ::recv(c.socket.number(), bytes, sizeof bytes, 0);
    if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) return drop(c);
    if (n <= 0 || c.now != connection::open) return;
    c.came.append(bytes, static_cast<std::size_t>(n));
    if (c.client || c.sends) c.heard = seconds_now(), c.pinged = false;
    understand(c);
  }

  void understand(connection& c) {
    while (c.now == connection::open && !c.client && c.out.empty()) {
      if (c.sends && !take_file(c)) return;
      http_request asked;
      head_state const is = take_request(c.came, asked);
      if (is == head_state::unfinished) return;
      if (is == head_state::wrong)
        respond(c, {}, {400, "text/plain; charset=utf-8", "400: no request that is understood\n", {}});
      else
        request(c, asked);
    }
    while (c.now == connection::open && c.client) {
      ws::message const m = c.messages.next(c.came);
      if (m.is == ws::message::none) return;
      message(c, m);
    }
  }

  // Whether all of it is there.
  bool take_file(connection& c) {
    if (c.came.size() < c.sends->body_bytes) return false;
    http_request const asked = *std::exchange(c.sends, {});
    auto const end = c.came.begin() + static_cast<std::ptrdiff_t>(asked.body_bytes);
    bool const taken = all.add_file({answers.sent_name(asked), std::vector<u8>(c.came.begin(), end)});
    std::string(end, c.came.end()).swap(c.came);
    http_answer a{202, "text/plain; charset=utf-8", "taken\n", {}};
    if (!taken) a.status = 503, a.body = "another file is on its way: send this one again in a moment\n";
    respond(c, asked, a);
    return c.now == connection::open && c.out.empty();
  }

  void request(connection& c, http_request const& asked) {
    c.heard = seconds_now();
    if (asked.method == "POST") {
      http_answer const a = answers.may_send(asked);
      if (a.status != 202) return respond(c, asked, a);
      c.sends = asked;
      return;
    }
    if (asked.header("upgrade").empty()) return respond(c, asked, answers.answer(asked));
    int status = answers.upgrade(asked);
    if (status == 101 && !has_room()) status = 503;
    if (status == 101) return welcome(c, asked);
    respond(c, asked,
            {status, "text/plain; charset=utf-8", std::to_string(status) + ": not let in\n",
             std::to_string(status) + ": a viewer was not let in"});
  }

  void respond(connection& c, http_request const& asked, http_answer const& a) {
    if (!a.log.empty()) log(a.log);
    bool const stays = (a.status == 200 || a.status == 202 || a.status == 404) && !asked.last;
    auto headers = answers.safe_headers(asked);
    headers.insert(headers.end(), {"content-type: " + a.type, "content-length: " + std::to_string(a.body.size()),
                                   stays ? "connection: keep-alive" : "connection: close"});
    put(c, answer_head(a.status, headers) + a.body);
    if (!stays) end_after_output(c);
    send(c);
  }

  void welcome(connection& c, http_request const& asked) {
    put(c, answer_head(101, {"upgrade: websocket", "connection: Upgrade",
                             "sec-websocket-accept: " + ws::accept_of(asked.header("sec-websocket-key")),
                             std::string("sec-websocket-protocol: ") + protocol_name}));
    int const bytes = send_buffer;
    setsockopt(c.socket.number(), SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes);
    c.client = all.add(answers.right_of(asked) == access_right::control);
    c.heard = c.said = seconds_now();
  }

  // Where all places are taken, the page that has been silent for longest makes room.
  bool has_room() {
    if (all.count() < options.max_clients) return true;
    connection* silent = nullptr;
    for (connection& c : connections)
      if (c.client && (!silent || c.said < silent->said)) silent = &c;
    if (!silent || seconds_now() - silent->said < options.silent_seconds) return false;
    close(*silent, ws::try_again_later, "another page took the place of this one");
    return true;
  }

  void message(connection& c, ws::message const& m) {
    using kind = ws::message;
    if (m.is == kind::wrong) return close(c, m.code, m.payload);
    if (m.is == kind::ping && c.out.empty()) put(c, ws::frame_head(ws::pong, m.payload.size()) + m.payload);
    if (m.is == kind::close) return take_leave(c, ws::normal, "");
    if (m.is != kind::text) return;
    c.said = seconds_now();
    verdict const said = all.receive(c.client, m.payload, c.said);
    if (!said.reason.empty()) return close(c, said.code, said.reason);
    if (all.overflows(c.client)) close(c, ws::policy_violation, "nothing of what was sent is read");
  }

  // Sends what the system takes now. A viewer that has it all is given its next text or its newest frame.
  void send(connection& c) const {
    while (c.now == connection::open || c.now == connection::closing) {
      if (c.out.empty() && !fill(c)) break;
      ssize_t const n = ::send(c.socket.number(), c.out.data() + c.sent, c.out.size() - c.sent, MSG_NOSIGNAL);
      if (n < 0 && (errno == EAGAIN || errno == EINTR)) return;
      if (n < 0) return drop(c);
      c.sent += static_cast<std::size_t>(n), c.moved = seconds_now();
      if (c.sent == c.out.size()) std::string().swap(c.out), c.sent = 0;
    }
    if (c.now == connection::closing && c.out.empty()) {
      ::shutdown(c.socket.number(), SHUT_WR);
      c.now = connection::lingering;
    }
  }

  bool fill(connection& c) const {
    if (!c.client) return false;
    std::string text;
    std::vector<u8> frame;
    if (all.take_text(c.client, text)) {
      put(c, ws::frame_head(ws::text, text.size()) + text);
    } else if (all.take_frame(c.client, frame, seconds_now())) {
      put(c, ws::frame_head(ws::binary, frame.size()));
      c.out.append(reinterpret_cast<char const*>(frame.data()), frame.size());
    }
    return !c.out.empty();
  }

  void expire(connection& c, double now) {
    bool const waits = !c.out.empty();
    if (c.now == connection::closing || c.now == connection::lingering) {
      if (now > c.ends) drop(c);
    } else if (!c.client) {
      if (now - (waits ? c.moved : c.heard) > request_seconds) drop(c);
    } else if (waits && now - c.moved > stalled_seconds) {
      close(c, ws::policy_violation, "nothing of what was sent is read");
    } else if (now - c.heard > unheard_seconds) {
      close(c, ws::going_away, "nothing was heard");
    } else if (!c.pinged && now - c.heard > ping_seconds) {
      c.pinged = true;
      put(c, ws::frame_head(ws::ping, 0));
    }
  }

  // ---- all of them

  void accept_all() {
    for (;;) {
      descriptor one(::accept4(listener.number(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
      bool const full = one.number() < 0 && (errno == EMFILE || errno == ENFILE);
      if (one.number() < 0 && !full) return;
      make_room(full ? 1 : requests_most);
      if (full) return;
      int const yes = 1;
      setsockopt(one.number(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
      connections.emplace_back(std::move(one), seconds_now());
    }
  }

  void make_room(std::size_t most) {
    std::size_t n = 0;
    connection* oldest = nullptr;
    for (connection& c : connections) {
      if (c.client || c.now == connection::gone) continue;
      ++n;
      if (!oldest || c.heard < oldest->heard) oldest = &c;
    }
    if (n >= most && oldest) drop(*oldest);
  }

  void turn(int timeout_ms) {
    std::vector<pollfd> watched = {{woken.number(), POLLIN, 0}, {listener.number(), POLLIN, 0}};
    for (connection const& c : connections) {
      bool const reads = c.client || c.now != connection::open || c.out.empty();
      watched.push_back(
          {c.socket.number(), static_cast<short>((reads ? POLLIN : 0) | (c.out.empty() ? 0 : POLLOUT)), 0});
    }
    ::poll(watched.data(), watched.size(), timeout_ms);
    eventfd_t ignored;
    static_cast<void>(!eventfd_read(woken.number(), &ignored));
    std::size_t i = 2;
    double const now = seconds_now();
    for (connection& c : connections) {
      short const happened = watched[i++].revents;
      if (happened & (POLLIN | POLLHUP | POLLERR)) read(c);
      send(c);
      if (c.now == connection::open && !c.client && c.out.empty()) understand(c);
      if (c.now != connection::gone) expire(c, now);
    }
    if (watched[1].revents) accept_all();
    connections.remove_if([](connection const& c) { return c.now == connection::gone; });
  }

  void serve() {
    while (!ends) turn(tick_ms);
    // Waits a moment until clients take the remaining data and answer the close. The system would withdraw the last
    // message if answers stayed unread.
    all.send_all(bye_text(all.why_it_ends()));
    double const until = seconds_now() + close_seconds;
    bool told = false;
    while (seconds_now() < until) {
      bool const waits =
          all.has_output() || std::any_of(connections.begin(), connections.end(), [](auto const& c) {
            return c.now == connection::closing || c.now == connection::lingering || (c.client && !c.out.empty());
          });
      if (!waits && told) return;
      if (!waits) {
        told = true;
        for (connection& c : connections)
          if (c.client) take_leave(c, ws::going_away, "");
      }
      turn(5);
    }
  }
};

sockets::sockets(clients& all, view_server_options const& options) : state_(std::make_unique<state>(all, options)) {
  state& s = *state_;
  all.wake = [&s] { s.wake(); };
  s.thread = std::thread([&s] { s.serve(); });
}

sockets::~sockets() {
  state& s = *state_;
  s.ends = true;
  s.wake();
  s.thread.join();
  s.all.wake = [] {};
}

std::string sockets::address(access_right of) const { return state_->gate.address(of); }
int sockets::port() const { return state_->port; }

}  // namespace gart::view
