#pragma once
// Reads requests of HTTP/1.1 (browsers) and HTTP/1.0 (some proxies) strictly, and writes heads of answers. A POST alone
// has a body.

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace gart::view {

// Other servers of this machine may have left a browser large cookies.
inline constexpr std::size_t request_head_most = 32768;

struct http_request {
  std::string method, path;
  std::vector<std::pair<std::string, std::string>> headers;  // names in small letters
  bool last = false;                                         // whether the connection ends with its answer
  std::size_t body_bytes = 0;                                // that follow the head

  // Empty where there is none.
  std::string_view header(std::string_view name) const;
  // Whether a header that is a list has the word, in letters of any size.
  bool lists(std::string_view name, std::string_view word) const;
};

enum class head_state { unfinished, whole, wrong };

// Takes a request's head off the front of what came, once it is all there. Wrong: no HTTP/1, too long, two hosts or
// origins, a body of no POST or of unknown length.
head_state take_request(std::string& came, http_request& to);

// The head of an answer: "HTTP/1.1 200 OK" and its headers, one a line, "Name: value".
std::string answer_head(int status, std::vector<std::string> const& headers);

}  // namespace gart::view
