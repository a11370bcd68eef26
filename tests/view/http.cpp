// Requests are read as a browser means them, or refused; hosts and origins are this server's or those that it allows.
#include <access.hpp>
#include <gart/core/error.hpp>
#include <http.hpp>

#include <doctest/doctest.h>

#include <random>

namespace {

using gart::view::access;
using gart::view::head_state;
using gart::view::http_request;

head_state read(std::string text, http_request& to) { return gart::view::take_request(text, to); }
head_state read(std::string const& text) {
  http_request ignored;
  return read(text, ignored);
}

}  // namespace

TEST_CASE("a request's line and headers, and what comes behind it") {
  http_request r;
  std::string came =
      "GET /a/b HTTP/1.1\r\nHost: one:80\r\nX-Thing:  two words \r\nConnection: keep-alive, Upgrade\r\n\r\nGET /";
  CHECK(gart::view::take_request(came, r) == head_state::whole);
  CHECK(r.method == "GET");
  CHECK(r.path == "/a/b");
  CHECK(r.header("host") == "one:80");
  CHECK(r.header("x-thing") == "two words");
  CHECK(r.header("origin").empty());
  CHECK(r.lists("connection", "upgrade"));
  CHECK_FALSE(r.lists("connection", "close"));
  CHECK_FALSE(r.last);
  CHECK(came == "GET /");
  CHECK(gart::view::take_request(came, r) == head_state::unfinished);
  for (std::string const text : {"GET / HTTP/1.0\r\n\r\n", "GET / HTTP/1.1\r\nConnection: Close\r\n\r\n"}) {
    CHECK(read(text, r) == head_state::whole);
    CHECK(r.last);
  }
  CHECK(read("POST / HTTP/1.1\r\nContent-Length: 0\r\n\r\n") == head_state::whole);
}

TEST_CASE("what is no request is wrong") {
  for (char const* text :
       {"\r\n\r\n", "GET\r\n\r\n", "GET / HTTP/2\r\n\r\n", "GET x HTTP/1.1\r\n\r\n", "GET /a b HTTP/1.1\r\n\r\n",
        "GET / HTTP/1.1\r\nno colon\r\n\r\n", "GET / HTTP/1.1\r\n: empty\r\n\r\n",
        "GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n", "GET / HTTP/1.1\r\nOrigin: a\r\nOrigin: b\r\n\r\n",
        "GET / HTTP/1.1\r\nA: b\r\n folded\r\n\r\n", "GET / HTTP/1.1\r\nContent-Length: 5\r\n\r\n",
        "GET / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n", "GET /\x01 HTTP/1.1\r\n\r\n"}) {
    CAPTURE(text);
    CHECK(read(text) == head_state::wrong);
  }
  CHECK(read(std::string(gart::view::request_head_most + 1, 'x')) == head_state::wrong);
  CHECK(read("GET / HTTP/1.1\r\nCookie: " + std::string(20000, 'c') + "\r\n\r\n") == head_state::whole);
}

TEST_CASE("a damaged request is taken, refused or waited for") {
  std::string const good =
      "GET /0123456789abcdef0123456789abcdef/socket HTTP/1.1\r\nHost: 127.0.0.1:8765\r\nOrigin: a\r\n\r\n";
  std::mt19937 engine(7);
  for (int round = 0; round < 4000; ++round) {
    std::string text = good.substr(0, engine() % (good.size() + 1));
    for (unsigned i = engine() % 4; i > 0 && !text.empty(); --i)
      text[engine() % text.size()] = static_cast<char>(engine());
    std::string rest = text;
    http_request r;
    head_state const is = gart::view::take_request(rest, r);
    CHECK((is == head_state::whole || rest == text || rest.size() < text.size()));
    if (is == head_state::whole) {
      CHECK(r.path.front() == '/');
      CHECK(r.path.find('\n') == std::string::npos);
      for (auto const& [name, value] : r.headers) CHECK((name + value).find('\r') == std::string::npos);
    }
  }
}

TEST_CASE("hosts and origins are the server's or an allowed proxy's") {
  access const gate({"127.0.0.1", "localhost"}, {"Viewer.example.org", "lan:9000"}, 8765);
  for (char const* host :
       {"127.0.0.1:8765", "LOCALHOST:8765", "viewer.example.org", "viewer.example.org:444", "lan:9000"}) {
    CAPTURE(host);
    CHECK(gate.host_is_ours(host));
    CHECK(gate.origin_is_ours("http://" + std::string(host), host));
  }
  for (char const* host : {"", "127.0.0.1", "127.0.0.1:80", "lan", "lan:9001", "evil.org",
                           "viewer.example.org.evil.org", "evil.org:8765", "xviewer.example.org"}) {
    CAPTURE(host);
    CHECK_FALSE(gate.host_is_ours(host));
  }
  // A proxy that ends https, and tells its own name or the one that it asks for.
  CHECK(gate.origin_is_ours("https://viewer.example.org", "viewer.example.org"));
  CHECK(gate.origin_is_ours("https://viewer.example.org", "127.0.0.1:8765"));
  CHECK(gate.origin_is_ours("https://lan:9000", "lan:9000"));
  CHECK_FALSE(gate.origin_is_ours("https://127.0.0.1:8765", "127.0.0.1:8765"));
  CHECK_FALSE(gate.origin_is_ours("https://evil.org", "viewer.example.org"));
  CHECK_FALSE(gate.origin_is_ours("null", "viewer.example.org"));
  CHECK_FALSE(gate.origin_is_ours("ftp://viewer.example.org", "viewer.example.org"));
  for (char const* wrong :
       {"", "https://viewer.example.org", "viewer.example.org/path", "*", "a b", "lan:", "lan:90x"}) {
    CAPTURE(wrong);
    CHECK_THROWS_AS(access({}, {wrong}, 1), gart::invalid_argument);
  }
}
