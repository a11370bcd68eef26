#include "view_options.hpp"

#include "field_names.hpp"
#include "options.hpp"
#include "printable.hpp"

namespace gart_cli {

void add_view_options(CLI::App& app, view_options& options, std::string const& prefix) {
  add_value(app, "--" + prefix + "listen", options.listen, "ADDRESS",
            "Address or name of this machine that the viewer is served at;\n0.0.0.0 is all of them: any who have "
            "the printed address get in,\nand nothing is encrypted");
  add_value(app, "--" + prefix + "port", options.port, "N", "Its port, 0: one that is free")->check(between(0, 65535));
  add_open(app, "--" + prefix + "allow-host", options.allowed_hosts, "NAME",
           "Another host that a browser may ask for, of a container, a proxy\n(https too) or a network: NAME, or "
           "NAME:PORT for one port alone;\nby commas, or once for each")
      ->delimiter(',');
  app.add_flag("--" + prefix + "open", options.open, "Open the address in this machine's browser");
}

std::vector<gart::view_camera> view_cameras_of(gart::dataset const& data) {
  std::vector<gart::view_camera> cameras;
  for (auto const* views : {&data.train, &data.test})
    for (gart::dataset_view const& v : *views)
      cameras.push_back({v.name, v.view, views == &data.test, !v.image.empty()});
  return cameras;
}

gart::view_server_options server_options_of(view_options const& options, gart::dataset const& data) {
  gart::view_server_options out;
  out.listen = options.listen, out.port = options.port, out.allowed_hosts = options.allowed_hosts;
  out.photo = [&data](int index) {
    auto const i = static_cast<std::size_t>(index);
    return i < data.train.size() ? data.train[i].image : data.test.at(i - data.train.size()).image;
  };
  out.log = [](std::string const& line) { std::fprintf(stderr, "gart: viewer: %s\n", in_options(line).c_str()); };
  return out;
}

void say_addresses(gart::view_server const& server, view_options const& options, std::FILE* to) {
  std::fprintf(to, "Look and control: %s\nLook alone:       %s\n", server.control_address().c_str(),
               server.view_address().c_str());
  if (options.listen == "127.0.0.1" || options.listen == "localhost")
    std::fprintf(to, "From another machine: ssh -L %d:127.0.0.1:%d THIS_MACHINE, then the same address there.\n",
                 server.port(), server.port());
  if (!options.allowed_hosts.empty())
    std::fprintf(to, "Also with the host %s in its place, where that leads to port %d.\n",
                 options.allowed_hosts.front().c_str(), server.port());
  std::fflush(to);
}

std::unique_ptr<opened_browser> open_address(gart::view_server const& server, view_options const& options) {
  if (!options.open) return nullptr;
  auto browser = std::make_unique<opened_browser>(server.control_address());
  if (!browser->said.empty()) std::fprintf(stderr, "gart: %s\n", printable(browser->said).c_str());
  return browser;
}

}  // namespace gart_cli
