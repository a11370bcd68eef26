#pragma once
// Answers requests of HTTP with a file of the page, a photograph, or an error. Decides who may become a viewer.

#include "access.hpp"
#include "clients.hpp"
#include "http.hpp"

#include <string>

namespace gart::view {

struct http_answer {
  int status = 200;
  std::string type, body;
  std::string log;  // a line for the log, where there is something to say
};

class requests {
 public:
  // All of them outlive it.
  requests(access const& gate, clients const& all, view_server_options const& options)
      : gate_(gate), all_(all), options_(options) {}

  http_answer answer(http_request const& asked) const;
  // Before the body of a POST is read: 202 where it is taken.
  http_answer may_send(http_request const& asked) const;
  // That of a file that was sent.
  std::string sent_name(http_request const& asked) const;
  // The status by which a WebSocket is refused; 101 where it is let in.
  int upgrade(http_request const& asked) const;
  access_right right_of(http_request const& asked) const { return gate_.path_of(asked.path).of; }
  // The headers of every answer, which isolate the page.
  std::vector<std::string> safe_headers(http_request const& asked) const;

 private:
  bool from_here(http_request const& asked, bool origin_required) const;
  std::vector<u8> photograph(std::string_view name) const;

  access const& gate_;
  clients const& all_;
  view_server_options const& options_;
};

}  // namespace gart::view
