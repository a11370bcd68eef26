#pragma once
// HTTP and WebSockets, in a thread of their own: the page's files, photographs, and the messages of the clients.

#include "access.hpp"
#include "clients.hpp"

#include <memory>
#include <string>

namespace gart::view {

class sockets {
 public:
  // Listens from here on. error where the port is taken.
  sockets(clients& all, view_server_options const& options);
  ~sockets();

  std::string address(access_right of) const;
  int port() const;

 private:
  struct state;
  std::unique_ptr<state> state_;
};

}  // namespace gart::view
