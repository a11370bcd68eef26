#include <gart/io/camera_file.hpp>
#include <gart/io/placed_views.hpp>

#include <map>
#include <utility>

namespace gart {

void place_training_views(dataset& data, std::filesystem::path const& cameras) {
  std::map<std::string, camera> poses;
  for (named_camera& c : load_cameras(cameras)) poses.emplace(std::move(c.name), c.view);
  for (dataset_view& view : data.train) {
    auto const found = poses.find(view.name);
    if (found == poses.end())
      throw io_error(cameras.string(), "has no camera named '" + view.name + "', a training view of the capture",
                     "give the poses.json of a run on this capture with the same test views");
    camera const& pose = found->second;
    if (pose.shutter != view.view.shutter)
      throw io_error(cameras.string() + ", camera '" + view.name + "'",
                     "has shutter_type " + shutter_type_of(pose) + ", the capture " + shutter_type_of(view.view),
                     "give the poses.json of a run on this capture");
    view.view.position = pose.position - data.origin, view.view.rotation = pose.rotation;
    view.view.travel = pose.travel, view.view.turn = pose.turn;
  }
}

}  // namespace gart
