#include "capture.hpp"
#include "codec.hpp"
#include "exif.hpp"
#include "file_names.hpp"
#include "host_images.hpp"
#include "parallel.hpp"
#include "test_split.hpp"
#include "view_maps.hpp"

#include <gart/core/error.hpp>
#include <gart/io/dataset.hpp>
#include <gart/io/extent.hpp>
#include <gart/io/file.hpp>
#include <gart/io/image_file.hpp>
#include <gart/io/origin.hpp>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <system_error>

namespace gart {
namespace io {
namespace fs = std::filesystem;

namespace {

// Where its EXIF says that the photo is to be turned by a quarter, that.
std::string turned_by_exif(fs::path const& photo) {
  std::vector<u8> const bytes = read_file(photo);
  int const orientation = is_jpeg(bytes) ? exif_orientation(bytes) : 1;
  if (orientation < 5) return {};
  return ", the same turned: its EXIF says to show it turned by a quarter (orientation " + std::to_string(orientation) +
         "), and gart takes pixels as they are stored";
}

// Makes the camera fit the photo's real size; true where that meant scaling it.
bool fit_to_photo(frame& f, image_size size) {
  camera const& c = f.view;
  if (c.width == 0) {
    f.set_size(size.width, size.height);
    check_camera(f.view, f.photo.string());
    return false;
  }
  if (c.width == size.width && c.height == size.height) return false;
  double const sx = static_cast<double>(size.width) / c.width, sy = static_cast<double>(size.height) / c.height;
  bool const within_rounding = std::abs(c.height * sx - size.height) <= 1 || std::abs(c.width * sy - size.width) <= 1;
  if (std::abs(sx / sy - 1) > 0.01 && !within_rounding) {
    bool const turned = std::abs(static_cast<double>(size.height) * c.height / c.width - size.width) <= 1;
    std::string const exif = turned ? turned_by_exif(f.photo) : std::string();
    throw io_error(f.photo.string(),
                   "is " + std::to_string(size.width) + " x " + std::to_string(size.height) +
                       " pixels, but its camera is for " + std::to_string(c.width) + " x " + std::to_string(c.height) +
                       exif,
                   exif.empty() ? "use the photos that were calibrated, or copies scaled alike in both directions"
                                : "turn the pixels themselves, as exiftran -a does, or use the photos that were "
                                  "calibrated");
  }
  f.view = resized(c, size.width, size.height);
  check_camera(f.view, f.photo.string());
  return true;
}

image8 three_channels(image8 image) {
  if (image.channels != 1) return image;
  image8 result(image.width, image.height, 3);
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) result.data[3 * i + c] = image.data[i];
  }
  return result;
}

// A folder of photos, and its entry nearest to a name that was not found.
std::string what_is_in(fs::path const& folder, std::string const& name) {
  file_names names(folder);
  if (names.size() == 0) return folder.string() + ", where no photo is";
  return folder.string() + ", which has " + counted(names.size(), "photo") + ", the most alike " + names.nearest(name);
}

void drop_frames_without_photo(capture& c, bool load_images) {
  std::size_t const before = c.frames.size();
  auto const missing = [](frame const& f) { return f.photo.empty(); };
  std::size_t const without = static_cast<std::size_t>(std::count_if(c.frames.begin(), c.frames.end(), missing));
  if (before == 0) throw io_error(c.source.string(), "lists no image", "check that the reconstruction succeeded");
  if (without == before) {
    bool const sized = std::all_of(c.frames.begin(), c.frames.end(), [](frame const& f) { return f.view.width > 0; });
    if (load_images || !sized) {
      throw io_error(
          c.source.string(),
          "none of the " + counted(before, "image") + " it lists is there, such as " + c.frames.front().name +
              (c.photos.empty() ? std::string() : ", looked for in " + what_is_in(c.photos, c.frames.front().name)),
          c.format == "COLMAP" ? "put the photos into a folder named images beside sparse, or name their "
                                 "folder: dataset_options.photos"
                               : "put the photos where 'file_path' says, or name the folder that it is in: "
                                 "dataset_options.photos");
    }
    c.notes.push_back("no photo is there: the cameras have the sizes the files state");
  } else if (without) {
    auto const first = std::find_if(c.frames.begin(), c.frames.end(), missing);
    c.notes.push_back(std::to_string(without) + " of " + counted(before, "frame") +
                      " skipped: no photo is there, such as " + first->name + " in " +
                      what_is_in(c.photos, first->name));
    c.frames.erase(std::remove_if(c.frames.begin(), c.frames.end(), missing), c.frames.end());
  }
  std::size_t const left_out = static_cast<std::size_t>(
      std::count_if(c.frames.begin(), c.frames.end(), [](frame const& f) { return f.role == part::left_out; }));
  if (left_out) {
    c.notes.push_back(counted(left_out, "frame") + " left out: in neither list of the file's split");
    c.frames.erase(
        std::remove_if(c.frames.begin(), c.frames.end(), [](frame const& f) { return f.role == part::left_out; }),
        c.frames.end());
    if (c.frames.empty())
      throw io_error(c.source.string(), "the lists of the file's split hold none of its frames", "correct the lists");
  }
}

void measure_extent(dataset& data) {
  std::vector<vec3d> positions;
  for (dataset_view const& v : data.train) positions.push_back(v.view.position);
  float const extent = static_cast<float>(camera_extent(positions));
  if (extent > 0 && std::isfinite(extent)) {
    data.extent = extent;
  } else {
    data.notes.push_back("the training cameras have no extent: 1 is assumed");
  }
}

// The box around the point nearest to all view axes. By Cramer's rule: the minimum of sum |(I - d d^T)(x - p)|^2.
void measure_bounds(dataset& data) {
  std::vector<camera const*> cameras;
  for (auto const* views : {&data.train, &data.test}) {
    for (dataset_view const& v : *views) cameras.push_back(&v.view);
  }
  double const n = static_cast<double>(cameras.size());
  vec3d mean(0.0), forward(0.0), b(0.0);
  mat3d a(0.0);
  for (camera const* c : cameras) mean += c->position / n;
  for (camera const* c : cameras) {
    vec3d const d(c->rotation[2]), p = c->position - mean;
    forward += d / n;
    double const along = glm::dot(d, p);
    for (int i = 0; i < 3; ++i) {
      b[i] += (p[i] - along * d[i]) / n;
      for (int j = 0; j < 3; ++j) a[j][i] += ((i == j ? 1.0 : 0.0) - d[i] * d[j]) / n;
    }
  }
  auto const determinant = [](mat3d const& m) {
    return m[0][0] * (m[1][1] * m[2][2] - m[2][1] * m[1][2]) - m[1][0] * (m[0][1] * m[2][2] - m[2][1] * m[0][2]) +
           m[2][0] * (m[0][1] * m[1][2] - m[1][1] * m[0][2]);
  };
  double const det = determinant(a);
  vec3d center = mean + forward * static_cast<double>(data.extent);
  double radius = data.extent;
  bool looks_inwards = det > 1e-6;  // else the axes are parallel
  if (looks_inwards) {
    vec3d x(0.0);
    for (int k = 0; k < 3; ++k) {
      mat3d replaced = a;
      replaced[k] = b;
      x[k] = determinant(replaced) / det;
    }
    std::size_t in_front = 0;
    double distance = 0;
    for (camera const* c : cameras) {
      vec3d const to = x + mean - c->position, d(c->rotation[2]);
      distance += length(to) / n;
      in_front += glm::dot(to, d) > 0;
    }
    looks_inwards = distance > 0 && 2 * in_front > cameras.size();
    if (looks_inwards) center = x + mean, radius = distance;
  }
  data.bounds_min = center - vec3d(radius), data.bounds_max = center + vec3d(radius);
  if (data.points.size() == 0) {
    data.notes.push_back(std::string("no starting points; random ones would fill a box of half width ") +
                         std::to_string(radius) +
                         (looks_inwards ? " around the point the cameras look at" : " in front of the cameras"));
  }
}

// A point in a camera's centre covers its whole image.
void drop_points_in_cameras(dataset& data) {
  std::vector<vec3d> centers;
  for (auto const* views : {&data.train, &data.test}) {
    for (dataset_view const& v : *views) centers.push_back(v.view.position);
  }
  auto const by_x = [](vec3d const& a, vec3d const& b) { return a.x < b.x; };
  std::sort(centers.begin(), centers.end(), by_x);
  double const near = 1e-6 * data.extent;
  auto& position = data.points.position;
  auto& color = data.points.color;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < data.points.size(); ++i) {
    vec3d const p(position[3 * i], position[3 * i + 1], position[3 * i + 2]);
    bool hit = false;
    auto c = std::lower_bound(centers.begin(), centers.end(), vec3d(p.x - near, 0, 0), by_x);
    for (; c != centers.end() && c->x <= p.x + near && !hit; ++c) hit = length(*c - p) <= near;
    if (hit) continue;
    std::copy_n(position.begin() + static_cast<std::ptrdiff_t>(3 * i), 3,
                position.begin() + static_cast<std::ptrdiff_t>(3 * kept));
    std::copy_n(color.begin() + static_cast<std::ptrdiff_t>(3 * i), 3,
                color.begin() + static_cast<std::ptrdiff_t>(3 * kept));
    ++kept;
  }
  if (std::size_t const dropped = data.points.size() - kept) {
    data.notes.push_back(counted(dropped, "point") + " left out: in a camera's centre");
    position.resize(3 * kept), color.resize(3 * kept);
  }
}

// Who of a host's ranks reads what is of view i.
bool is_mine(dataset_options const& options, std::size_t i) {
  return !options.host ||
         i % static_cast<std::size_t>(options.host->size()) == static_cast<std::size_t>(options.host->rank());
}

// Whether its mask excludes every pixel: it can be neither trained on nor scored.
bool is_excluded(dataset_view const& v) {
  return !v.mask.empty() && std::all_of(v.mask.data.begin(), v.mask.data.end(), [](u8 m) { return m == 0; });
}

// The views of the frames, in the frames' order.
std::vector<dataset_view> load_views(capture& c, dataset_options const& options, std::size_t& scaled,
                                     std::size_t& decoded) {
  std::vector<dataset_view> views(c.frames.size());
  std::vector<std::string*> names;
  for (std::size_t i = 0; i < views.size(); ++i) {
    views[i].name = c.frames[i].name;
    names.push_back(&views[i].name);
  }
  make_file_names(names);
  std::mutex guard;
  std::size_t done = 0;
  for_each_parallel(views.size(), [&](std::size_t i) {
    frame& f = c.frames[i];
    dataset_view& view = views[i];
    image_size size{f.view.width, f.view.height};
    image8 image;
    if (!f.photo.empty()) {
      if (options.load_images && is_mine(options, i)) {
        image = read_image(f.photo);
        size = {image.width, image.height};
      } else {
        size = read_image_size(f.photo);
      }
    }
    bool const resized_camera = fit_to_photo(f, size);
    view.view = downscaled(f.view, options.downscale, f.photo.empty() ? f.name : f.photo.string());
    if (options.load_images && is_mine(options, i)) {
      view.image = three_channels(box_downscale(image, options.downscale));
      if (!f.mask.empty()) view.mask = read_mask(f.mask, size, options.downscale);
      if (options.depth.load && f.role != part::test) view.depth = read_distances(f, view.view, size, options);
    }
    std::lock_guard const lock(guard);
    scaled += resized_camera, decoded += !image.empty();
    ++done;
    if (options.progress) options.progress(done, views.size());
  });
  return views;
}

// Moves cameras and points to the origin, and returns it.
vec3d set_origin(capture& c, dataset_options const& options) {
  vec3d origin(0.0);
  if (options.origin) {
    origin = *options.origin;
  } else {
    std::vector<vec3d> centers;
    for (frame const& f : c.frames) centers.push_back(f.view.position);
    origin = origin_for(centers, c.points.position);
    if (origin != vec3d(0.0))
      c.notes.push_back("coordinates are held from the origin " + to_text(origin) +
                        ", near which floats keep what they have");
  }
  if (origin == vec3d(0.0)) return origin;
  for (frame& f : c.frames) f.view.position -= origin;
  for (std::size_t i = 0; i < c.points.position.size(); ++i) c.points.position[i] -= origin[static_cast<int>(i % 3)];
  return origin;
}

dataset load(fs::path const& path, dataset_options const& options) {
  if (options.downscale < 1) throw invalid_argument("dataset_options.downscale must be at least 1");
  if (options.test_every < 0) throw invalid_argument("dataset_options.test_every must be 0 (no test views) or more");
  if (!(options.depth.unit >= 0)) throw invalid_argument("dataset_options.depth: its unit must not be negative");
  capture c = read_capture(path, options);
  vec3d const origin = set_origin(c, options);
  drop_frames_without_photo(c, options.load_images);
  dataset data;
  data.format = c.format;
  data.origin = origin;
  data.split = assign_roles(c, options);
  data.resize_filter = options.downscale == 1 ? "none" : "box (1/" + std::to_string(options.downscale) + ")";
  std::size_t scaled = 0;
  std::vector<dataset_view> views;
  bool shared = options.host && options.load_images;
  if (shared) {
    agreed_on_host(*options.host, [&] { views = load_views(c, options, scaled, data.decoded); });
    shared = share_on_host(*options.host, views);
  }
  if (!shared) {
    dataset_options by_itself = options;
    by_itself.host = nullptr;
    data.decoded = 0;
    views = load_views(c, by_itself, scaled, data.decoded);
  }
  data.notes = std::move(c.notes);
  if (options.host && options.load_images && !shared)
    data.notes.push_back("each rank of a host holds all images: /dev/shm has no room for them (give it more)");
  if (scaled) {
    data.notes.push_back(counted(scaled, "photo") + " differ in size from their cameras: the intrinsics were scaled");
  }
  std::size_t excluded = 0;
  std::string first_excluded;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (is_excluded(views[i])) {
      if (excluded++ == 0) first_excluded = c.frames[i].mask.string();
      continue;
    }
    data.alpha = data.alpha || views[i].image.channels == 4;
    (c.frames[i].role == part::test ? data.test : data.train).push_back(std::move(views[i]));
  }
  if (excluded)
    data.notes.push_back(counted(excluded, "view") + " left out: the mask excludes every pixel, such as " +
                         first_excluded);
  if (data.train.empty() && excluded)
    throw io_error(
        first_excluded,
        "excludes every pixel, as the masks of " + counted(excluded, "view") + " do, and no view is left to train on",
        "black is excluded: invert the masks, or leave them out (dataset_options.masks)");
  if (data.train.empty() && options.load_images) {
    throw io_error(path.string(),
                   "no view is left to train on, all " + counted(data.test.size(), "view") + " are test views",
                   "ask for fewer: test_every 0 keeps every view for training");
  }
  data.points = {{c.points.position.begin(), c.points.position.end()}, std::move(c.points.color)};
  if (data.points.color.size() != data.points.position.size())
    data.points.color.assign(data.points.position.size(), 128);
  if (!data.train.empty()) measure_extent(data);
  drop_points_in_cameras(data);
  if (!c.synthetic_bounds || origin != vec3d(0.0)) measure_bounds(data);
  return data;
}

}  // namespace
}  // namespace io

double camera_extent(std::vector<vec3d> const& positions) {
  vec3d mean(0.0);
  for (vec3d const& p : positions) mean += p / static_cast<double>(positions.size());
  double radius = 0;
  for (vec3d const& p : positions) radius = std::max(radius, glm::length(p - mean));
  return 1.1 * radius;
}

camera downscaled(camera const& c, int factor, std::string const& where) {
  int const width = c.width / factor, height = c.height / factor;
  if (width < 1 || height < 1) {
    throw invalid_argument("dataset_options.downscale = " + std::to_string(factor) + " leaves nothing of " + where);
  }
  if (c.kind == camera_kind::equirectangular && (c.width % factor || c.height % factor)) {
    throw invalid_argument("dataset_options.downscale = " + std::to_string(factor) + " does not divide " +
                           std::to_string(c.width) + " x " + std::to_string(c.height) + " of " + where +
                           ": a view of the whole sphere cannot be cropped; take a factor of both");
  }
  return resized(cropped(c, width * factor, height * factor), width, height);
}

dataset load_dataset(std::filesystem::path const& path, dataset_options const& options) {
  return io::load(path, options);
}

std::vector<named_camera> load_cameras(std::filesystem::path const& path) {
  std::error_code ignored;
  if (std::filesystem::is_regular_file(path, ignored) && path.extension() == ".json" && io::is_json_list(path)) {
    return io::read_camera_json(path);
  }
  dataset_options options;
  options.load_images = false, options.origin = vec3d(0.0);
  dataset const data = load_dataset(path, options);
  std::vector<named_camera> cameras;
  for (auto const* views : {&data.test, &data.train}) {
    for (dataset_view const& v : *views) cameras.push_back({v.name, v.view});
  }
  return cameras;
}

}  // namespace gart
