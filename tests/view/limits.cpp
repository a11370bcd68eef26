// The most that a client may send or ask for is taken; one more is refused.
#include "cameras.hpp"

#include <gart/core/error.hpp>
#include <gart/view/message.hpp>

#include <doctest/doctest.h>
#include <http.hpp>

TEST_CASE("the longest path is read, and none longer") {
  std::string const c = gart_test::json_of(gart_test::camera_at({1, 2, 3}, 0.5));
  auto const path = [&](int frames) {
    return gart::parse_message(R"({"type":"path","id":2,"frames":)" + std::to_string(frames) +
                               R"(,"closed":false,"keyframes":[)" + c + "," + c + "]}");
  };
  CHECK(std::get<gart::path_message>(path(gart::path_frames_most)).frames == gart::path_frames_most);
  CHECK_THROWS_WITH_AS(path(gart::path_frames_most + 1), doctest::Contains("'frames'"), gart::invalid_argument);
}

TEST_CASE("the longest head of a request is read, and none longer") {
  std::string const before = "GET / HTTP/1.1\r\nCookie: ";
  for (std::size_t const longer : {0u, 1u}) {
    CAPTURE(longer);
    std::string came = before + std::string(gart::view::request_head_most - before.size() + longer, 'c') + "\r\n\r\n";
    gart::view::http_request to;
    CHECK(gart::view::take_request(came, to) ==
          (longer ? gart::view::head_state::wrong : gart::view::head_state::whole));
  }
}
