#pragma once
/// \file
/// A viewer in the browser: serves a page and the views that it asks for. In a program of your own:
///
///   gart::model_file const file = gart::load_model("model.ply");
///   gart::configuration_request request;
///   request.sh_degree = file.model.sh_degree;
///   auto const renderer = gart::make_renderer(request);
///   gart::view_server server(gart::scene_of("model", file.model, file.kernel_degree));
///   std::puts(server.control_address().c_str());
///   auto const render = gart::render_of(*renderer, file.model, file.render);
///   for (;;) server.render_next(render, 1.0);
///
/// The server has a thread for its sockets. The thread that calls render_next renders views, one at a time. Only a
/// client's newest view is rendered, after the client has taken the one before. So a stalled client costs at most two
/// frames, and does not slow the others. A slow view at rest is rendered in parts. It is dropped between two of them
/// when the client has moved on or left.
///
/// It listens on this machine alone unless options.listen says otherwise. An address has a token of 128 random bits.
/// Requests with another token, or from another host's page, get 403. There is no encryption: over a network it goes
/// through `ssh -L` (docs/rendering.md). Connections that stay silent make room for others.
///
/// Errors: invalid_argument for an address that is not this machine's; error where the port is taken.

#include <gart/scene/image.hpp>
#include <gart/view/message.hpp>
#include <gart/view/model_view.hpp>
#include <gart/view/scene.hpp>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace gart {

/// How a viewer is served.
struct view_server_options {
  std::string listen = "127.0.0.1";  ///< the address or name of this machine to listen at; IPv4
  int port = 0;                      ///< 0: one that is free
  /// Other hosts that a browser may name, "NAME" or "NAME:PORT": of containers, of proxies (https too), of a network.
  std::vector<std::string> allowed_hosts = {};
  int max_clients = 8;                         ///< pages at a time; more are answered by 503
  double silent_seconds = 30;                  ///< after which a page gives its place to another where all are taken
  double frame_seconds = 1.0 / 12;             ///< that a view takes while it moves, by its resolution
  static constexpr double rest_seconds = 0.2;  ///< after the last moving view, until it is rendered whole
  /// The photograph of a camera of the scene, by its index; empty where there is none. From any thread.
  std::function<image8(int)> photo;
  std::function<void(std::string)> log;  ///< a line: clients that were closed, and why; from the server's thread
};

/// A mesh or an image of light that a page sent, to be added to a scene.
struct added_file {
  std::string name;       ///< as its sender has it, without a folder: .glb, .obj, .ply, .hdr or .exr
  std::vector<u8> bytes;  ///< at most added_bytes_most
};
inline constexpr std::size_t added_bytes_most = std::size_t{64} << 20;  ///< of one

/// Serves views of one scene.
class view_server {
 public:
  /// Listens from here on.
  explicit view_server(view_scene scene, view_server_options options = {});
  /// Tells the clients that it ends.
  ~view_server();

  /// For the browser: may look, and control a training.
  std::string control_address() const;
  /// For the browser: may look.
  std::string view_address() const;
  /// The port that it listens at.
  int port() const;
  /// Pages that are open.
  int clients() const noexcept;
  /// Whether no page is open and nothing is left that was asked for: one atomic load.
  bool idle() const noexcept;

  /// Waits at most so long for a view that is wanted, renders it and hands it on. The seconds that this took without
  /// the wait; 0 where nothing was wanted.
  double render_next(view_render const& render, double wait_seconds);

  ///@{
  /// Sets what present and later clients are told: a training's state, and PSNR of views by the camera's index.
  void set_status(view_status const& status);
  void set_curve(view_curve const& curve);
  void set_scores(std::vector<std::pair<int, double>> const& scores);
  ///@}
  void tell(std::string const& note);  ///< to those who are there: a line on the page
  void tell_at_end(std::string why);   ///< what they are told when the server ends
  /// In place of the scene: what was opened. Views of the one before are let go.
  void set_scene(view_scene scene);
  /// What a client with the right of control asked for, the oldest first.
  std::optional<train_action> next_action();
  /// The one of view_scene.models that a client with that right wants opened, since the last call.
  std::optional<int> next_model();
  /// What a client with that right changed of view_scene.parts, one part at a time.
  std::optional<part_edit> next_edit();
  /// What a client with that right sent to be added to the scene. One waits at a time.
  std::optional<added_file> next_file();
  /// What the parts are by now, and the text that saves them. Views at rest are rendered again.
  void set_parts(std::vector<view_part> parts, std::string scene_json);
  /// The share of time that a client with that right asked for, since the last call.
  std::optional<double> next_share();

 private:
  struct state;
  std::unique_ptr<state> state_;
};

}  // namespace gart
