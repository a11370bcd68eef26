// In place of the server, where gart is built without libwebsockets.

#include "sockets.hpp"

#include <gart/core/error.hpp>

namespace gart::view {

struct sockets::state {};

sockets::sockets(clients&, view_server_options const&) {
  throw unsupported(
      "the viewer needs libwebsockets, which this build of gart lacks (install libwebsockets-dev on Debian or Ubuntu "
      "and "
      "build gart again)");
}
sockets::~sockets() = default;
std::string sockets::address(access_right) const { return {}; }
int sockets::port() const { return 0; }

}  // namespace gart::view
