#pragma once
// Who may come in: tokens in the path, the Host and Origin that a browser sends.

#include <string>
#include <string_view>
#include <vector>

namespace gart::view {

// 128 random bits of the system, in hex.
std::string new_token();

enum class access_right { none, view, control };

// A path "/TOKEN/rest", and whose token it is.
struct request_path {
  access_right of = access_right::none;
  std::string rest;
};

class access {
 public:
  // `hosts` are the names by which this machine may be called at the port where it listens. `allowed` are others, of
  // containers and proxies that pass requests on. These are at any port where they name none, and through https too.
  access(std::vector<std::string> hosts, std::vector<std::string> allowed, int port);

  request_path path_of(std::string_view path) const;
  // Whether a Host header names this server: a page of another name that resolves to this machine does not.
  bool host_is_ours(std::string_view host) const;
  // Whether an Origin header names this Host or an allowed one: a proxy may send its own name only.
  bool origin_is_ours(std::string_view origin, std::string_view host) const;

  std::string address(access_right of) const;  // for the browser

 private:
  bool is_allowed(std::string_view host) const;

  std::vector<std::string> hosts_, allowed_;
  int port_;
  std::string control_ = new_token(), view_ = new_token();
};

// The numeric address to listen at, and the names under which browsers may ask for it. Throws invalid_argument for
// anything but an IPv4 address or name of this machine.
struct listen_place {
  std::string address;
  std::vector<std::string> hosts;  // the first is the one to print
};
listen_place listen_place_of(std::string const& listen);

}  // namespace gart::view
