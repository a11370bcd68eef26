#include "access.hpp"

#include <gart/core/error.hpp>
#include <gart/core/types.hpp>
#include <gart/core/words.hpp>

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <netdb.h>
#include <sys/random.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

namespace gart::view {

namespace {

// In a time that does not tell how far they are alike.
bool same(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    difference |= static_cast<unsigned>(static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]));
  return difference == 0;
}

// "name" or "name:port", from a Host header.
bool is_host(std::string_view text) {
  std::string_view const name = text.substr(0, text.find(':')), port = text.substr(name.size());
  auto const is_of_name = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '.' || c == '-' || c == '_';
  };
  auto const is_digit = [](char c) { return c >= '0' && c <= '9'; };
  return !name.empty() && std::all_of(name.begin(), name.end(), is_of_name) &&
         (port.empty() || (port.size() > 1 && std::all_of(port.begin() + 1, port.end(), is_digit)));
}

std::string text_of(in_addr address) {
  char text[INET_ADDRSTRLEN] = {};
  inet_ntop(AF_INET, &address, text, sizeof text);
  return text;
}

std::vector<std::string> addresses_of_this_machine() {
  std::vector<std::string> all;
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return all;
  for (ifaddrs const* i = list; i; i = i->ifa_next)
    if (i->ifa_addr && i->ifa_addr->sa_family == AF_INET)
      all.push_back(text_of(reinterpret_cast<sockaddr_in const*>(i->ifa_addr)->sin_addr));
  freeifaddrs(list);
  return all;
}

}  // namespace

std::string new_token() {
  std::array<u8, 16> bytes{};
  std::size_t have = 0;
  while (have < bytes.size()) {
    ssize_t const n = getrandom(bytes.data() + have, bytes.size() - have, 0);
    if (n < 0 && errno != EINTR) throw error(std::string("the system gives no random bits: ") + std::strerror(errno));
    if (n > 0) have += static_cast<std::size_t>(n);
  }
  static constexpr char digits[] = "0123456789abcdef";
  std::string text;
  for (u8 const b : bytes) text += digits[b >> 4], text += digits[b & 15];
  return text;
}

access::access(std::vector<std::string> hosts, std::vector<std::string> allowed, int port)
    : hosts_(std::move(hosts)), allowed_(std::move(allowed)), port_(port) {
  for (std::string& host : hosts_) host = lower(host);
  for (std::string& host : allowed_) {
    host = lower(host);
    if (!is_host(host))
      throw invalid_argument("view_server_options.allowed_hosts: '" + host +
                             "' is no name of a host (give it without scheme and path, as viewer.example.org or "
                             "192.168.1.7:9000)");
  }
}

request_path access::path_of(std::string_view path) const {
  std::size_t const slash = path.empty() || path[0] != '/' ? path.npos : path.find('/', 1);
  if (slash == path.npos) return {};
  std::string_view const token = path.substr(1, slash - 1);
  access_right of = access_right::none;
  if (same(token, view_)) of = access_right::view;
  if (same(token, control_)) of = access_right::control;
  return {of, of == access_right::none ? std::string() : std::string(path.substr(slash + 1))};
}

bool access::is_allowed(std::string_view host) const {
  std::string const asked = lower(host), name = asked.substr(0, asked.find(':'));
  return std::any_of(allowed_.begin(), allowed_.end(),
                     [&](std::string const& one) { return one == asked || one == name; });
}

bool access::host_is_ours(std::string_view host) const {
  std::string const asked = lower(host), port = ":" + std::to_string(port_);
  return is_allowed(host) || std::any_of(hosts_.begin(), hosts_.end(), [&](std::string const& own) {
           return asked == own + port || (port_ == 80 && asked == own);
         });
}

bool access::origin_is_ours(std::string_view origin, std::string_view host) const {
  std::string const from = lower(origin);
  if (from == "http://" + lower(host)) return true;
  for (std::string_view const scheme : {"http://", "https://"})
    if (from.starts_with(scheme) && is_allowed(std::string_view(from).substr(scheme.size()))) return true;
  return false;
}

std::string access::address(access_right of) const {
  return "http://" + hosts_.front() + ":" + std::to_string(port_) + "/" +
         (of == access_right::control ? control_ : view_) + "/";
}

listen_place listen_place_of(std::string const& listen) {
  in_addr numeric{};
  bool const is_number = inet_pton(AF_INET, listen.c_str(), &numeric) == 1;
  listen_place place{listen, {listen}};
  if (!is_number) {
    addrinfo hints{}, *found = nullptr;
    hints.ai_family = AF_INET, hints.ai_socktype = SOCK_STREAM;
    if (listen.empty() || getaddrinfo(listen.c_str(), nullptr, &hints, &found) != 0 || !found)
      throw invalid_argument("view_server_options.listen: '" + listen +
                             "' is no IPv4 address or name of this machine (0.0.0.0 is all of its addresses)");
    numeric = reinterpret_cast<sockaddr_in const*>(found->ai_addr)->sin_addr;
    freeaddrinfo(found);
    place.address = text_of(numeric);
    place.hosts.push_back(place.address);
  }
  std::vector<std::string> const own = addresses_of_this_machine();
  bool const all = numeric.s_addr == 0, loopback = (ntohl(numeric.s_addr) >> 24) == 127;
  if (!all && !loopback && std::find(own.begin(), own.end(), place.address) == own.end())
    throw invalid_argument("view_server_options.listen: " + listen +
                           " is not an address of this machine (0.0.0.0 is all of "
                           "its addresses)");
  if (all) {
    place.hosts.clear();
    char name[256] = {};
    if (gethostname(name, sizeof name - 1) == 0 && name[0]) place.hosts.emplace_back(name);
    place.hosts.insert(place.hosts.end(), own.begin(), own.end());
  }
  if (all || loopback)
    for (char const* host : {"127.0.0.1", "localhost"})
      if (std::find(place.hosts.begin(), place.hosts.end(), host) == place.hosts.end()) place.hosts.emplace_back(host);
  return place;
}

}  // namespace gart::view
