// What is rendered for whom: the newest view of each, files last, and nothing that nobody waits for.
#include "cameras.hpp"

#include <clients.hpp>
#include <parts.hpp>

#include <doctest/doctest.h>

namespace {

using gart_test::camera_at;
using gart_test::view_text;

gart::view_scene scene() {
  gart::view_scene s;
  s.models = {"one.ply", "two.ply"};
  return s;
}

std::string image_text(int id) {
  std::string text = view_text(camera_at({0, 0, 0}), false, id);
  text.replace(text.find("\"view\""), 6, "\"image\"");
  return text.erase(text.find("\"moving\":false,"), 15);
}

}  // namespace

TEST_CASE("a view is let go that was replaced, or whose client left") {
  gart::view_server_options const options;
  gart::view::clients all(scene(), options);
  int const id = all.add(true);
  CHECK(all.receive(id, view_text(camera_at({0, 0, 0}), false, 1), 0).reason.empty());
  auto const first = all.next_job(1, 0);
  REQUIRE(first);
  CHECK(first->still);
  CHECK(all.waited_for(*first));
  all.receive(id, view_text(camera_at({1, 0, 0}), false, 1), 1);  // of the same number: it is not this that counts
  CHECK_FALSE(all.waited_for(*first));
  auto const second = all.next_job(2, 0);
  REQUIRE(second);
  CHECK(all.waited_for(*second));
  all.receive(id, view_text(camera_at({2, 0, 0}), true, 3), 2);
  auto const moving = all.next_job(2, 0);
  REQUIRE(moving);
  CHECK_FALSE(moving->still);
  all.receive(id, view_text(camera_at({3, 0, 0}), true, 4), 2);
  CHECK(all.waited_for(*moving));  // else a view that moves would never be seen
  all.remove(id);
  CHECK_FALSE(all.waited_for(*second));
  CHECK_FALSE(all.waited_for(*moving));
}

TEST_CASE("a saved image comes after the views, to its client") {
  gart::view_server_options const options;
  gart::view::clients all(scene(), options);
  int const a = all.add(false), b = all.add(false);
  CHECK(all.receive(a, image_text(7), 0).reason.empty());
  all.receive(b, view_text(camera_at({0, 0, 0}), false, 1), 0);
  auto const view = all.next_job(1, 0), image = all.next_job(1, 0);
  REQUIRE(view);
  REQUIRE(image);
  CHECK(view->client == b);
  CHECK(std::get<gart::image_message>(image->wanted).id == 7);
  all.receive(a, view_text(camera_at({0, 0, 0}), true, 8), 1);
  CHECK(all.waited_for(*image));  // whoever moves on still wants the file
  all.finish_image(*image, {1, 2, 3});
  std::vector<gart::u8> bytes;
  CHECK_FALSE(all.take_frame(b, bytes, 1));
  CHECK(all.take_frame(a, bytes, 1));
  CHECK(bytes.size() == 3);
}

TEST_CASE("control opens another model, and all hear of its scene") {
  gart::view_server_options const options;
  gart::view::clients all(scene(), options);
  int const controls = all.add(true), looks = all.add(false);
  auto const texts_of = [&](int id) {
    std::string text, last;
    while (all.take_text(id, text)) last = text;
    return last;
  };
  CHECK(texts_of(controls).find("two.ply") != std::string::npos);
  CHECK(texts_of(looks).find("two.ply") == std::string::npos);
  all.receive(looks, R"({"type":"model","index":1})", 0);
  CHECK(texts_of(looks).find("refused") != std::string::npos);
  all.receive(controls, R"({"type":"model","index":2})", 0);
  CHECK(texts_of(controls).find("no such model") != std::string::npos);
  CHECK_FALSE(all.next_model());
  all.receive(controls, R"({"type":"model","index":1})", 0);
  CHECK(all.next_model() == 1);
  CHECK_FALSE(all.next_model());
  all.receive(looks, view_text(camera_at({0, 0, 0}), false), 0);
  gart::view_scene other = scene();
  other.name = "two", other.model = 1;
  all.set_scene(other);
  CHECK_FALSE(all.next_job(1, 0));  // the view was of the other model
  CHECK(texts_of(looks).find("\"two\"") != std::string::npos);
  CHECK(all.scene()->name == "two");
  all.set_scores({{3, 21.5}});
  CHECK(texts_of(looks) == R"({"psnr":[[3,21.5]],"type":"scores"})");
}

TEST_CASE("features that the model has not close the connection") {
  gart::view_server_options const options;
  gart::view_scene with = scene();
  with.features = 3;
  gart::view::clients all(with, options);
  int const a = all.add(false);
  auto const asked = [&](std::string const& places) {
    std::string text = view_text(camera_at({0, 0, 0}), false, 1, ",\"features\":" + places);
    return all.receive(a, text.replace(text.find("colour"), 6, "features"), 0).reason;
  };
  CHECK(asked("[2]").empty());
  CHECK(asked("[0,1,3]").find("'features'") != std::string::npos);
}

TEST_CASE("parts are whole tiles, each row once, while one waits") {
  for (int height : {1, 31, 32, 33, 500, 4096})
    for (double ms : {0.0, 100.0, 1100.0, 1e6}) {
      CAPTURE(height);
      CAPTURE(ms);
      auto const parts = gart::view::parts_of(height, ms);
      CHECK(parts.size() <= 4);
      CHECK((ms > 1000 && height > 64) == (parts.size() > 1 && height > 64));
      CHECK(parts.front().first == 0);
      CHECK(parts.back().end >= height);
      for (std::size_t i = 1; i < parts.size(); ++i) {
        CHECK(parts[i].first == parts[i - 1].end);
        CHECK(parts[i].first % 32 == 0);
        CHECK(parts[i].first < height);
      }
    }
  auto const parts = gart::view::parts_of(320, 1e6);
  REQUIRE(parts.size() == 4);
  int rendered = 0;
  auto const render = [&](gart::view_settings const& s) {
    ++rendered;
    return gart::image8(2, 320, 1, static_cast<gart::u8>(s.rows.first / 32));
  };
  auto const whole = gart::view::in_parts(
      parts, [] { return true; }, {}, render);
  REQUIRE(whole);
  for (int y = 0; y < 320; ++y) CHECK(whole->at(1, y, 0) == y / 96 * 3);
  rendered = 0;
  CHECK_FALSE(gart::view::in_parts(
      parts, [&] { return rendered < 2; }, {}, render));
  CHECK(rendered == 2);
}
