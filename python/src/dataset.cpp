// Captures.
#include "bindings.hpp"

#include <gart/io/extent.hpp>
#include <gart/runtime/matched_points.hpp>

#include <algorithm>

namespace gart_python {

namespace {

using shared_dataset = std::shared_ptr<gart::dataset>;

gart::image8 image_of(py::handle argument, char const* name) {
  lent const pixels = lent::of<gart::u8>(argument, {name, {-1, -1, -1}});
  auto const& s = pixels.shape();
  gart::image8 out(static_cast<int>(s[1]), static_cast<int>(s[0]), static_cast<int>(s[2]));
  std::copy_n(pixels.data<gart::u8>(), pixels.size(), out.data.data());
  return out;
}

template <class T>
py::object shown_image(gart::basic_image<T> const& image, py::handle owner) {
  if (image.empty()) return py::none();
  std::vector<std::int64_t> shape{image.height, image.width};
  if (image.channels != 1) shape.push_back(image.channels);
  return shown_array(shape, image.data.data(), owner);
}

// As of a capture that is read.
float extent_of(std::vector<gart::dataset_view> const& views) {
  std::vector<gart::vec3d> positions;
  for (auto const& v : views) positions.push_back(v.view.position);
  double const extent = gart::camera_extent(positions);
  return extent > 0 ? static_cast<float>(extent) : 1.0f;
}

gart::dataset dataset_of(std::vector<gart::dataset_view> train, std::vector<gart::dataset_view> test,
                         py::object const& points, py::object const& colors) {
  gart::dataset out;
  out.format = "arrays", out.split = "as given", out.resize_filter = "none";
  out.train = std::move(train), out.test = std::move(test);
  if (out.train.empty()) throw gart::invalid_argument("Dataset: train must have at least one view");
  out.extent = extent_of(out.train);
  for (auto const& v : out.train) out.alpha = out.alpha || v.image.channels == 4;
  gart::vec3d lo = out.train[0].view.position, hi = lo;
  for (auto const& v : out.train) lo = glm::min(lo, v.view.position), hi = glm::max(hi, v.view.position);
  out.bounds_min = lo - static_cast<double>(out.extent), out.bounds_max = hi + static_cast<double>(out.extent);
  if (!points.is_none()) {
    lent const positions = lent::of<float>(points, {"Dataset: points", {-1, 3}});
    out.points.position.assign(positions.data<float>(), positions.data<float>() + positions.size());
    if (colors.is_none()) {
      out.points.color.assign(positions.size(), 128);
    } else {
      lent const bytes = lent::of<gart::u8>(colors, {"Dataset: colors", {positions.shape()[0], 3}});
      out.points.color.assign(bytes.data<gart::u8>(), bytes.data<gart::u8>() + bytes.size());
    }
  }
  return out;
}

gart::dataset load(std::filesystem::path const& path, int downscale, int test_every, std::string const& test_split,
                   std::optional<std::filesystem::path> const& photos, bool masks, bool load_images, bool depth,
                   std::optional<std::array<double, 3>> const& origin, py::object const& progress) {
  gart::dataset_options options;
  options.downscale = downscale, options.test_every = test_every, options.masks = masks;
  options.test_split = gart::from_string<gart::split_kind>(test_split);
  if (photos) options.photos = *photos;
  if (origin) options.origin = gart::vec3d((*origin)[0], (*origin)[1], (*origin)[2]);
  options.load_images = load_images, options.depth.load = depth;
  if (!progress.is_none())
    options.progress = [&progress](std::size_t done, std::size_t total) {
      py::gil_scoped_acquire held;
      progress(done, total);
    };
  py::gil_scoped_release released;
  return gart::load_dataset(path, options);
}

char const load_text[] = R"(Reads a capture of COLMAP, Blender or nerfstudio from a folder, or by the file named.

downscale    integer factor by which images shrink, by their blocks' mean
test_every   each Nth view by name is kept for testing; 0: none; ignored where the files have their own split
test_split   "nth", or "sector": as many views around one side
photos       the folder of the photos, where it is not the capture's
masks        whether to read masks
load_images  False: cameras alone
depth        whether to read depth maps of the training views
origin       what coordinates are relative to, as of a Model; None: the capture's own, far from zero alone
progress     called as progress(done, total) from the loading threads, one at a time

Raises IoError, Unsupported for a camera model that gart does not trace, InvalidArgument.)";

}  // namespace

void bind_dataset(py::module_& m) {
  using view = gart::dataset_view;
  py::class_<view, std::shared_ptr<view>>(m, "View",
                                          R"(A photograph and its camera: View(name, camera, image).

image  uint8 [H, W, 3], or [H, W, 4] with straight alpha)")
      .def(py::made_by([](std::string name, gart::camera const& camera, py::object const& image) {
             view out;
             out.name = std::move(name), out.view = camera, out.image = image_of(image, "View: image");
             if (out.image.width != camera.width || out.image.height != camera.height ||
                 (out.image.channels != 3 && out.image.channels != 4))
               throw gart::invalid_argument("View: image must be of the camera's size, [H, W, 3] or [H, W, 4]");
             return out;
           }),
           py::arg("name"), py::arg("camera"), array_arg("image"))
      .def_ro("name", &view::name)
      .def_prop_ro(
          "camera", [](view const& v) { return v.view; }, "a copy")
      .def_prop_ro(
          "image", [](py::object const& s) { return shown_image(py::cast<view const&>(s).image, s); },
          "uint8 [H, W, 3 or 4], the dataset's own memory; None where images were not loaded")
      .def_prop_ro(
          "mask", [](py::object const& s) { return shown_image(py::cast<view const&>(s).mask, s); },
          "uint8 [H, W], 0 where pixels are ignored; None where there is no mask")
      .def_prop_ro(
          "depth", [](py::object const& s) { return shown_image(py::cast<view const&>(s).depth, s); },
          "float32 [H, W], distance along the ray, 0 where not measured; None where not loaded")
      .def("__repr__", [](view const& v) { return "gart.View('" + v.name + "')"; });

  auto const views = [](std::vector<view> gart::dataset::*member) {
    return [member](shared_dataset const& d) {
      py::list out;
      // Each keeps the dataset.
      for (view& one : (*d).*member) out.append(std::shared_ptr<view>(d, &one));
      return out;
    };
  };
  py::class_<gart::dataset, shared_dataset>(
      m, "Dataset",
      R"(A capture in host memory: Dataset(train, test=[], points=None, colors=None), or load_dataset.

train, test  lists of View
points       float32 [N, 3], where training starts; none: at random
colors       uint8 [N, 3])")
      .def(py::made_by(&dataset_of), py::arg("train"), py::arg("test") = std::vector<view>{},
           py::arg("points") = py::none(), py::arg("colors") = py::none())
      .def_prop_ro("train", views(&gart::dataset::train))
      .def_prop_ro("test", views(&gart::dataset::test))
      .def_ro("format", &gart::dataset::format, "COLMAP, Blender, nerfstudio, or arrays")
      .def_ro("split", &gart::dataset::split, "how train and test were told apart")
      .def_ro("notes", &gart::dataset::notes, "what was skipped, scaled or assumed, a line each")
      .def_ro("extent", &gart::dataset::extent, "1.1 times the largest distance of a camera from their mean")
      .def_prop_ro(
          "origin",
          [](gart::dataset const& d) {
            return std::array{d.origin.x, d.origin.y, d.origin.z};
          },
          "what coordinates are relative to")
      .def_ro("alpha", &gart::dataset::alpha, "whether images carry alpha")
      .def_prop_ro(
          "points",
          [](py::object const& s) {
            auto const& p = py::cast<gart::dataset const&>(s).points;
            return shown_array({static_cast<std::int64_t>(p.size()), 3}, p.position.data(), s);
          },
          "float32 [N, 3]")
      .def_prop_ro(
          "colors",
          [](py::object const& s) {
            auto const& p = py::cast<gart::dataset const&>(s).points;
            return shown_array({static_cast<std::int64_t>(p.size()), 3}, p.color.data(), s);
          },
          "uint8 [N, 3]")
      .def(
          "match_photographs",
          [](gart::dataset& d, gart::index_t pixels, gart::u64 seed) {
            py::gil_scoped_release released;
            d.matched = gart::match_photographs(d, pixels, seed);
            return d.matched.size();
          },
          py::arg("pixels") = 100000, py::arg("seed") = 1,
          R"(Finds points on surfaces by matching the training photographs; returns how many.

recommended() then starts from them where the dataset has no points, or where it measures that they pay.)")
      .def("__repr__", [](gart::dataset const& d) {
        return "gart.Dataset(" + d.format + ", " + std::to_string(d.train.size()) + " training views, " +
               std::to_string(d.test.size()) + " test views)";
      });
  m.def(
      "load_dataset",
      [](std::filesystem::path const& path, int downscale, int test_every, std::string const& test_split,
         std::optional<std::filesystem::path> const& photos, bool masks, bool load_images, bool depth,
         std::optional<std::array<double, 3>> const& origin, py::object const& progress) {
        return std::make_shared<gart::dataset>(
            load(path, downscale, test_every, test_split, photos, masks, load_images, depth, origin, progress));
      },
      py::arg("path"), py::kw_only(), py::arg("downscale") = 1, py::arg("test_every") = 8,
      py::arg("test_split") = "nth", py::arg("photos") = py::none(), py::arg("masks") = true,
      py::arg("load_images") = true, py::arg("depth") = false, py::arg("origin") = py::none(),
      py::arg("progress") = py::none(), load_text);
}

}  // namespace gart_python
