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
/// The server has a thread of its own for its sockets; views are rendered in the thread that calls render_next, one at
/// a time. Only the newest view of each client is rendered, and none while the client has not yet taken the one before:
/// one that stalls costs at most two frames, and does not slow the others.
///
/// It listens on this machine alone unless options.listen says otherwise. An address has a token of 128 random bits;
/// requests with another one, or from another host's page, are answered by 403. There is no encryption: over a network
/// it goes through `ssh -L` (docs/rendering.md).
///
/// Errors: unsupported, naming the package to install, where gart was built without libwebsockets; invalid_argument for
/// an address that is not this machine's; error where the port is taken.

#include <gart/scene/image.hpp>
#include <gart/view/message.hpp>
#include <gart/view/model_view.hpp>
#include <gart/view/scene.hpp>

#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace gart {

/// How a viewer is served.
struct view_server_options {
  std::string listen = "127.0.0.1";            ///< the address or name of this machine to listen at; IPv4
  int port = 0;                                ///< 0: one that is free
  int max_clients = 8;                         ///< pages at a time; more are answered by 503
  double frame_seconds = 1.0 / 12;             ///< that a view takes while it moves, by its resolution
  static constexpr double rest_seconds = 0.2;  ///< after the last moving view, until it is rendered whole
  /// The photograph of a camera of the scene, by its index; empty where there is none. From any thread.
  std::function<image8(int)> photo;
  std::function<void(std::string)> log;  ///< a line: clients that were closed, and why; from the server's thread
};

/// Serves the views of one scene.
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
  /// Of a training: what the clients are told, now and when they come.
  void set_status(view_status const& status);
  void set_curve(view_curve const& curve);
  ///@}
  /// What a client with the right of control asked for, the oldest first.
  std::optional<train_action> next_action();
  /// The share of time that a client with that right asked for, since the last call.
  std::optional<double> next_share();

 private:
  struct state;
  std::unique_ptr<state> state_;
};

}  // namespace gart
