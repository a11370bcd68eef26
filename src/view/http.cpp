#include "http.hpp"

#include <gart/core/words.hpp>

#include <algorithm>
#include <charconv>

namespace gart::view {

namespace {

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

bool plain_text(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return (c >= ' ' && c != 0x7f) || c == '\t' || c < 0; });
}

// "GET /path HTTP/1.1"
bool take_first_line(std::string_view line, http_request& to) {
  std::size_t const a = line.find(' '), b = line.rfind(' ');
  if (a == line.npos || a == 0 || b == a) return false;
  std::string_view const version = line.substr(b + 1);
  if (version != "HTTP/1.1" && version != "HTTP/1.0") return false;
  to.last = version == "HTTP/1.0";
  to.method = line.substr(0, a), to.path = line.substr(a + 1, b - a - 1);
  return to.path.starts_with('/') && to.path.find(' ') == to.path.npos && plain_text(line);
}

char const* reason_of(int status) {
  static constexpr std::pair<int, char const*> reasons[] = {{101, "Switching Protocols"},
                                                            {200, "OK"},
                                                            {202, "Accepted"},
                                                            {400, "Bad Request"},
                                                            {403, "Forbidden"},
                                                            {404, "Not Found"},
                                                            {405, "Method Not Allowed"},
                                                            {413, "Content Too Large"},
                                                            {415, "Unsupported Media Type"}};
  for (auto const& [code, reason] : reasons)
    if (code == status) return reason;
  return "Service Unavailable";
}

}  // namespace

std::string_view http_request::header(std::string_view name) const {
  for (auto const& [own, value] : headers)
    if (own == name) return value;
  return {};
}

bool http_request::lists(std::string_view name, std::string_view word) const {
  std::string const all = lower(header(name));
  for (std::string_view rest = all; !rest.empty();) {
    std::size_t const comma = std::min(rest.find(','), rest.size());
    if (trimmed(rest.substr(0, comma)) == word) return true;
    rest.remove_prefix(std::min(comma + 1, rest.size()));
  }
  return false;
}

head_state take_request(std::string& came, http_request& to) {
  std::size_t const end = came.find("\r\n\r\n");
  if (end == came.npos) return came.size() > request_head_most ? head_state::wrong : head_state::unfinished;
  if (end > request_head_most) return head_state::wrong;
  std::string const head = came.substr(0, end + 2);
  came.erase(0, end + 4);
  to = {};
  std::size_t from = head.find("\r\n");
  if (!take_first_line(std::string_view(head).substr(0, from), to)) return head_state::wrong;
  for (from += 2; from < head.size();) {
    std::size_t const stop = head.find("\r\n", from), colon = head.find(':', from);
    if (colon >= stop || colon == from) return head_state::wrong;
    std::string_view const line = std::string_view(head).substr(from, stop - from);
    if (!plain_text(line) || line[0] == ' ' || line[0] == '\t') return head_state::wrong;
    to.headers.emplace_back(lower(line.substr(0, colon - from)), trimmed(line.substr(colon - from + 1)));
    from = stop + 2;
  }
  for (char const* once : {"host", "origin", "content-length"}) {
    auto const is = [&](auto const& h) { return h.first == once; };
    if (std::count_if(to.headers.begin(), to.headers.end(), is) > 1) return head_state::wrong;
  }
  to.last = to.last || to.lists("connection", "close");
  std::string_view const length = to.header("content-length");
  if (!to.header("transfer-encoding").empty()) return head_state::wrong;
  if (length.empty() || length == "0") return head_state::whole;
  auto const [stop, fault] = std::from_chars(length.data(), length.data() + length.size(), to.body_bytes);
  bool const known = fault == std::errc() && stop == length.data() + length.size();
  return known && to.method == "POST" ? head_state::whole : head_state::wrong;
}

std::string answer_head(int status, std::vector<std::string> const& headers) {
  std::string text = "HTTP/1.1 " + std::to_string(status) + " " + reason_of(status) + "\r\n";
  for (std::string const& one : headers) text += one + "\r\n";
  return text + "\r\n";
}

}  // namespace gart::view
