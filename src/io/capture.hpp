#pragma once
// A capture as its files describe it, before any photo is opened. The format readers hand it to load_dataset.

#include "unusable.hpp"

#include <gart/camera/models.hpp>
#include <gart/io/dataset.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace gart::io {

enum class part { unassigned, train, test, left_out };

struct frame {
  std::string name;             // as in the files: a relative path
  std::filesystem::path photo;  // empty where the readers found none
  std::filesystem::path mask;   // empty where the capture names none
  std::filesystem::path depth;  // empty where the capture names none
  double depth_unit = 0;        // of its maps; 0: not said
  depth_kind depth_is = depth_kind::automatic;
  camera view;                              // width 0: the files do not say, the photo's size decides
  double angle_x = 0, angle_y = 0;          // radians; 0: fx, fy are given
  bool center_x = false, center_y = false;  // cx, cy are the middle of the image
  part role = part::unassigned;

  // Focal lengths and centre that follow from the size.
  void set_size(int width, int height);
};

// Points in the file's coordinates.
struct exact_points {
  std::vector<double> position;  // [N][3]
  std::vector<u8> color;         // [N][3], or empty
  std::size_t size() const { return position.size() / 3; }
};
// read_point_ply, in double.
exact_points read_exact_points(std::filesystem::path const& path, std::vector<std::string>* notes);

struct capture {
  std::filesystem::path source;  // what errors name
  std::string format;
  std::string own_split;         // in words; empty: every nth view by name is a test view
  std::filesystem::path photos;  // the folder that the frames' names are in
  std::vector<frame> frames;
  exact_points points;
  std::vector<std::string> notes;
  bool synthetic_bounds = false;  // Blender's box, not one around the cameras
};

// Whether a folder is one that a capture is named by, or what gart train leaves.
bool holds_capture(std::filesystem::path const& folder);
bool holds_training(std::filesystem::path const& folder);

// Which files a path means, and what to say about the choice; with their photos and masks.
capture read_capture(std::filesystem::path const& path, dataset_options const& options);

// A COLMAP model folder: binary or text, whichever `text` says; its photos in `photos`, or where captures have them.
capture read_colmap(std::filesystem::path const& model, bool text, std::filesystem::path const& photos);
bool has_colmap_model(std::filesystem::path const& folder, bool text);
std::size_t images_in_colmap(std::filesystem::path const& folder, bool text);

// The folders of photos in a capture's: images, then its smaller copies by their factor, then input.
std::vector<std::filesystem::path> photo_folders_in(std::filesystem::path const& capture);

// Finds missing photos of frames by their names. Notes say which names differ from the files', and which have no file.
void find_photos(capture& c);
// Masks in a folder `masks` beside that of the photos, where the files of the capture name none.
void find_masks(capture& c);

// The place of a kind of maps: a folder of that name beside the photos'. There a map has the photo's path.
struct place_beside {
  std::filesystem::path folder, below;
};
place_beside beside_photos(std::filesystem::path const& photo, char const* name);

capture read_blender(std::filesystem::path const& folder);
capture read_transforms(std::filesystem::path const& file);

// Whether the JSON file's outermost value is a list: the camera JSON.
bool is_json_list(std::filesystem::path const& file);
std::vector<named_camera> read_camera_json(std::filesystem::path const& file);

// Of one image: the others are read without it.
struct pose_error : io_error {
  pose_error(std::string const& where, std::string const& what, std::string const& remedy)
      : io_error(where, what, remedy), fault(what) {}
  std::string fault;  // without the place
};

// Sizes and intrinsics that can be traced, a finite pose; `where` names the file and the camera in errors.
void check_camera(camera const& view, std::string const& where);

// Sets the pose from columns. These must be the axes of a right-handed frame, up to one scale common to all.
void set_pose(camera& view, mat3d const& camera_to_world, vec3d const& center, std::string const& where);

// Names that are fit for files and differ from each other: folders flattened, extensions dropped.
void make_file_names(std::vector<std::string*> const& names);

}  // namespace gart::io
