#pragma once
// The WebSocket protocol (RFC 6455) without sockets: frames in and out, and the word that answers a client's key.

#include <gart/core/types.hpp>

#include <cstddef>
#include <string>
#include <string_view>

namespace gart::view { namespace ws {

enum opcode : u8 { continued = 0, text = 1, binary = 2, close = 8, ping = 9, pong = 10 };

// Codes of a close.
inline constexpr int normal = 1000, going_away = 1001, protocol_error = 1002, no_text = 1003, policy_violation = 1008,
                     too_large = 1009, try_again_later = 1013;

// The value of Sec-WebSocket-Accept.
std::string accept_of(std::string_view key);

// What stands before so many bytes of a whole message of the server.
std::string frame_head(opcode kind, std::size_t size);
// A close, with a reason of at most 123 bytes.
std::string close_frame(int code, std::string_view reason);

// What a client sent: a whole text, a ping or a close; or that it broke the protocol, and how.
struct message {
  enum kind { none, text, ping, pong, close, wrong } is = none;
  std::string payload;  // of a wrong one: the reason
  int code = 0;         // of a wrong one: of the close that it is answered by
};

// Reads the frames of a client. Masks are asked for, no extension is known, texts may be in fragments.
class reader {
 public:
  explicit reader(std::size_t most) : most_(most) {}
  // The next message, which is taken off the front of what came; none where it is not all there.
  message next(std::string& came);

 private:
  std::size_t most_;     // bytes of a text
  std::string partial_;  // a text of which fragments are missing
  bool inside_ = false;  // one has begun
};

}  // namespace ws

}  // namespace gart::view
