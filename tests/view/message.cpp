// What a client sends is read as it was meant, or refused by the name of what is wrong.
#include "cameras.hpp"

#include <gart/core/error.hpp>
#include <gart/view/message.hpp>

#include <doctest/doctest.h>

#include <cstring>
#include <utility>

namespace {

using gart_test::camera_at;
using gart_test::json_of;
using gart_test::view_text;

std::string refusal(std::string const& text) {
  try {
    gart::parse_message(text);
  } catch (gart::invalid_argument const& e) {
    return e.what();
  }
  return "accepted";
}

std::string replaced(std::string text, std::string const& from, std::string const& to) {
  std::size_t const at = text.find(from);
  REQUIRE(at != text.npos);
  return text.replace(at, from.size(), to);
}

}  // namespace

TEST_CASE("every kind of message is read") {
  gart::camera const c = camera_at({1, 2, 3}, 0.5);
  auto const view = std::get<gart::view_message>(
      gart::parse_message(replaced(view_text(c, true, 7, R"(,"near":0.5)"), R"("crop":null,"photo":null)",
                                   R"("crop":{"min":[-1,-2,-3],"max":[1,2,3]},"photo":4)")));
  CHECK(view.id == 7);
  CHECK(view.moving);
  CHECK(view.mode == gart::view_mode::colour);
  CHECK(view.view.position == c.position);
  CHECK(view.view.rotation == c.rotation);
  CHECK(view.view.fx == c.fx);
  CHECK(view.settings.crop->low == gart::vec3(-1, -2, -3));
  CHECK(view.settings.crop->high == gart::vec3(1, 2, 3));
  CHECK(*view.settings.near == 0.5f);
  CHECK(*view.photo == 4);
  auto const plain = std::get<gart::view_message>(gart::parse_message(view_text(c, false)));
  CHECK_FALSE(plain.settings.crop);
  CHECK_FALSE(plain.photo);

  auto const pick = std::get<gart::pick_message>(
      gart::parse_message(R"({"type":"pick","id":1,"x":3.5,"y":4.5,"camera":)" + json_of(c) + "}"));
  CHECK(pick.x == 3.5f);
  CHECK(pick.y == 4.5f);
  auto const path = std::get<gart::path_message>(gart::parse_message(
      R"({"type":"path","id":2,"frames":10,"closed":false,"keyframes":[)" + json_of(c) + "," + json_of(c) + "]}"));
  CHECK(path.keyframes.size() == 2);
  CHECK(path.frames == 10);
  auto const timed = std::get<gart::path_message>(
      gart::parse_message(R"({"type":"path","id":2,"frames":10,"closed":false,"times":[0,2.5],"keyframes":[)" +
                          json_of(c) + "," + json_of(c) + "]}"));
  CHECK(timed.times == std::vector<double>{0, 2.5});
  gart::camera large = c;
  large.width = 16000, large.height = 2000;
  auto const image = std::get<gart::image_message>(
      gart::parse_message(R"({"type":"image","id":3,"mode":"depth","camera":)" + json_of(large) +
                          R"(,"background":[0,0.5,1],"opacity":0.5,"size":2,"shape":"points"})"));
  CHECK(image.view.width == 16000);
  CHECK(image.mode == gart::view_mode::depth);
  CHECK(*image.settings.background == gart::vec3(0, 0.5f, 1));
  CHECK(image.settings.opacity == 0.5f);
  CHECK(image.settings.size == 2);
  CHECK(image.settings.shape == gart::view_shape::points);
  CHECK_FALSE(image.settings.own_gaussians());
  CHECK(plain.settings.own_gaussians());
  CHECK(std::get<gart::model_message>(gart::parse_message(R"({"type":"model","index":2})")).index == 2);
  for (auto const& one : names_of(gart::train_action{}))
    CHECK(std::get<gart::train_message>(
              gart::parse_message(std::string(R"({"type":"train","action":")") + one.name + "\"}"))
              .action == one.value);
  CHECK(std::get<gart::share_message>(gart::parse_message(R"({"type":"share","value":0.5})")).value == 0.5);
}

TEST_CASE("what is wrong is refused by the field's name") {
  gart::camera const c = camera_at({0, 0, 0});
  std::string const good = view_text(c, true);
  CHECK(refusal(good) == "accepted");
  struct {
    char const *from, *to, *named;
  } const wrong[] = {
      {R"("type":"view")", R"("type":"look")", "'type'"},
      {R"("type":"view",)", "", "'type' is missing"},
      {R"("type":"view")", R"("type":7)", "'type'"},
      {R"("id":1)", R"("id":-1)", "'id'"},
      {R"("id":1)", R"("id":1.5)", "'id'"},
      {R"("id":1)", R"("id":"1")", "'id'"},
      {R"("id":1,)", "", "'id' is missing"},
      {R"("mode":"colour")", R"("mode":"heat")", "'mode'"},
      {R"("moving":true)", R"("moving":1)", "'moving'"},
      {R"("crop":null)", R"("crop":[1])", "'crop'"},
      {R"("crop":null)", R"("crop":{"min":[0,0],"max":[1,1,1]})", "'crop.min'"},
      {R"("crop":null)", R"("crop":{"min":[2,0,0],"max":[1,1,1]})", "'crop'"},
      {R"("crop":null)", R"("crop":{"min":[0,0,0],"max":[1,1,1e30]})", "'crop.max'"},
      {R"("photo":null)", R"("photo":-1)", "'photo'"},
      {R"("photo":null)", R"("photo":0.5)", "'photo'"},
      {R"("photo":null)", R"("photo":null,"near":0)", "'near'"},
      {R"("photo":null)", R"("photo":null,"colour":1)", "'colour' is no field"},
      {R"("width":64)", R"("width":5000)", "'camera' is larger than 4096"},
      {R"("width":64)", R"("width":0)", "'width'"},
      {R"("fx":64.0)", R"("fx":-1)", "camera"},
      {R"("c2w")", R"("c3w")", "'c2w' is missing"},
      {R"("name":"view")", R"("camera_model":"CUBE")", "CUBE"},
  };
  for (auto const& w : wrong) {
    CAPTURE(w.to);
    CHECK(refusal(replaced(good, w.from, w.to)).find(w.named) != std::string::npos);
  }
  CHECK(refusal(R"({"type":"pick","id":1,"x":65,"y":0,"camera":)" + json_of(c) + "}").find("'x'") != std::string::npos);
  CHECK(refusal(R"({"type":"path","id":2,"frames":1,"closed":false,"keyframes":[]})").find("'frames'") !=
        std::string::npos);
  CHECK(refusal(R"({"type":"path","id":2,"frames":9,"closed":false,"keyframes":[)" + json_of(c) + "]}")
            .find("'keyframes'") != std::string::npos);
  CHECK(refusal(R"({"type":"path","id":2,"frames":9,"closed":false,"keyframes":[)" + json_of(c) + ",3]}")
            .find("'keyframes[1]'") != std::string::npos);
  for (auto const& [field, value] : {std::pair{"background", "[0,0]"},
                                     {"background", "[0,0,2]"},
                                     {"opacity", "0"},
                                     {"size", "1e9"},
                                     {"size", "[1]"},
                                     {"shape", "\"cubes\""}})
    CHECK(refusal(view_text(c, true, 1, ",\"" + std::string(field) + "\":" + value)).find(field) != std::string::npos);
  CHECK(refusal(R"({"type":"path","id":2,"frames":9,"closed":false,"times":["a"],"keyframes":[)" + json_of(c) + "," +
                json_of(c) + "]}")
            .find("'times'") != std::string::npos);
  gart::camera large = c;
  large.width = 7000, large.height = 7000;
  CHECK(refusal(R"({"type":"image","id":3,"mode":"depth","camera":)" + json_of(large) + "}").find("40000000 pixels") !=
        std::string::npos);
  CHECK(refusal(R"({"type":"model","index":-1})").find("'index'") != std::string::npos);
  CHECK(refusal(R"({"type":"train","action":"explode"})").find("'action'") != std::string::npos);
  CHECK(refusal(R"({"type":"share","value":2})").find("'value'") != std::string::npos);
}

TEST_CASE("what is no message at all is refused") {
  for (char const* text : {"", "{", "[]", "null", "7", "{\"type\":}", "\xff\xfe", "{\"type\":\"view\"} more"}) {
    CAPTURE(text);
    CHECK(refusal(text) != "accepted");
  }
  CHECK(refusal(R"({"type":"train","action":"stop","x":")" + std::string(gart::message_bytes, 'a') + "\"}")
            .find("longer than 16384") != std::string::npos);
  std::string const deep = std::string(7000, '[') + std::string(7000, ']');
  CHECK(refusal(R"({"type":"view","crop":)" + deep + "}").find("too deep") != std::string::npos);
  CHECK(refusal(std::string(16000, '[')) != "accepted");
  CHECK(refusal(R"({"type":"share","value":1e999})") != "accepted");
}

TEST_CASE("a frame is its header's length, its header and a JPEG") {
  gart::frame_header header;
  header.id = 5, header.width = 3, header.height = 2, header.full_width = 6, header.full_height = 4;
  header.mode = gart::view_mode::depth, header.low = 1, header.high = 2, header.still = true;
  auto const bytes = gart::frame_bytes(header, {9, 8, 7});
  gart::u32 length = 0;
  std::memcpy(&length, bytes.data(), 4);
  REQUIRE(bytes.size() == 4 + length + 3);
  std::string const text(reinterpret_cast<char const*>(bytes.data()) + 4, length);
  for (char const* part : {R"("type":"frame")", R"("id":5)", R"("full":[6,4])", R"("mode":"depth")", R"("still":true)",
                           R"("scale":[1.0,2.0])"})
    CHECK(text.find(part) != std::string::npos);
  CHECK(bytes.back() == 7);
  header.file = true;
  auto const file = gart::frame_bytes(header, {1});
  CHECK(std::string(file.begin() + 4, file.end()).find(R"("type":"image")") != std::string::npos);
}
