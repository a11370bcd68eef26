#pragma once
// What `gart view` and `gart train --view` share: where the viewer listens, the capture's cameras and photographs.

#include "help.hpp"
#include "open_browser.hpp"

#include <gart/io/dataset.hpp>
#include <gart/view/server.hpp>

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace gart_cli {

struct view_options {
  std::string listen = "127.0.0.1";
  int port = 0;
  std::vector<std::string> allowed_hosts;
  bool open = false;
};

// --listen, --port, --allow-host and --open, or with a prefix of their own: "view-".
void add_view_options(CLI::App& app, view_options& options, std::string const& prefix);

// All views of a capture, training views first, in the order in which photographs are asked for.
std::vector<gart::view_camera> view_cameras_of(gart::dataset const& data);
// The dataset must outlive the server.
gart::view_server_options server_options_of(view_options const& options, gart::dataset const& data);

void say_addresses(gart::view_server const& server, view_options const& options, std::FILE* to);
// By --open, for as long as it is held; null without it.
std::unique_ptr<opened_browser> open_address(gart::view_server const& server, view_options const& options);

}  // namespace gart_cli
