#pragma once
// A browser's part of HTTP and of the WebSocket protocol (RFC 6455), as little as the tests need, over a plain socket.

#include <arpa/inet.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>

namespace gart_test {

class socket_client {
 public:
  explicit socket_client(int port, int receive_buffer = 0) : fd_(::socket(AF_INET, SOCK_STREAM, 0)) {
    if (receive_buffer > 0) setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    timeval const limit{20, 0};
    setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    setsockopt(fd_, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
    sockaddr_in to{};
    to.sin_family = AF_INET, to.sin_port = htons(static_cast<std::uint16_t>(port));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::connect(fd_, reinterpret_cast<sockaddr*>(&to), sizeof to) != 0) throw std::runtime_error("no connection");
  }
  ~socket_client() { ::close(fd_); }
  socket_client(socket_client const&) = delete;
  socket_client& operator=(socket_client const&) = delete;

  void send(std::string const& bytes) {
    for (std::size_t at = 0; at < bytes.size();) {
      ssize_t const n = ::send(fd_, bytes.data() + at, bytes.size() - at, MSG_NOSIGNAL);
      if (n <= 0) throw std::runtime_error("the server takes nothing");
      at += static_cast<std::size_t>(n);
    }
  }
  // All that is there of `size` bytes before the connection ends.
  std::string receive(std::size_t size) {
    std::string bytes(size, '\0');
    std::size_t at = 0;
    while (at < size) {
      ssize_t const n = ::recv(fd_, bytes.data() + at, size - at, 0);
      if (n <= 0) break;
      at += static_cast<std::size_t>(n);
    }
    bytes.resize(at);
    return bytes;
  }
  std::string headers() {
    std::string text;
    while (text.find("\r\n\r\n") == text.npos) {
      std::string const one = receive(1);
      if (one.empty()) break;
      text += one;
    }
    return text;
  }

  // The headers of an answer; its body follows.
  std::string ask(std::string const& request) {
    send(request);
    return headers();
  }

  // A message of a client has its bytes masked.
  void say(std::string const& payload, int opcode = 1, bool masked = true) {
    std::string frame(1, static_cast<char>(0x80 | opcode));
    std::size_t const n = payload.size(), bit = masked ? 0x80 : 0;
    if (n < 126) {
      frame += static_cast<char>(bit | n);
    } else if (n < 65536) {
      frame += static_cast<char>(bit | 126);
      frame += static_cast<char>(n >> 8), frame += static_cast<char>(n & 255);
    } else {
      frame += static_cast<char>(bit | 127);
      for (int shift = 56; shift >= 0; shift -= 8) frame += static_cast<char>((n >> shift) & 255);
    }
    char const mask[4] = {0x11, 0x22, 0x33, 0x44};
    if (masked) frame.append(mask, 4);
    for (std::size_t i = 0; i < n; ++i) frame += masked ? static_cast<char>(payload[i] ^ mask[i % 4]) : payload[i];
    send(frame);
  }
  struct heard {
    int opcode = 0;  // 0: the connection ended
    std::string payload;
    // Of a close.
    int code() const {
      return payload.size() < 2
                 ? 0
                 : (static_cast<unsigned char>(payload[0]) << 8) | static_cast<unsigned char>(payload[1]);
    }
  };
  // The next whole message, its fragments put together; pings are answered.
  heard hear() {
    heard message;
    for (;;) {
      std::string const head = receive(2);
      if (head.size() < 2) return {};
      int const opcode = head[0] & 15;
      bool const last = (head[0] & 0x80) != 0;
      std::uint64_t size = static_cast<unsigned char>(head[1]) & 127;
      if (size >= 126) {
        std::string const more = receive(size == 126 ? 2 : 8);
        size = 0;
        for (unsigned char const byte : more) size = size << 8 | byte;
      }
      std::string const payload = receive(size);
      if (payload.size() < size) return {};
      if (opcode == 9) {
        say(payload, 10);
        continue;
      }
      if (opcode != 0) message.opcode = opcode;
      message.payload += payload;
      if (last) return message;
    }
  }

 private:
  int fd_;
};

}  // namespace gart_test
