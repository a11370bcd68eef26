// The server over loopback: who is let in, what closes a connection, that one who stalls slows nobody, and that what
// is seen at rest is the render.
#include "cameras.hpp"
#include "socket_client.hpp"

#include <gart/core/error.hpp>
#include <gart/io/image_file.hpp>
#include <gart/view/server.hpp>

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <atomic>
#include <chrono>
#include <mutex>
#include <random>
#include <thread>

namespace {

using gart_test::camera_at;
using gart_test::socket_client;
using gart_test::view_text;
using nlohmann::json;

// An image that no encoder makes small, the same for the same camera.
gart::rendered noise(gart::camera const& view) {
  std::mt19937 engine(static_cast<unsigned>(view.width * 10007 + view.height));
  gart::rendered r{gart::image_float(view.width, view.height, 3), gart::image_float(view.width, view.height, 1, 0.25f),
                   gart::image_float(view.width, view.height, 1, 3.0f),
                   gart::basic_image<gart::u32>(view.width, view.height, 1, 2)};
  for (float& x : r.color.data) x = static_cast<float>(engine() & 255u) / 255;
  return r;
}

// A server, and the thread that renders for it.
struct running {
  std::mutex mutex;
  std::vector<std::string> logged;
  std::vector<int> widths;  // of what was rendered
  gart::view_server server;
  std::atomic<bool> ends = false;
  std::thread thread;

  static gart::gaussian_model one() {
    gart::gaussian_model m;
    m.resize(1, 0);
    return m;
  }
  static gart::view_scene scene_with(bool training) {
    gart::view_scene scene = gart::scene_of(
        "one", one(), 2, {{"front", camera_at({0, 0, -2}), false, true}, {"back", camera_at({0, 0, 2})}});
    scene.training = training;
    return scene;
  }
  gart::view_server_options options(int most, double silent_seconds) {
    gart::view_server_options o;
    o.max_clients = most, o.silent_seconds = silent_seconds;
    o.allowed_hosts = {"viewer.example.org"};
    o.photo = [](int) { return gart::image8(16, 12, 4, 200); };
    o.log = [this](std::string const& line) {
      std::lock_guard const lock(mutex);
      logged.push_back(line);
    };
    return o;
  }
  explicit running(bool training = false, int most = 8, double silent_seconds = 30)
      : server(scene_with(training), options(most, silent_seconds)) {
    thread = std::thread([this] {
      auto const render = [this](gart::camera const& view, gart::view_settings const&) {
        {
          std::lock_guard const lock(mutex);
          widths.push_back(view.width);
        }
        if (view.width == 13) throw gart::error("thirteen");
        return noise(view);
      };
      while (!ends) server.render_next(render, 0.02);
    });
  }
  ~running() {
    ends = true;
    thread.join();
  }

  std::string path(bool control = true) const {
    std::string const a = control ? server.control_address() : server.view_address();
    return a.substr(a.find('/', 7));
  }
  std::string host() const { return "127.0.0.1:" + std::to_string(server.port()); }
  std::string get(std::string const& path, std::string const& host_header, std::string const& more = "") const {
    return "GET " + path + " HTTP/1.1\r\nHost: " + host_header + "\r\n" + more + "\r\n";
  }
  std::string upgrade(std::string const& path, std::string const& host_header, std::string const& origin,
                      std::string const& protocol = "gart-view") const {
    return get(path, host_header,
               "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
               "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: " +
                   protocol + "\r\n" + (origin.empty() ? "" : "Origin: " + origin + "\r\n"));
  }
  // A client that has heard hello.
  std::unique_ptr<socket_client> client(bool control = true, int receive_buffer = 0) const {
    auto c = std::make_unique<socket_client>(server.port(), receive_buffer);
    std::string const answer = c->ask(upgrade(path(control) + "socket", host(), "http://" + host()));
    REQUIRE(answer.find(" 101 ") != std::string::npos);
    json const hello = json::parse(c->hear().payload);
    REQUIRE(hello["type"] == "hello");
    REQUIRE(hello["right"] == (control ? "control" : "view"));
    return c;
  }
  bool has_logged(std::string const& part) {
    for (int i = 0; i < 200; ++i) {
      {
        std::lock_guard const lock(mutex);
        for (auto const& line : logged)
          if (line.find(part) != std::string::npos) return true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }
};

struct frame {
  json header;
  std::string jpeg;
};
frame frame_of(std::string const& bytes) {
  std::uint32_t length = 0;
  REQUIRE(bytes.size() > 4);
  std::memcpy(&length, bytes.data(), 4);
  REQUIRE(bytes.size() > 4 + length);
  return {json::parse(bytes.substr(4, length)), bytes.substr(4 + length)};
}

// Refusals of an upgrade are HTTP/1.0.
bool is(std::string const& answer, int status) {
  return answer.substr(0, 7) == "HTTP/1." && answer.substr(8, 5) == " " + std::to_string(status) + " ";
}

}  // namespace

TEST_CASE("addresses hold tokens of 128 bits, new in each run") {
  running const a, b;
  CHECK(a.path(true).size() == 34);
  CHECK(a.path(false).size() == 34);
  CHECK(a.path(true) != a.path(false));
  CHECK(a.path(true) != b.path(true));
}

TEST_CASE("another token, Host or Origin is forbidden") {
  running r;
  std::string const path = r.path(), host = r.host(), port = std::to_string(r.server.port());
  auto const answer = [&](std::string const& request) {
    socket_client c(r.server.port());
    return c.ask(request);
  };
  // The page or, where none was compiled in, that there is none: not forbidden.
  std::string const page = answer(r.get(path, host));
  CHECK((is(page, 200) || is(page, 404)));
  for (char const* header : {"content-security-policy: default-src 'self'", "x-content-type-options: nosniff",
                             "referrer-policy: no-referrer", "cache-control: no-store", "x-frame-options: DENY",
                             "cross-origin-resource-policy: same-origin"})
    CHECK(page.find(header) != std::string::npos);
  CHECK_FALSE(is(answer(r.get(path, "localhost:" + port)), 403));
  CHECK_FALSE(is(answer(r.get(path, host, "Origin: http://" + host + "\r\n")), 403));

  std::string other = path;
  other[5] = other[5] == '0' ? '1' : '0';
  for (std::string const& wrong : {std::string("/"), other, path.substr(0, 32) + "/", std::string("/index.html"),
                                   path.substr(0, 33), std::string("//")})
    CHECK(is(answer(r.get(wrong, host)), 403));
  for (std::string const& wrong : {std::string("evil.example:") + port, std::string("127.0.0.1"),
                                   std::string("127.0.0.1:1"), "127.0.0.1.evil.example:" + port, std::string()})
    CHECK_FALSE(is(answer(r.get(path, wrong)), 200));
  CHECK(is(answer(r.get(path, "evil.example:" + port)), 403));
  CHECK(is(answer(r.get(path, host, "Origin: http://evil.example\r\n")), 403));
  CHECK(is(answer(r.get(path, host, "Origin: null\r\n")), 403));

  std::string const socket = path + "socket", origin = "http://" + host;
  CHECK(is(answer(r.upgrade(socket, host, origin)), 101));
  CHECK(is(answer(r.upgrade(socket, host, "")), 403));
  CHECK(is(answer(r.upgrade(socket, host, "http://evil.example")), 403));
  CHECK(is(answer(r.upgrade(socket, host, "https://" + host)), 403));
  CHECK(is(answer(r.upgrade(socket, "evil.example:" + port, "http://evil.example:" + port)), 403));
  CHECK(is(answer(r.upgrade(other + "socket", host, origin)), 403));
  CHECK(is(answer(r.upgrade(path, host, origin)), 403));
  CHECK_FALSE(is(answer(r.upgrade(socket, host, origin, "chat")), 101));
  // A proxy that is allowed, with its own name and with this server's.
  CHECK_FALSE(is(answer(r.get(path, "viewer.example.org")), 403));
  CHECK(is(answer(r.upgrade(socket, "viewer.example.org", "https://viewer.example.org")), 101));
  CHECK(is(answer(r.upgrade(socket, host, "https://viewer.example.org")), 101));
  CHECK(is(answer(r.upgrade(socket, "viewer.example.org", "https://evil.example")), 403));
  CHECK(r.has_logged("403"));
  CHECK(r.has_logged("view_server_options.allowed_hosts"));
  for (int i = 0; i < 500 && r.server.clients() > 0; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  CHECK(r.server.clients() == 0);
}

TEST_CASE("photographs are there for cameras that have one") {
  running r;
  auto const ask = [&](std::string const& name) {
    socket_client c(r.server.port());
    return c.ask(r.get(r.path(false) + name, r.host()));
  };
  CHECK(is(ask("photo/0.jpg"), 200));
  CHECK(ask("photo/0.jpg").find("image/jpeg") != std::string::npos);
  for (char const* name : {"photo/1.jpg", "photo/2.jpg", "photo/-1.jpg", "photo/0x.jpg", "photo/99999999999.jpg",
                           "../../etc/passwd", "%2e%2e/secret", "nothing.js"})
    CHECK_FALSE(is(ask(name), 200));
  CHECK(is(ask("thumb/0.jpg"), 200));
  CHECK(is(ask("thumb/1.jpg"), 404));
  socket_client c(r.server.port());
  CHECK_FALSE(is(c.ask("POST " + r.path() + " HTTP/1.1\r\nHost: " + r.host() + "\r\nContent-Length: 0\r\n\r\n"), 200));
}

TEST_CASE("a view at rest is the render, a moving one may be smaller") {
  running r;
  auto const c = r.client();
  gart::camera const view = camera_at({0, 0, -2}, 0, 96, 64);
  c->say(view_text(view, false, 3));
  auto const heard = c->hear();
  CHECK(heard.opcode == 2);
  frame const still = frame_of(heard.payload);
  CHECK(still.header["type"] == "frame");
  CHECK(still.header["id"] == 3);
  CHECK(still.header["still"] == true);
  CHECK(still.header["width"] == 96);
  CHECK(still.header["full"] == json({96, 64}));
  auto const expected = gart::encode_jpeg(gart::to_8bit(noise(view).color), 95);
  CHECK(still.jpeg == std::string(expected.begin(), expected.end()));

  // The last of some that move comes to rest by itself.
  for (int id = 4; id < 7; ++id) c->say(view_text(view, true, id));
  for (;;) {
    auto const next = c->hear();
    REQUIRE(next.opcode == 2);
    frame const f = frame_of(next.payload);
    CHECK(f.header["full"] == json({96, 64}));
    if (f.header["still"] == true) {
      CHECK(f.header["id"] == 6);
      CHECK(f.jpeg == still.jpeg);
      break;
    }
  }
}

TEST_CASE("points, paths, errors") {
  running r;
  auto const c = r.client(false);
  gart::camera const view = camera_at({1, 2, -2}, 0, 96, 64);
  c->say(R"({"type":"pick","id":9,"x":48,"y":32,"camera":)" + gart_test::json_of(view) + "}");
  json const picked = json::parse(c->hear().payload);
  CHECK(picked["type"] == "picked");
  CHECK(picked["hit"] == true);
  CHECK(picked["t"] == doctest::Approx(4));  // 3 / (1 - 0.25)
  CHECK(picked["point"][0] == doctest::Approx(1));
  CHECK(picked["point"][2] == doctest::Approx(2));
  gart::camera const other = camera_at({5, 2, -2}, 0, 96, 64);
  c->say(R"({"type":"path","id":2,"frames":5,"closed":false,"keyframes":[)" + gart_test::json_of(view) + "," +
         gart_test::json_of(other) + "]}");
  json const path = json::parse(c->hear().payload);
  CHECK(path["cameras"].size() == 5);
  CHECK(path["cameras"][4]["c2w"][0][3] == 5);
  c->say(view_text(camera_at({0, 0, 0}, 0, 13, 12), false));
  json const failed = json::parse(c->hear().payload);
  CHECK(failed["type"] == "error");
  CHECK(failed["what"] == "thirteen");
  CHECK(failed["of"] == "view");
  CHECK(failed["id"] == 1);
  c->say(view_text(view, false));
  CHECK(c->hear().opcode == 2);
}

TEST_CASE("no control by looking, or where nothing trains") {
  running still, training(true);
  auto const stop = R"({"type":"train","action":"stop"})", share = R"({"type":"share","value":0.5})";
  for (auto* const r : {&still, &training}) {
    auto const looks = r->client(false), controls = r->client(true);
    looks->say(stop);
    CHECK(json::parse(looks->hear().payload)["type"] == "refused");
    looks->say(share);
    CHECK(json::parse(looks->hear().payload)["what"] == "share");
    controls->say(stop), controls->say(share);
    if (r == &still) {
      CHECK(json::parse(controls->hear().payload)["type"] == "refused");
      CHECK(json::parse(controls->hear().payload)["type"] == "refused");
      CHECK_FALSE(r->server.next_action());
    } else {
      std::optional<double> value;
      for (int i = 0; i < 500 && !value; ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
        value = r->server.next_share();
      }
      CHECK(value == 0.5);
      CHECK(r->server.next_action() == gart::train_action::stop);
      CHECK_FALSE(r->server.next_action());
      gart::view_status status;
      status.step = 17;
      r->server.set_status(status);
      CHECK(json::parse(controls->hear().payload)["step"] == 17);
      CHECK(json::parse(looks->hear().payload)["step"] == 17);
    }
  }
}

TEST_CASE("a malformed message closes its connection, and is logged") {
  running r;
  auto const stays = r.client();
  auto const closed_by = [&](std::string const& payload, int opcode) {
    auto const c = r.client();
    c->say(payload, opcode);
    auto const heard = c->hear();
    CHECK(heard.opcode == 8);
    CHECK(c->hear().opcode == 0);
    return heard;
  };
  CHECK(closed_by("{", 1).code() == 1008);
  auto const named = closed_by(R"({"type":"view","id":-5})", 1);
  CHECK(named.code() == 1008);
  CHECK(named.payload.find("'id'") != std::string::npos);
  CHECK(closed_by(R"({"type":"view","id":1,"camera":3})", 1).payload.find("'camera'") != std::string::npos);
  CHECK(closed_by("bytes", 2).code() == 1003);
  CHECK(closed_by(std::string(gart::message_bytes + 1, ' '), 1).code() == 1009);
  CHECK(closed_by(std::string(1 << 20, ' '), 1).code() == 1009);
  CHECK(closed_by("\xff\xfe", 1).opcode == 8);
  {
    auto const c = r.client();
    c->say(view_text(camera_at({0, 0, 0}), false), 1, false);
    auto const heard = c->hear();
    CHECK(heard.code() == 1002);
    CHECK(heard.payload.find("without a mask") != std::string::npos);
  }
  CHECK(r.has_logged("'id'"));
  CHECK(r.has_logged("not text"));
  CHECK(r.has_logged("longer than 16384"));
  stays->say(view_text(camera_at({0, 0, 0}), false));
  CHECK(stays->hear().opcode == 2);
  for (int i = 0; i < 200 && r.server.clients() > 1; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  CHECK(r.server.clients() == 1);
}

TEST_CASE("no more clients than there is room for") {
  running r(false, 2);
  auto const a = r.client(), b = r.client();
  socket_client third(r.server.port());
  CHECK(is(third.ask(r.upgrade(r.path() + "socket", r.host(), "http://" + r.host())), 503));
}

TEST_CASE("a page that is silent makes room where all places are taken") {
  running r(false, 2, 0.3);
  auto const silent = r.client(), speaks = r.client();
  std::this_thread::sleep_for(std::chrono::milliseconds(400));
  gart::camera const view = camera_at({0, 0, 0});
  speaks->say(view_text(view, false));
  CHECK(speaks->hear().opcode == 2);
  auto const third = r.client();  // which hears hello
  auto const heard = silent->hear();
  CHECK(heard.opcode == 8);
  CHECK(heard.code() == 1013);
  speaks->say(view_text(view, false));
  CHECK(speaks->hear().opcode == 2);
  // Both that are left have just spoken.
  third->say(view_text(view, false));
  CHECK(third->hear().opcode == 2);
  socket_client fourth(r.server.port());
  CHECK(is(fourth.ask(r.upgrade(r.path() + "socket", r.host(), "http://" + r.host())), 503));
}

TEST_CASE("files of a scene need control, and come whole") {
  running plain;
  auto const post = [](running const& r, std::string const& name, std::string const& body, bool control = true,
                       std::string const& length = "") {
    return "POST " + r.path(control) + "add/" + name + " HTTP/1.1\r\nHost: " + r.host() + "\r\nOrigin: http://" +
           r.host() + "\r\nContent-Length: " + (length.empty() ? std::to_string(body.size()) : length) + "\r\n\r\n" +
           body;
  };
  auto const answer = [](running const& r, std::string const& request) {
    socket_client c(r.server.port());
    return c.ask(request);
  };
  CHECK(is(answer(plain, post(plain, "a.obj", "v 0 0 0")), 403));  // there is no scene
  gart::view_scene scene = running::scene_with(false);
  scene.traced = true;
  plain.server.set_scene(scene);
  CHECK(is(answer(plain, post(plain, "a.obj", "v 0 0 0", false)), 403));
  CHECK(is(answer(plain, post(plain, "a.txt", "v 0 0 0")), 415));
  CHECK(is(answer(plain, post(plain, "a.obj", "", true, "67108865")), 413));
  CHECK(is(answer(plain, post(plain, "a.obj", "")), 400));
  std::string foreign = post(plain, "a.obj", "v 0 0 0");
  foreign.replace(foreign.find("Origin: http://"), 15, "Origin: http://evil.");
  CHECK(is(answer(plain, foreign), 403));
  CHECK_FALSE(plain.server.next_file());
  CHECK(is(answer(plain, post(plain, "..%2Fa%20b.OBJ", "v 0 0 0\n")), 202));
  CHECK(is(answer(plain, post(plain, "b.obj", "v")), 503));  // one waits at a time
  auto const file = plain.server.next_file();
  REQUIRE(file);
  CHECK(file->name == "a b.OBJ");
  CHECK(std::string(file->bytes.begin(), file->bytes.end()) == "v 0 0 0\n");
  CHECK(is(answer(plain, post(plain, "b.obj", "v")), 202));
}

TEST_CASE("silent connections lock nobody out") {
  running r;
  auto const watches = r.client();
  std::vector<std::unique_ptr<socket_client>> silent;
  for (int i = 0; i < 300; ++i) {
    silent.push_back(std::make_unique<socket_client>(r.server.port()));
    if (i % 2) silent.back()->send("GET / HTTP/1.1\r\nHost: ");
  }
  auto const start = std::chrono::steady_clock::now();
  auto const comes = r.client();
  comes->say(view_text(camera_at({0, 0, 0}), false));
  CHECK(comes->hear().opcode == 2);
  watches->say(view_text(camera_at({0, 0, 0}), false));
  CHECK(watches->hear().opcode == 2);
  CHECK(silent.front()->receive(1).empty());  // it made room
  CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(8));
}

TEST_CASE("an image is a PNG of the size that is asked for") {
  running r;
  auto const c = r.client(false);
  gart::camera const view = camera_at({0, 0, -2}, 0, 200, 100);
  c->say(R"({"type":"image","id":5,"mode":"colour","camera":)" + gart_test::json_of(view) + "}");
  frame const file = frame_of(c->hear().payload);
  CHECK(file.header["type"] == "image");
  CHECK(file.header["id"] == 5);
  CHECK(file.header["full"] == json({200, 100}));
  auto const expected = gart::encode_png(gart::to_8bit(noise(view).color));
  CHECK(file.jpeg == std::string(expected.begin(), expected.end()));
}

TEST_CASE("a view that takes long is let go when its client moves on") {
  gart::view_server server(running::scene_with(false));
  std::atomic<bool> ends = false;
  std::atomic<int> parts = 0;
  auto const render = [&](gart::camera const& view, gart::view_settings const& s) {
    ++parts;
    double const share = std::min(s.rows.count(), view.height) / static_cast<double>(view.height);
    std::this_thread::sleep_for(std::chrono::duration<double>(2 * share));
    return noise(view);
  };
  gart::view_render slow(render);
  slow.in_parts = true;
  std::thread thread([&] {
    while (!ends) server.render_next(slow, 0.02);
  });
  {
    std::string const address = server.control_address(), path = address.substr(address.find('/', 7)),
                      host = "127.0.0.1:" + std::to_string(server.port());
    socket_client c(server.port());
    c.ask("GET " + path + "socket HTTP/1.1\r\nHost: " + host + "\r\nOrigin: http://" + host +
          "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: "
          "dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: gart-view\r\n\r\n");
    c.hear();
    gart::camera const view = camera_at({0, 0, 0}, 0, 32, 512);
    c.say(view_text(view, false, 1));
    CHECK(frame_of(c.hear().payload).header["id"] == 1);  // whole: nothing was known of its time
    CHECK(parts == 1);
    c.say(view_text(view, false, 2));
    while (parts < 2) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    c.say(view_text(camera_at({1, 0, 0}, 0, 32, 64), false, 3));
    CHECK(frame_of(c.hear().payload).header["id"] == 3);
    CHECK(parts < 5);  // of the one before, one or two of its four
  }
  ends = true;
  thread.join();
}

TEST_CASE("notes go to all, and the reason of the end with it") {
  auto r = std::make_unique<running>(true);
  auto const c = r->client();
  r->server.tell("saved");
  CHECK(json::parse(c->hear().payload) == json({{"type", "note"}, {"what", "saved"}}));
  r->server.tell_at_end("it is done");
  r.reset();
  CHECK(json::parse(c->hear().payload)["why"] == "it is done");
  CHECK(c->hear().opcode == 8);
}

TEST_CASE("a stalled client gets no more views, others go on") {
  running r;
  auto const stalled = r.client(true, 4096);
  std::vector<std::unique_ptr<socket_client>> others;
  for (int i = 0; i < 3; ++i) others.push_back(r.client());
  // Told apart by their width; noise of this size is some 500 kB.
  gart::camera const large = camera_at({0, 0, 0}, 0, 1024, 512), small = camera_at({0, 0, 0}, 0, 64, 48);
  int const rounds = 40;
  for (int round = 0; round < rounds; ++round) {
    stalled->say(view_text(large, false, round));
    for (auto const& c : others) {
      c->say(view_text(small, false, round));
      auto const heard = c->hear();
      REQUIRE(heard.opcode == 2);
      CHECK(frame_of(heard.payload).header["id"] == round);
    }
  }
  std::lock_guard const lock(r.mutex);
  auto const for_stalled = std::count(r.widths.begin(), r.widths.end(), 1024);
  CHECK(for_stalled >= 1);
  CHECK(for_stalled <= 4);  // one in the system's buffers, one in the socket's, one that waits
  CHECK(std::count(r.widths.begin(), r.widths.end(), 64) == 3 * rounds);
}

TEST_CASE("a bad address to listen at names its option") {
  running r;
  gart::view_server_options o;
  o.port = r.server.port();
  CHECK_THROWS_AS(gart::view_server(running::scene_with(false), o), gart::error);
  o.port = 70000;
  CHECK_THROWS_AS(gart::view_server(running::scene_with(false), o), gart::invalid_argument);
  o.port = 0, o.listen = "203.0.113.7";
  CHECK_THROWS_AS(gart::view_server(running::scene_with(false), o), gart::invalid_argument);
  o.listen = "no such name";
  CHECK_THROWS_AS(gart::view_server(running::scene_with(false), o), gart::invalid_argument);
}

TEST_CASE("a server that ends says so") {
  auto r = std::make_unique<running>();
  auto const c = r->client();
  r.reset();
  CHECK(json::parse(c->hear().payload)["type"] == "bye");
}

TEST_CASE("a client that reads nothing is closed in time") {
  running r;
  auto const c = r.client(true, 4096);
  gart::camera const view = camera_at({0, 0, 0}, 0, 1024, 512);
  // What it is sent no longer fits into the system's buffers.
  bool closed = false;
  for (int i = 0; i < 20'000 && !closed; ++i) {
    try {
      if (i % 50 == 0) c->say(view_text(view, false, i));
      c->say(R"({"type":"train","action":"stop"})");
    } catch (std::exception const&) {
      closed = true;
    }
  }
  CHECK(r.has_logged("nothing of what was sent is read"));
}
