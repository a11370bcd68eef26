// Frames of RFC 6455: the examples of its text, and everything that a client must not send.
#include <gart/view/message.hpp>
#include <log_lines.hpp>
#include <websocket.hpp>

#include <doctest/doctest.h>

#include <random>

namespace {

namespace ws = gart::view::ws;

// A client's frame.
std::string framed(std::string const& payload, int first = 0x81, bool masked = true) {
  std::string frame(1, static_cast<char>(first));
  std::size_t const n = payload.size();
  int const mask_bit = masked ? 0x80 : 0;
  if (n < 126) {
    frame += static_cast<char>(mask_bit | static_cast<int>(n));
  } else {
    frame += static_cast<char>(mask_bit | 126), frame += static_cast<char>(n >> 8), frame += static_cast<char>(n & 255);
  }
  char const mask[4] = {0x37, static_cast<char>(0xfa), 0x21, 0x3d};
  if (masked) frame.append(mask, 4);
  for (std::size_t i = 0; i < n; ++i) frame += masked ? static_cast<char>(payload[i] ^ mask[i % 4]) : payload[i];
  return frame;
}

ws::message read(std::string bytes) { return ws::reader(1000).next(bytes); }

}  // namespace

TEST_CASE("the examples of RFC 6455: key, masked text, fragments") {
  CHECK(ws::accept_of("dGhlIHNhbXBsZSBub25jZQ==") == "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=");
  CHECK(read("\x81\x85\x37\xfa\x21\x3d\x7f\x9f\x4d\x51\x58").payload == "Hello");
  ws::reader reader(1000);
  std::string came = framed("Hel", 0x01) + framed("ping", 0x89) + framed("lo", 0x80) + framed("next");
  CHECK(reader.next(came).is == ws::message::ping);
  auto const whole = reader.next(came);
  CHECK(whole.is == ws::message::text);
  CHECK(whole.payload == "Hello");
  CHECK(reader.next(came).payload == "next");
  CHECK(reader.next(came).is == ws::message::none);
  CHECK(came.empty());
  CHECK(ws::frame_head(ws::text, 5) == "\x81\x05");
  CHECK(ws::frame_head(ws::binary, 256) == std::string("\x82\x7e\x01\x00", 4));
  CHECK(ws::frame_head(ws::binary, 65536) == std::string("\x82\x7f\0\0\0\0\0\x01\0\0", 10));
}

TEST_CASE("a message that comes byte by byte is the same") {
  ws::reader reader(1000);
  std::string came;
  std::string const sent = framed(std::string(300, 'x'));
  for (std::size_t i = 0; i < sent.size(); ++i) {
    came += sent[i];
    auto const m = reader.next(came);
    CHECK((m.is == ws::message::text) == (i + 1 == sent.size()));
  }
}

TEST_CASE("what a client must not send is wrong, with its code") {
  auto const code_of = [](std::string const& bytes) {
    auto const m = read(bytes);
    return m.is == ws::message::wrong ? m.code : 0;
  };
  CHECK(code_of(framed("no mask", 0x81, false)) == 1002);
  CHECK(code_of(framed("", 0x89, false)) == 1002);     // nor in a ping
  CHECK(code_of(framed("compressed", 0xc1)) == 1002);  // a bit of an extension
  CHECK(code_of(framed("?", 0x83)) == 1002);           // a kind that is not there
  CHECK(code_of(framed("goes on", 0x80)) == 1002);     // of nothing
  CHECK(code_of(framed("long", 0x09)) == 1002);        // a ping in fragments
  CHECK(code_of(framed(std::string(126, 'p'), 0x89)) == 1002);
  std::string inside = framed("begun", 0x01) + framed("another", 0x81);
  ws::reader reader(1000);
  CHECK(reader.next(inside).code == 1002);
  CHECK(code_of(framed("bytes", 0x82)) == 1003);
  CHECK(code_of(framed(std::string(1001, 'x'))) == 1009);
  CHECK(code_of(framed(std::string(1000, 'x'))) == 0);
  CHECK(code_of("\x81\xff\xff\xff\xff\xff\xff\xff\xff\xff") == 1009);  // before any of it came
  std::string parts;
  for (int i = 0; i < 3; ++i) parts += framed(std::string(400, 'x'), i == 0 ? 0x01 : 0x00);
  ws::reader longer(1000);
  CHECK(longer.next(parts).code == 1009);
}

TEST_CASE("bytes that mean nothing end in a fault or in nothing") {
  std::mt19937 engine(5);
  for (int round = 0; round < 2000; ++round) {
    ws::reader reader(1000);
    std::string bytes;
    for (unsigned i = engine() % 60; i > 0; --i) bytes += static_cast<char>(engine());
    std::size_t const size = bytes.size();
    for (int i = 0; i < 100; ++i) {
      auto const m = reader.next(bytes);
      if (m.is == ws::message::none || m.is == ws::message::wrong) break;
      CHECK(m.payload.size() <= size);
    }
  }
}

TEST_CASE("a line for the log is plain text, and few come in a second") {
  using gart::view::escaped;
  CHECK(escaped("plain 'text'", 100) == "plain 'text'");
  CHECK(escaped(std::string("a\x1b[2J\n\xc3\xa4\0b", 9), 100) == "a\\x1b[2J\\x0a\\xc3\\xa4\\x00");
  CHECK(escaped("123\x01", 6) == "123");
  gart::view::log_rate rate;
  int written = 0;
  for (int i = 0; i < 1000; ++i) written += !rate.line("again", 100 + 0.001 * i).empty();
  CHECK(written >= 10);
  CHECK(written <= 12);
  std::string const later = rate.line("and now", 200);
  CHECK(later.find("and now (") == 0);
  CHECK(later.find(std::to_string(1000 - written) + " lines") != std::string::npos);
  CHECK(rate.line("once", 201) == "once");
}
