#pragma once
/// \file
/// The messages between a viewer's page and its server, without sockets. Texts are one JSON object each; frames and
/// images are bytes. docs/rendering.md has the fields of each.
///
/// parse_message reads a client's message strictly: at most message_bytes, and objects no deeper than message_depth.
/// Every field is present and in its range, with no others. Errors: invalid_argument naming the field. Texts to clients
/// are whole JSON objects. A frame is {u32 length of the header, header JSON, JPEG}.

#include <gart/core/names.hpp>
#include <gart/core/types.hpp>
#include <gart/scene/camera.hpp>
#include <gart/view/scene.hpp>

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace gart {

inline constexpr std::size_t message_bytes = 16384;  ///< of the largest message that a client may send
inline constexpr int message_depth = 6;              ///< of objects and lists in each other
inline constexpr int view_size_most = 4096;          ///< pixels a side of a view that a client may ask for
inline constexpr int image_size_most = 16384;        ///< pixels a side of an image to be saved
inline constexpr int image_pixels_most = 40000000;   ///< in all of it
inline constexpr int path_frames_most = 10000;       ///< cameras of a path that a client may ask for

/// A view to be rendered.
struct view_message {
  u64 id = 0;                          ///< of the message, sent back with its frame
  camera view;                         ///< of the size of the page's canvas
  view_mode mode = view_mode::colour;  ///< what is shown of it
  bool moving = false;                 ///< soon followed by another: time is worth more than pixels
  view_settings settings;              ///< how it differs from the model
  std::optional<int> photo;            ///< index of the camera whose photograph view_mode::error is against
};

/// A view as a PNG, of any size.
struct image_message {
  u64 id = 0;                          ///< of the message, sent back with the file
  camera view;                         ///< of the size of the image
  view_mode mode = view_mode::colour;  ///< what is shown of it
  view_settings settings;              ///< how it differs from the model
  std::optional<int> photo;            ///< as in view_message
};

/// The point that is seen through one of a view's pixels is to be found.
struct pick_message {
  u64 id = 0;              ///< of the message
  camera view;             ///< that the pixel is of
  float x = 0, y = 0;      ///< image point, pixels
  view_settings settings;  ///< how it differs from the model
};

/// A smooth path through keyframes is wanted.
struct path_message {
  u64 id = 0;                     ///< of the message
  std::vector<camera> keyframes;  ///< two at least
  int frames = 0;                 ///< cameras along the path
  bool closed = false;            ///< whether it ends where it began
  /// Times of the keyframes, and of a closed path's end, in increasing seconds from 0; empty: by their distances.
  std::vector<double> times;
};

/// Another of view_scene.models is to be opened; needs the right of control.
struct model_message {
  int index = 0;  ///< which
};

/// What a viewer may ask of a training.
enum class train_action { pause, resume, step, save, stop };
/// Their names.
constexpr auto names_of(train_action) {
  return std::array<name_of<train_action>, 5>{{{train_action::pause, "pause"},
                                               {train_action::resume, "resume"},
                                               {train_action::step, "step"},
                                               {train_action::save, "save"},
                                               {train_action::stop, "stop"}}};
}
/// Asks it; needs the right of control.
struct train_message {
  train_action action = train_action::pause;  ///< which
};
/// Sets the share of a training's time that views may take; needs the right of control.
struct share_message {
  double value = 0;  ///< 0.01 to 1
};

/// Changes one of view_scene.parts; needs the right of control.
struct part_message {
  part_edit edit;  ///< what of it
};

/// Anything that a client may send.
using client_message = std::variant<view_message, image_message, pick_message, path_message, model_message,
                                    train_message, share_message, part_message>;

/// Reads a client's text.
client_message parse_message(std::string_view text);

/// The first text to a client: the scene's contents, and whether the client may control.
std::string hello_text(view_scene const& scene, bool control);
/// What there is in a scene of meshes and lights, as it is now.
std::string scene_text(std::vector<view_part> const& parts);
/// The state of a training.
std::string status_text(view_status const& status);
/// A training's losses and scores so far.
std::string curve_text(view_curve const& curve);
/// The answer to a pick; `t` along the ray, nothing hit where it is not positive.
std::string picked_text(u64 id, float t, vec3d point);
/// The answer to a path.
std::string path_text(u64 id, std::vector<camera> const& cameras);
/// PSNR in dB of views of the capture, by the camera's index.
std::string scores_text(std::vector<std::pair<int, double>> const& scores);
/// Something that the reader of the page is told.
std::string note_text(std::string_view what);
/// A message was not allowed, and why.
std::string refused_text(std::string_view what, std::string_view why);
/// A message of the type `of` failed.
std::string error_text(std::string_view what, std::string_view of, u64 id);
/// The server ends.
std::string bye_text(std::string_view why);

/// What a frame's header says.
struct frame_header {
  u64 id = 0;                           ///< of the message that asked for it
  int width = 0, height = 0;            ///< of the JPEG, pixels
  int full_width = 0, full_height = 0;  ///< that were asked for
  view_mode mode = view_mode::colour;   ///< what it shows
  double milliseconds = 0;              ///< that it took to render
  bool still = false;                   ///< full size, not to be replaced by a better one
  bool file = false;                    ///< the answer to an image_message: a PNG follows, no JPEG
  float low = 0, high = 0;              ///< values at the ends of the colour map, where it has one
  int samples = 1, samples_of = 1;      ///< paths a pixel that it has, and that it is to have at rest
};
/// The binary message of an image: a u32 length, the header as JSON, the image's file.
std::vector<u8> frame_bytes(frame_header const& header, std::vector<u8> const& image);

}  // namespace gart
