#include "websocket.hpp"

#include <array>
#include <bit>
#include <utility>

namespace gart::view::ws {

namespace {

// SHA-1 (FIPS 180-4): the handshake asks for it, nothing here relies on it.
std::array<u8, 20> sha1(std::string bytes) {
  std::array<u32, 5> h = {0x67452301u, 0xefcdab89u, 0x98badcfeu, 0x10325476u, 0xc3d2e1f0u};
  u64 const bits = 8 * static_cast<u64>(bytes.size());
  bytes += static_cast<char>(0x80);
  bytes.resize((bytes.size() + 8 + 63) / 64 * 64 - 8);
  for (int shift = 56; shift >= 0; shift -= 8) bytes += static_cast<char>(bits >> shift & 255);
  for (std::size_t at = 0; at < bytes.size(); at += 64) {
    std::array<u32, 80> w;
    for (std::size_t i = 0; i < 16; ++i) {
      w[i] = 0;
      for (std::size_t k = 0; k < 4; ++k) w[i] = w[i] << 8 | static_cast<unsigned char>(bytes[at + 4 * i + k]);
    }
    for (std::size_t i = 16; i < 80; ++i) w[i] = std::rotl(w[i - 3] ^ w[i - 8] ^ w[i - 14] ^ w[i - 16], 1);
    auto [a, b, c, d, e] = h;
    for (std::size_t i = 0; i < 80; ++i) {
      u32 const f = i < 20 ? (b & c) | (~b & d) : i < 40 || i >= 60 ? b ^ c ^ d : (b & c) | (b & d) | (c & d);
      u32 const k = i < 20 ? 0x5a827999u : i < 40 ? 0x6ed9eba1u : i < 60 ? 0x8f1bbcdcu : 0xca62c1d6u;
      u32 const next = std::rotl(a, 5) + f + e + k + w[i];
      e = d, d = c, c = std::rotl(b, 30), b = a, a = next;
    }
    h = {h[0] + a, h[1] + b, h[2] + c, h[3] + d, h[4] + e};
  }
  std::array<u8, 20> out;
  for (std::size_t i = 0; i < 20; ++i) out[i] = static_cast<u8>(h[i / 4] >> (24 - 8 * (i % 4)));
  return out;
}

message wrong(int code, char const* why) { return {message::wrong, why, code}; }

}  // namespace

std::string accept_of(std::string_view key) {
  auto const hash = sha1(std::string(key) + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11");
  static constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < 21; i += 3) {
    u32 const word = static_cast<u32>(hash[i] << 16 | hash[i + 1] << 8 | (i + 2 < 20 ? hash[i + 2] : 0));
    for (int shift = 18; shift >= 0; shift -= 6) text += digits[word >> shift & 63];
  }
  text.back() = '=';
  return text;
}

std::string frame_head(opcode kind, std::size_t size) {
  std::string head(1, static_cast<char>(0x80 | kind));
  int const bytes = size < 126 ? 0 : size < 65536 ? 2 : 8;
  head += static_cast<char>(bytes == 0 ? size : bytes == 2 ? 126 : 127);
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8) head += static_cast<char>(size >> shift & 255);
  return head;
}

std::string close_frame(int code, std::string_view reason) {
  std::string payload = {static_cast<char>(code >> 8), static_cast<char>(code & 255)};
  payload += reason.substr(0, 123);
  return frame_head(close, payload.size()) + payload;
}

message reader::next(std::string& came) {
  for (;;) {
    if (came.size() < 2) return {};
    auto const byte = [&](std::size_t i) { return static_cast<unsigned char>(came[i]); };
    bool const last = (byte(0) & 0x80) != 0, masked = (byte(1) & 0x80) != 0;
    unsigned const kind = byte(0) & 15u;
    bool const control = kind >= 8;
    if (byte(0) & 0x70u) return wrong(protocol_error, "a frame of an extension that was not agreed on");
    if (!masked) return wrong(protocol_error, "a frame without a mask");
    if (kind == binary) return wrong(no_text, "a message is not text");
    if (kind != continued && kind != text && kind != close && kind != ping && kind != pong)
      return wrong(protocol_error, "a frame of no known kind");
    if (kind == continued && !inside_) return wrong(protocol_error, "a fragment of no message");
    if (kind == text && inside_) return wrong(protocol_error, "a message inside of another");
    std::size_t const code = byte(1) & 127u, wide = code < 126 ? 0 : code == 126 ? 2 : 8;
    if (control && (wide > 0 || !last)) return wrong(protocol_error, "a control frame that is long or in fragments");
    if (came.size() < 2 + wide) return {};
    u64 size = wide == 0 ? code : 0;
    for (std::size_t i = 0; i < wide; ++i) size = size << 8 | byte(2 + i);
    if (!control && size > most_ - partial_.size())
      return {message::wrong, "a message is longer than " + std::to_string(most_) + " bytes", too_large};
    std::size_t const head = 2 + wide + 4, whole = head + static_cast<std::size_t>(size);
    if (came.size() < whole) return {};
    std::string payload = came.substr(head, static_cast<std::size_t>(size));
    for (std::size_t i = 0; i < payload.size(); ++i)
      payload[i] = static_cast<char>(payload[i] ^ came[2 + wide + i % 4]);
    came.erase(0, whole);
    if (kind == ping) return {message::ping, std::move(payload)};
    if (kind == pong) return {message::pong, {}};
    if (kind == close) return {message::close, std::move(payload)};
    partial_ += payload;
    inside_ = !last;
    if (last) return {message::text, std::exchange(partial_, {})};
  }
}

}  // namespace gart::view::ws
