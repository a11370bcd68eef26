#include "sockets.hpp"

#include "page.hpp"

#include <gart/core/error.hpp>
#include <gart/io/image_file.hpp>

#include <libwebsockets.h>
#include <sys/socket.h>

#include <array>
#include <atomic>
#include <charconv>
#include <chrono>
#include <thread>
#include <utility>

namespace gart::view {

namespace {

constexpr char const* protocol_name = "gart-view";
// Codes of a close, by RFC 6455.
constexpr int no_text = 1003, policy_violation = 1008, too_large = 1009;
// What waits in the system for a slow line is old before it arrives.
constexpr int send_buffer = 256 * 1024;
constexpr unsigned connections_most = 96;

// A browser's request for a file, or a client.
struct connection {
  int client = 0;  // 0: none
  std::string incoming;
  std::vector<u8> body;  // LWS_PRE bytes before it
};
struct connection_slot {
  connection* own;
};

double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::vector<u8> padded(u8 const* bytes, std::size_t size) {
  std::vector<u8> out(LWS_PRE + size);
  std::copy_n(bytes, size, out.begin() + LWS_PRE);
  return out;
}

int send(lws* wsi, std::vector<u8>& bytes, lws_write_protocol kind) {
  std::size_t const size = bytes.size() - LWS_PRE;
  return lws_write(wsi, bytes.data() + LWS_PRE, size, kind) < static_cast<int>(size) ? -1 : 0;
}

// What a client wrote may be anything: a log and the reason of a close are plain text, and short.
std::string plain(std::string text) {
  for (char& c : text)
    if (c < ' ' || c > '~') c = '?';
  return text.substr(0, 120);
}

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

}  // namespace

struct sockets::state {
  clients& all;
  view_server_options options;
  std::unique_ptr<access> gate;
  lws_context* context = nullptr;
  lws_vhost* vhost = nullptr;
  std::array<lws_protocols, 3> protocols{};
  lws_retry_bo_t idle{};
  std::thread thread;
  std::atomic<bool> ends = false;

  state(clients& c, view_server_options const& o) : all(c), options(o) {}

  static state& of(lws* wsi) { return *static_cast<state*>(lws_context_user(lws_get_context(wsi))); }
  void log(std::string const& line) const {
    if (options.log) options.log(plain(line));
  }

  static std::string header(lws* wsi, lws_token_indexes token) {
    int const length = lws_hdr_total_length(wsi, token);
    if (length <= 0) return {};
    std::string text(static_cast<std::size_t>(length) + 1, '\0');
    if (lws_hdr_copy(wsi, text.data(), length + 1, token) < 0) return {};
    text.resize(static_cast<std::size_t>(length));
    return text;
  }

  // Headers of every answer; `length` bytes follow.
  int write_headers(lws* wsi, unsigned code, char const* type, std::size_t length) const {
    std::array<u8, LWS_PRE + 1536> buffer;
    u8 *const start = buffer.data() + LWS_PRE, *p = start, *const end = buffer.data() + buffer.size() - 1;
    if (lws_add_http_common_headers(wsi, code | LWSAHH_FLAG_NO_SERVER_NAME, type, length, &p, end)) return -1;
    auto const add = [&](char const* name, std::string const& value) {
      return lws_add_http_header_by_name(wsi, reinterpret_cast<u8 const*>(name),
                                         reinterpret_cast<u8 const*>(value.data()), static_cast<int>(value.size()), &p,
                                         end);
    };
    std::string const host = header(wsi, WSI_TOKEN_HOST);
    std::string const socket = gate->host_is_ours(host) ? " ws://" + host : std::string();
    if (add("content-security-policy:", "default-src 'self'; img-src 'self' blob:; connect-src 'self'" + socket) ||
        add("x-content-type-options:", "nosniff") || add("referrer-policy:", "no-referrer") ||
        add("cache-control:", "no-store") || add("cross-origin-resource-policy:", "same-origin") ||
        add("x-frame-options:", "DENY"))
      return -1;
    return lws_finalize_write_http_header(wsi, start, &p, end) ? -1 : 0;
  }

  int answer(lws* wsi, unsigned code, char const* type, std::vector<u8> body) const {
    if (write_headers(wsi, code, type, body.size() - LWS_PRE) != 0) return -1;
    auto*& own = static_cast<connection_slot*>(lws_wsi_user(wsi))->own;
    if (!own) own = new connection;
    own->body = std::move(body);
    lws_callback_on_writable(wsi);
    return 0;
  }
  int refuse(lws* wsi, unsigned code, std::string const& why) const {
    return answer(wsi, code, "text/plain; charset=utf-8", padded(reinterpret_cast<u8 const*>(why.data()), why.size()));
  }

  // Whether the request is from a page of ours, or from none.
  bool from_here(lws* wsi, bool origin_required) const {
    std::string const host = header(wsi, WSI_TOKEN_HOST), origin = header(wsi, WSI_TOKEN_ORIGIN);
    if (!gate->host_is_ours(host)) return false;
    return origin.empty() ? !origin_required : access::origin_is(origin, host);
  }

  int request(lws* wsi, std::string_view path) const {
    request_path const asked = gate->path_of(path);
    if (asked.of == access_right::none || !from_here(wsi, false)) {
      log("403: a request with another token, Host or Origin");
      return refuse(wsi, HTTP_STATUS_FORBIDDEN, "403: not the address that gart printed\n");
    }
    if (lws_hdr_total_length(wsi, WSI_TOKEN_GET_URI) <= 0)
      return refuse(wsi, HTTP_STATUS_METHOD_NOT_ALLOWED, "405: GET alone\n");
    std::string const name = asked.rest.empty() ? "index.html" : asked.rest;
    if (page_file const* const file = find_page_file(name))
      return answer(wsi, HTTP_STATUS_OK, content_type_of(name), padded(file->bytes, file->size));
    std::string_view number = name;
    int index = 0;
    if (number.starts_with("photo/") && number.ends_with(".jpg")) {
      number = number.substr(6, number.size() - 10);
      auto const [end, wrong] = std::from_chars(number.data(), number.data() + number.size(), index);
      auto const& cameras = all.scene().cameras;
      if (wrong == std::errc() && end == number.data() + number.size() && index >= 0 &&
          index < static_cast<int>(cameras.size()) && cameras[static_cast<std::size_t>(index)].photo && options.photo) {
        try {
          std::vector<u8> const jpeg = encode_jpeg(opaque(options.photo(index), all.scene().background));
          return answer(wsi, HTTP_STATUS_OK, "image/jpeg", padded(jpeg.data(), jpeg.size()));
        } catch (std::exception const& e) {
          log("a photograph could not be sent: " + std::string(e.what()));
        }
      }
    }
    return refuse(wsi, HTTP_STATUS_NOT_FOUND, "404: there is no such file\n");
  }

  // 0: may go on; the HTTP status of the refusal.
  unsigned refusal_of_upgrade(lws* wsi, std::string_view to) const {
    request_path const asked = gate->path_of(header(wsi, WSI_TOKEN_GET_URI));
    if (to != "websocket" || asked.of == access_right::none || asked.rest != "socket" || !from_here(wsi, true))
      return HTTP_STATUS_FORBIDDEN;
    if (header(wsi, WSI_TOKEN_PROTOCOL) != protocol_name) return HTTP_STATUS_BAD_REQUEST;
    return all.count() >= options.max_clients ? HTTP_STATUS_SERVICE_UNAVAILABLE : 0;
  }

  int close(lws* wsi, int code, std::string const& why) const {
    std::string text = plain(why);
    log("a client was closed: " + text);
    lws_close_reason(wsi, static_cast<lws_close_status>(code), reinterpret_cast<u8*>(text.data()), text.size());
    return -1;
  }

  int receive(lws* wsi, connection& c, char const* bytes, std::size_t size) {
    if (lws_frame_is_binary(wsi)) return close(wsi, no_text, "a message is not text");
    if (c.incoming.size() + size > message_bytes) return close(wsi, too_large, "a message is longer than 16384 bytes");
    c.incoming.append(bytes, size);
    if (lws_remaining_packet_payload(wsi) != 0 || !lws_is_final_fragment(wsi)) return 0;
    verdict const said = all.receive(c.client, std::exchange(c.incoming, {}), seconds_now());
    if (!said.reason.empty()) return close(wsi, said.code, said.reason);
    if (all.overflows(c.client)) return close(wsi, policy_violation, "nothing of what was sent is read");
    if (all.has_output(c.client)) lws_callback_on_writable(wsi);
    return 0;
  }

  int write(lws* wsi, connection& c) {
    std::string text;
    if (all.take_text(c.client, text)) {
      std::vector<u8> bytes = padded(reinterpret_cast<u8 const*>(text.data()), text.size());
      if (send(wsi, bytes, LWS_WRITE_TEXT) != 0) return -1;
    } else if (std::vector<u8> frame; all.take_frame(c.client, frame, seconds_now())) {
      std::vector<u8> bytes = padded(frame.data(), frame.size());
      if (send(wsi, bytes, LWS_WRITE_BINARY) != 0) return -1;
    }
    if (all.has_output(c.client)) lws_callback_on_writable(wsi);
    return 0;
  }

  static int on_http(lws* wsi, lws_callback_reasons reason, void* user, void* in, std::size_t size) {
    auto* const slot = static_cast<connection_slot*>(user);
    switch (reason) {
      case LWS_CALLBACK_HTTP:
        return of(wsi).request(wsi, {static_cast<char const*>(in), size});
      case LWS_CALLBACK_HTTP_WRITEABLE: {
        if (!slot || !slot->own || slot->own->body.empty()) return 0;
        std::vector<u8> body = std::exchange(slot->own->body, {});
        if (send(wsi, body, LWS_WRITE_HTTP_FINAL) != 0) return -1;
        return lws_http_transaction_completed(wsi) ? -1 : 0;
      }
      case LWS_CALLBACK_HTTP_CONFIRM_UPGRADE: {
        state& s = of(wsi);
        unsigned const status = s.refusal_of_upgrade(wsi, static_cast<char const*>(in));
        if (status == 0) return 0;
        s.log(std::to_string(status) + ": a viewer was not let in");
        return s.write_headers(wsi, status, "text/plain", 0) != 0 ? -1 : 1;
      }
      case LWS_CALLBACK_HTTP_DROP_PROTOCOL:
      case LWS_CALLBACK_CLOSED_HTTP:
        if (slot) delete std::exchange(slot->own, nullptr);
        return 0;
      case LWS_CALLBACK_EVENT_WAIT_CANCELLED: {
        // Whoever has nothing to be sent is not woken for it: asked in write().
        state& s = of(wsi);
        lws_callback_on_writable_all_protocol(s.context, &s.protocols[1]);
        return 0;
      }
      default:
        return 0;
    }
  }

  static int on_viewer(lws* wsi, lws_callback_reasons reason, void* user, void* in, std::size_t size) {
    auto* const slot = static_cast<connection_slot*>(user);
    switch (reason) {
      case LWS_CALLBACK_ESTABLISHED: {
        state& s = of(wsi);
        slot->own = new connection;
        int const bytes = send_buffer;
        setsockopt(lws_get_socket_fd(wsi), SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes);
        access_right const of = s.gate->path_of(header(wsi, WSI_TOKEN_GET_URI)).of;
        slot->own->client = s.all.add(of == access_right::control);
        lws_callback_on_writable(wsi);
        return 0;
      }
      case LWS_CALLBACK_RECEIVE:
        return slot->own ? of(wsi).receive(wsi, *slot->own, static_cast<char const*>(in), size) : -1;
      case LWS_CALLBACK_SERVER_WRITEABLE:
        return slot->own ? of(wsi).write(wsi, *slot->own) : -1;
      case LWS_CALLBACK_CLOSED:
        if (slot->own) of(wsi).all.remove(slot->own->client);
        delete std::exchange(slot->own, nullptr);
        return 0;
      default:
        return 0;
    }
  }
};

sockets::sockets(clients& all, view_server_options const& options) : state_(std::make_unique<state>(all, options)) {
  state& s = *state_;
  if (options.port < 0 || options.port > 65535)
    throw invalid_argument("view_server_options.port must lie between 0 and 65535, not " +
                           std::to_string(options.port));
  listen_place const place = listen_place_of(options.listen);
  lws_set_log_level(0, nullptr);

  s.protocols[0] = {"http", &state::on_http, sizeof(connection_slot), 0, 0, nullptr, 0};
  s.protocols[1] = {protocol_name, &state::on_viewer, sizeof(connection_slot), 4096, 0, nullptr, 0};
  s.idle.secs_since_valid_ping = 30, s.idle.secs_since_valid_hangup = 90;
  lws_context_creation_info info{};
  info.options = LWS_SERVER_OPTION_EXPLICIT_VHOSTS | LWS_SERVER_OPTION_VALIDATE_UTF8 |
                 LWS_SERVER_OPTION_FAIL_UPON_UNABLE_TO_BIND | LWS_SERVER_OPTION_DISABLE_IPV6 |
                 LWS_SERVER_OPTION_SKIP_SERVER_CANONICAL_NAME;
  info.port = options.port;
  info.iface = place.address.c_str();
  info.protocols = s.protocols.data();
  info.user = &s;
  info.fd_limit_per_thread = connections_most;
  info.timeout_secs = 10, info.keepalive_timeout = 10;
  info.max_http_header_data2 = 8192;
  info.retry_and_idle_policy = &s.idle;
  info.gid = info.uid = static_cast<decltype(info.gid)>(-1);
  s.context = lws_create_context(&info);
  if (s.context) s.vhost = lws_create_vhost(s.context, &info);
  int const port = s.vhost ? lws_get_vhost_listen_port(s.vhost) : 0;
  if (port <= 0) {
    if (s.context) lws_context_destroy(s.context);
    throw error("the viewer cannot listen at " + options.listen + ", port " + std::to_string(options.port) +
                " (view_server_options.port = 0 takes one that is free)");
  }
  s.gate = std::make_unique<access>(place.hosts, port);
  all.wake = [&s] { lws_cancel_service(s.context); };
  s.thread = std::thread([&s] {
    while (!s.ends.load() && lws_service(s.context, 0) >= 0) {
    }
    // What is left to say is given a moment, where anyone takes it.
    double const until = seconds_now() + 0.2;
    s.all.send_all(bye_text("gart ends"));
    while (s.all.has_output() && seconds_now() < until && lws_service(s.context, 0) >= 0) lws_cancel_service(s.context);
  });
}

sockets::~sockets() {
  state& s = *state_;
  s.ends = true;
  lws_cancel_service(s.context);
  if (s.thread.joinable()) s.thread.join();
  s.all.wake = [] {};
  lws_context_destroy(s.context);
}

std::string sockets::address(access_right of) const { return state_->gate->address(of); }
int sockets::port() const { return lws_get_vhost_listen_port(state_->vhost); }

}  // namespace gart::view
