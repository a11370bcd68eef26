// A path rendered to frames, and a training that is looked at and controlled from outside.
#include "program.hpp"

#include <gart/io/camera_file.hpp>
#include <gart/io/dataset.hpp>
#include <gart/view/camera_path.hpp>
#include <run_folder.hpp>
#include <view/socket_client.hpp>

#include <support/policies.hpp>

#include <cstring>

using namespace cli_test;

namespace {

// The first address that a program prints into a file, once it is there.
struct address {
  int port = 0;
  std::string path;
};
address printed_address(fs::path const& file, std::string const& before) {
  for (int waited_ms = 0; waited_ms < 120'000; waited_ms += 20) {
    std::string const text = fs::exists(file) ? text_of(file) : std::string();
    std::size_t const line = text.find(before), at = text.find("http://127.0.0.1:", line);
    if (line != text.npos && at != text.npos && text.find('\n', at) != text.npos) {
      std::string const url = text.substr(at + 17, text.find('\n', at) - at - 17);
      return {std::stoi(url), url.substr(url.find('/'))};
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return {};
}

std::string upgrade(address const& to) {
  std::string const host = "127.0.0.1:" + std::to_string(to.port);
  return "GET " + to.path + "socket HTTP/1.1\r\nHost: " + host + "\r\nOrigin: http://" + host +
         "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
         "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: gart-view\r\n\r\n";
}

// The next text of a kind for which `is` holds.
template <class Is>
nlohmann::json heard(gart_test::socket_client& client, std::string const& type, Is const& is) {
  for (int i = 0; i < 10'000; ++i) {
    auto const message = client.hear();
    REQUIRE(message.opcode != 0);
    if (message.opcode != 1) continue;
    auto const text = nlohmann::json::parse(message.payload);
    if (text["type"] == type && is(text)) return text;
  }
  FAIL("never said: ", type);
  return {};
}

}  // namespace

TEST_CASE("render goes along a smooth path through keyframes") {
  folder const here;
  gart::write_splat_ply(here / "model.ply", one_gaussian());
  std::vector<gart::named_camera> keys(3);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    gart::camera& c = keys[i].view;
    c.width = c.height = 16, c.fx = c.fy = 16, c.cx = c.cy = 8;
    c.position = {0.4 * static_cast<double>(i), 0.1 * static_cast<double>(i * i), -4};
    keys[i].name = "key" + std::to_string(i);
  }
  gart::write_cameras(here / "keys.json", keys);
  auto const run = here.gart("render model.ply --path keys.json --frames 5 --out film --backend serial --quiet");
  REQUIRE_MESSAGE(run.code == 0, run.err);
  std::vector<gart::named_camera> frames;
  for (auto const& view : gart::smooth_path({keys[0].view, keys[1].view, keys[2].view}, 5))
    frames.push_back({"frame_0000" + std::to_string(frames.size()), view});
  gart::write_cameras(here / "frames.json", frames);
  REQUIRE(here.gart("render model.ply frames.json --out one_by_one --backend serial --quiet").code == 0);
  for (auto const& frame : frames)
    CHECK(text_of(here / ("film/" + frame.name + ".png")) == text_of(here / ("one_by_one/" + frame.name + ".png")));
  CHECK(text_of(here / "film/frame_00000.png") != text_of(here / "film/frame_00004.png"));

  // With times of their own: the second keyframe comes after a quarter.
  nlohmann::json timed = here.json("keys.json");
  double const seconds[] = {1, 2, 5};
  for (std::size_t i = 0; i < 3; ++i) timed[i]["time"] = seconds[i];
  gart::write_file(here / "timed.json", timed.dump());
  REQUIRE(here.gart("render model.ply --path timed.json --frames 5 --out timed --backend serial --quiet").code == 0);
  gart::write_cameras(here / "second.json", {{"second", keys[1].view}});
  REQUIRE(here.gart("render model.ply second.json --out second --backend serial --quiet").code == 0);
  CHECK(text_of(here / "timed/frame_00001.png") == text_of(here / "second/second.png"));
  timed[2]["time"] = 2;
  gart::write_file(here / "timed.json", timed.dump());
  auto const back = here.gart("render model.ply --path timed.json --frames 5 --out timed --backend serial");
  CHECK(back.code == 1);
  CHECK_MESSAGE(has(back.err, "not after the one before"), back.err);
  timed[2].erase("time");
  gart::write_file(here / "timed.json", timed.dump());
  auto const some = here.gart("render model.ply --path timed.json --frames 5 --out timed --backend serial");
  CHECK(some.code == 1);
  CHECK_MESSAGE(has(some.err, "timed.json, camera 2: has no number \"time\""), some.err);

  for (char const* wrong : {"", " keys.json --path keys.json --frames 5", " --path keys.json", " keys.json --frames 5",
                            " keys.json --closed", " --path keys.json --frames 1"}) {
    CAPTURE(wrong);
    CHECK(here.gart("render model.ply" + std::string(wrong) + " --out none").code == 2);
  }
}

TEST_CASE("a viewer watches, pauses, steps, saves and stops a training") {
  folder const here;
  write_capture(here / "capture");
  outcome ended;
  std::thread program([&] {
    ended = here.gart(
        "train capture --out run --iterations 1000000 --max-gaussians 60 --sh-degree 0 --no-auto --backend openmp "
        "--threads 1 --eval-every 50000 --view --view-share 0.2");
  });
  address const control = printed_address(here / "stdout.txt", "Look and control");
  {
    REQUIRE(control.port > 0);
    gart_test::socket_client client(control.port);
    REQUIRE(has(client.ask(upgrade(control)), " 101 "));
    auto const any = [](nlohmann::json const&) { return true; };
    auto const hello = heard(client, "hello", any);
    CHECK(hello["training"] == true);
    CHECK(hello["cameras"].size() == 6);
    CHECK(hello["cameras"][5]["test"] == true);
    auto const first = heard(client, "status", any);
    CHECK(first["view_share"] == 0.2);
    client.say(R"({"type":"share","value":0.5})");
    heard(client, "status", [](nlohmann::json const& s) { return s["view_share"] == 0.5; });

    client.say(R"({"type":"train","action":"pause"})");
    auto const paused = heard(client, "status", [](nlohmann::json const& s) { return s["paused"] == true; });
    int const step = paused["step"];
    client.say(R"({"type":"train","action":"step"})");
    heard(client, "status", [&](nlohmann::json const& s) { return s["paused"] == true && s["step"] == step + 1; });
    client.say(R"({"type":"view","id":1,"mode":"colour","moving":false,"camera":)" +
               hello["cameras"][0]["camera"].dump() + "}");
    while (client.hear().opcode != 2) continue;

    auto const before = fs::last_write_time(here / "run/checkpoint.gart");
    client.say(R"({"type":"train","action":"save"})");
    for (int i = 0; i < 1000 && fs::last_write_time(here / "run/checkpoint.gart") == before; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    CHECK(fs::last_write_time(here / "run/checkpoint.gart") != before);
    auto const saved = heard(client, "note", any);
    CHECK(has(saved["what"], "Saved run/checkpoint.gart at step " + std::to_string(step + 1)));
    client.say(R"({"type":"train","action":"resume"})");
    heard(client, "status", [&](nlohmann::json const& s) { return s["paused"] == false && s["step"] > step + 1; });
    client.say(R"({"type":"train","action":"stop"})");
    CHECK(has(heard(client, "note", any)["what"], "is being saved"));
    CHECK(has(heard(client, "bye", any)["why"], "gart train --resume --out run"));
  }
  program.join();
  CHECK(ended.code == 130);
  CHECK(fs::exists(here / "run/model.ply"));
  CHECK(has(ended.err, "Stopped after step"));
}

TEST_CASE("view takes its background from a model's config.json") {
  folder const here;
  auto const background_with = [&](std::string const& config) {
    std::ofstream(here / "config.json") << config;
    return gart_cli::background_of_run(here / "model.ply");
  };
  CHECK(gart_cli::background_of_run(here / "model.ply").empty());
  std::string const head = R"({"gart":"1","options":{},"chosen":)";
  CHECK(background_with(
            head + R"([{"option":"--tracer","value":"tiles"},{"option":"--background","value":"white"}]})") == "white");
  for (std::string const& other :
       {head + "[]}", head + "3}", head + R"([3,{"option":"--background","value":1}]})", std::string("{"),
        std::string(R"({"chosen":[{"option":"--background","value":"white"}]})")}) {
    CAPTURE(other);
    CHECK(background_with(other).empty());
  }
}

TEST_CASE("a view at rest is what render writes, before it is a JPEG") {
  folder const here;
  write_capture(here / "capture");
  // Another from each side.
  gart::gaussian_model model = one_gaussian();
  model.mean = {0.4f, 0.1f, 0.2f}, model.log_scale = {-0.5f, -1.6f, -1.1f};
  gart::write_splat_ply(here / "model.ply", model);
  outcome ended;
  std::thread program([&] {
    ended = here.gart_interrupted_at("gart: viewer:", "view model.ply capture --backend serial --background white");
  });
  address const look = printed_address(here / "stdout.txt", "Look alone");
  std::vector<gart::named_camera> views;
  std::vector<std::string> seen;
  {
    gart_test::socket_client client(look.port);
    REQUIRE(has(client.ask(upgrade(look)), " 101 "));
    auto const hello = heard(client, "hello", [](nlohmann::json const&) { return true; });
    REQUIRE(hello["cameras"].size() == 6);
    for (auto const& listed : hello["cameras"]) {
      nlohmann::json camera = listed["camera"];
      client.say(R"({"type":"view","id":1,"mode":"colour","moving":false,"camera":)" + camera.dump() + "}");
      auto frame = client.hear();
      while (frame.opcode == 1) frame = client.hear();
      REQUIRE(frame.opcode == 2);
      gart::u32 header = 0;
      std::memcpy(&header, frame.payload.data(), 4);
      seen.push_back(frame.payload.substr(4 + header));
      camera["name"] = "view" + std::to_string(seen.size() - 1);
      gart::write_file(here / (camera["name"].get<std::string>() + ".json"), nlohmann::json::array({camera}).dump());
    }
    client.say("no message");  // which is logged
    while (client.hear().opcode == 1) continue;
  }
  program.join();
  CHECK(ended.code == 0);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    CAPTURE(i);
    std::string const name = "view" + std::to_string(i);
    auto const run =
        here.gart("render model.ply " + name + ".json --out out --backend serial --background white --quiet");
    REQUIRE_MESSAGE(run.code == 0, run.err);
    auto const jpeg = gart::encode_jpeg(gart::read_image(here / ("out/" + name + ".png")), 95);
    CHECK(seen[i] == std::string(jpeg.begin(), jpeg.end()));
    CHECK((i == 0 || seen[i] != seen[0]));
  }
}

TEST_CASE("--open leads the browser by a file for its user alone") {
  folder const here;
  gart::write_splat_ply(here / "model.ply", one_gaussian());
  std::string const script = (here / "browser").string(), opened = (here / "opened.html").string();
  gart::write_file(script, "#!/bin/sh\ncp -p \"$1\" '" + opened + "'\n");
  fs::permissions(script, fs::perms::owner_all);
  setenv("BROWSER", script.c_str(), 1);
  auto const ended = here.gart_interrupted_at("Ctrl-C ends it", "view model.ply --backend serial --open");
  setenv("BROWSER", (here / "none").c_str(), 1);
  auto const without = here.gart_interrupted_at("could not open it", "view model.ply --backend serial --open");
  unsetenv("BROWSER");
  CHECK(ended.code == 0);
  CHECK(without.code == 0);
  REQUIRE(fs::exists(opened));
  std::size_t const at = ended.out.find("http://");
  CHECK(has(text_of(opened), "url=" + ended.out.substr(at, ended.out.find('\n', at) - at) + "\""));
  CHECK((fs::status(opened).permissions() & fs::perms::all) == (fs::perms::owner_read | fs::perms::owner_write));
}

TEST_CASE("view serves until Ctrl-C and refuses unusable addresses") {
  folder const here;
  gart::write_splat_ply(here / "model.ply", one_gaussian());
  auto const wrong = here.gart("view model.ply --listen nowhere.invalid");
  CHECK(wrong.code == 1);
  CHECK_MESSAGE(has(wrong.err, "--listen"), wrong.err);
  CHECK(here.gart("view model.ply --port 70000").code == 2);
  auto const host = here.gart("view model.ply --allow-host https://viewer.example.org/");
  CHECK(host.code == 1);
  CHECK_MESSAGE(has(host.err, "--allow-host: 'https://viewer.example.org/' is no name of a host"), host.err);
  CHECK(here.gart("view nothing.ply").code == 1);
  auto const ended = here.gart_interrupted_at("Ctrl-C ends it", "view model.ply --backend serial");
  CHECK(ended.code == 0);
  CHECK(has(ended.out, "Look and control: http://127.0.0.1:"));
  CHECK(has(ended.out, "Look alone:"));
  CHECK(has(ended.out, "ssh -L"));
}
