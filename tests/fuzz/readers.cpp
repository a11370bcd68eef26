// Models, captures, cameras and images.

#include "fuzz/support.hpp"

#include <gart/io/dataset.hpp>
#include <gart/io/depth_file.hpp>
#include <gart/io/exposure_file.hpp>
#include <gart/io/exr_file.hpp>
#include <gart/io/image_file.hpp>
#include <gart/io/mesh_file.hpp>
#include <gart/io/ply.hpp>
#include <gart/io/scene_file.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

namespace gart_fuzz {
namespace {

void check_points(gart::point_cloud const& points) {
  promise(points.position.size() % 3 == 0 && points.color.size() == points.position.size(), "points without colours");
  promise(finite(points.position), "a point that is not finite");
}

void check_cameras(std::vector<gart::named_camera> const& cameras) {
  promise(!cameras.empty(), "no camera");
  std::set<std::string> names;
  for (gart::named_camera const& c : cameras) {
    check_camera(c.view);
    promise(names.insert(c.name).second, "two cameras of one name");
    promise(c.name.find('/') == std::string::npos && !c.name.empty(), "a name that is unfit for a file");
  }
}

void check_image(gart::image8 const& image, std::set<int> const& channels) {
  promise(image.width >= 1 && image.height >= 1 && channels.count(image.channels), "an image of no pixels");
  promise(image.data.size() == static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) *
                                   static_cast<std::size_t>(image.channels),
          "an image whose data do not fit its size");
}

void check_dataset(gart::dataset const& data) {
  promise(!data.train.empty(), "nothing to train on");
  for (auto const* views : {&data.train, &data.test}) {
    for (gart::dataset_view const& v : *views) {
      check_camera(v.view);
      check_image(v.image, {3, 4});
      promise(v.image.width == v.view.width && v.image.height == v.view.height, "an image and a camera that differ");
      if (v.mask.empty()) continue;
      check_image(v.mask, {1});
      promise(v.mask.width == v.view.width && v.mask.height == v.view.height, "a mask and a camera that differ");
    }
  }
  check_points(data.points);
  promise(data.extent > 0 && std::isfinite(data.extent), "an extent that is no length");
  promise(finite(data.bounds_min) && finite(data.bounds_max), "bounds that are not finite");
}

void check_model(gart::gaussian_model const& m) {
  gart::gaussian_model shape;
  shape.resize(m.size(), m.sh_degree);
  promise(m.sh_degree >= 0 && m.sh_degree <= 3 && m.mean.size() == shape.mean.size() &&
              m.log_scale.size() == shape.log_scale.size() && m.quaternion.size() == shape.quaternion.size() &&
              m.sh.size() == shape.sh.size(),
          "arrays that differ in length");
  promise(finite(m.mean) && finite(m.log_scale) && finite(m.quaternion) && finite(m.opacity) && finite(m.sh),
          "a Gaussian that is not finite");
}

bool read_splats(scratch_folder const& folder, char const* name, std::string_view input) {
  fs::path const file = folder.put(name, input);
  return accepted(folder, [&] {
    gart::splat_traits traits;
    check_model(gart::read_splats(file, &traits));
  });
}

// The first n parts of `input`, between which stands a line "====". A part that is not there is no file.
template <std::size_t n>
void put_parts(scratch_folder const& folder, std::array<char const*, n> const& names, std::string_view input) {
  std::string_view const separator = "\n====\n";
  bool there = true;
  for (std::size_t i = 0; i < n; ++i) {
    if (!there) {
      fs::remove(folder.path() / names[i]);
      continue;
    }
    std::size_t const end = i + 1 < n ? input.find(separator) : std::string_view::npos;
    folder.put(names[i], input.substr(0, end));
    there = end != std::string_view::npos;
    if (there) input.remove_prefix(end + separator.size());
  }
}

void put_photos(scratch_folder const& folder, std::string const& where) {
  fs::create_directories(folder.path() / where);
  gart::write_png(folder.path() / where / "a.png", gart::image8(4, 3, 3, 90));
  gart::write_png(folder.path() / where / "b.png", gart::image8(8, 6, 4, 200));
  gart::write_png(folder.path() / where / "mask.png", gart::image8(4, 3, 1, 255));
}

// A capture's views with their photos, then its cameras without: two ways through the same files.
bool read_capture(scratch_folder const& folder, fs::path const& path) {
  gart::dataset_options options;
  options.downscale = 2, options.test_every = 3;
  bool const trainable = accepted(folder, [&] { check_dataset(gart::load_dataset(path, options)); });
  bool const usable = accepted(folder, [&] { check_cameras(gart::load_cameras(path)); });
  return trainable || usable;
}

bool read_image(scratch_folder const& folder, char const* name, std::string_view input, std::set<int> const& channels) {
  fs::path const file = folder.put(name, input);
  return accepted(folder, [&] {
    gart::image8 const image = gart::read_image(file);
    check_image(image, channels);
  });
}

// What require_scene asks of a scene, but for what scene.json's numbers are.
void check_scene(gart::light::scene const& s) {
  for (gart::light::mesh const& m : s.meshes) {
    std::size_t const n = m.positions.size();
    promise(!m.triangles.empty() && m.triangles.size() == 3 * m.triangle_material.size(),
            "triangles without a material");
    promise((m.normals.empty() || m.normals.size() == n) && (m.uvs.empty() || m.uvs.size() == n),
            "vertices that differ");
    for (gart::u32 const corner : m.triangles) promise(corner < n, "a corner that is no vertex");
    for (gart::u32 const number : m.triangle_material)
      promise(number < s.materials.size(), "a material that is not there");
    for (gart::vec3 const& p : m.positions) promise(finite(gart::vec3d(p)), "a vertex that is not finite");
    for (gart::vec3 const& v : m.normals)
      promise(std::abs(v.x * v.x + v.y * v.y + v.z * v.z - 1) < 1e-3f, "a normal that is none");
  }
  auto const textures = static_cast<int>(s.textures.size());
  for (gart::light::material const& m : s.materials)
    for (int const number : {m.base_color_texture, m.metallic_roughness_texture, m.emission_texture, m.normal_texture})
      promise(number >= -1 && number < textures, "a texture that is not there");
  for (gart::light::texture const& t : s.textures)
    promise(t.texels.size() == std::size_t{4} * static_cast<std::size_t>(t.width) * static_cast<std::size_t>(t.height),
            "a texture whose texels do not fit its size");
}

bool read_scene(scratch_folder const& folder, fs::path const& file) {
  return accepted(folder, [&] {
    gart::read_scene_splats(file);
    gart::scene_file const scene = gart::read_scene(file);
    check_scene(scene.scene);
    for (gart::named_camera const& c : scene.cameras) check_camera(c.view);
  });
}

}  // namespace

bool splat_ply(std::string_view input) {
  static scratch_folder const folder("splat_ply");
  fs::path const file = folder.put("model.ply", input), again = folder.path() / "again.ply";
  return accepted(folder, [&] {
    gart::splat_traits traits;
    gart::gaussian_model const m = gart::read_splat_ply(file, &traits);
    check_model(m);
    gart::write_splat_ply(again, m);
    gart::gaussian_model const back = gart::read_splat_ply(again);
    promise(back.sh_degree == m.sh_degree && back.mean == m.mean && back.log_scale == m.log_scale &&
                back.quaternion == m.quaternion && back.opacity == m.opacity && back.sh == m.sh,
            "a model that is another when written and read again");
  });
}

bool spz(std::string_view input) {
  static scratch_folder const folder("spz");
  return read_splats(folder, "model.spz", input);
}

bool compressed_ply(std::string_view input) {
  static scratch_folder const folder("compressed_ply");
  return read_splats(folder, "model.compressed.ply", input);
}

bool sog(std::string_view input) {
  static scratch_folder const folder("sog");
  return read_splats(folder, "model.sog", input);
}

bool splat_bytes(std::string_view input) {
  static scratch_folder const folder("splat_bytes");
  return read_splats(folder, "model.splat", input);
}

bool glb(std::string_view input) {
  static scratch_folder const folder("glb");
  return read_splats(folder, "model.glb", input);
}

bool point_ply(std::string_view input) {
  static scratch_folder const folder("point_ply");
  fs::path const file = folder.put("points.ply", input);
  return accepted(folder, [&] { check_points(gart::read_point_ply(file)); });
}

bool colmap_bin(std::string_view input) {
  static scratch_folder const folder("colmap_bin");
  static bool const photos = (put_photos(folder, "images"), true);
  put_parts<3>(folder, {"sparse/0/cameras.bin", "sparse/0/images.bin", "sparse/0/points3D.bin"}, input);
  return photos && read_capture(folder, folder.path());
}

bool colmap_txt(std::string_view input) {
  static scratch_folder const folder("colmap_txt");
  static bool const photos = (put_photos(folder, "images"), true);
  put_parts<3>(folder, {"sparse/0/cameras.txt", "sparse/0/images.txt", "sparse/0/points3D.txt"}, input);
  return photos && read_capture(folder, folder.path());
}

bool transforms(std::string_view input) {
  static scratch_folder const folder("transforms");
  static bool const photos = (put_photos(folder, "images"), true);
  static bool const points =
      (gart::write_point_ply(folder.path() / "points.ply", {{1, 2, 3, 0, 0, 0}, {1, 2, 3, 4, 5, 6}}), true);
  return photos && points && read_capture(folder, folder.put("transforms.json", input));
}

bool blender(std::string_view input) {
  static scratch_folder const folder("blender");
  static bool const photos = (put_photos(folder, "images"), true);
  put_parts<2>(folder, {"transforms_train.json", "transforms_test.json"}, input);
  return photos && read_capture(folder, folder.path());
}

bool camera_json(std::string_view input) {
  static scratch_folder const folder("camera_json");
  fs::path const file = folder.put("cameras.json", input);
  return accepted(folder, [&] { check_cameras(gart::load_cameras(file)); });
}

bool exposures(std::string_view input) {
  static scratch_folder const folder("exposures");
  fs::path const file = folder.put("exposures.json", input), again = folder.path() / "again.json";
  return accepted(folder, [&] {
    gart::exposure_field const field = gart::read_exposures(file);
    promise(!field.empty(), "no view and no lens");
    gart::camera view;
    view.width = 4, view.height = 3;
    gart::vec3d const there = field.views().empty() ? gart::vec3d(0.0) : field.views()[0].position;
    for (auto const& position : {gart::vec3d(0.0), there, gart::vec3d(1e7)}) {
      view.position = position;
      gart::exposure const e = field.at(view).exposed;
      // The numbers may be of any size; beyond what the sums in double can hold there is nothing to promise.
      bool small = true, sound = true;
      for (auto const& v : field.views())
        for (float const m : v.value.m) small = small && std::abs(m) < 1e30f;
      for (float const m : e.m) sound = sound && std::isfinite(m);
      promise(sound || !small, "an exposure that is not finite");
    }
    gart::write_exposures(again, field);
    gart::exposure_field const back = gart::read_exposures(again);
    bool same = back.views().size() == field.views().size() && back.lenses().size() == field.lenses().size();
    for (std::size_t i = 0; same && i < field.views().size(); ++i)
      same = back.views()[i].position == field.views()[i].position;
    for (std::size_t i = 0; same && i < field.lenses().size(); ++i)
      same = back.lenses()[i].focal == field.lenses()[i].focal && back.lenses()[i].center == field.lenses()[i].center;
    promise(same, "exposures that are others when written and read again");
  });
}

bool depth(std::string_view input) {
  static scratch_folder const folder("depth");
  fs::path const file = folder.put("map", input), again = folder.path() / "again.npy";
  return accepted(folder, [&] {
    gart::image_float const map = gart::read_depth(file);
    promise(map.width >= 1 && map.height >= 1 && map.channels == 1, "a map of no pixels");
    promise(map.data.size() == static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height),
            "a map whose data do not fit its size");
    promise(finite(map.data), "a depth that is not finite");
    gart::write_npy(again, map);
    promise(gart::read_depth(again).data == map.data, "a map that is another when written and read again");
  });
}

bool png(std::string_view input) {
  static scratch_folder const folder("png");
  return read_image(folder, "image.png", input, {1, 3, 4});
}

bool jpeg(std::string_view input) {
  static scratch_folder const folder("jpeg");
  return read_image(folder, "image.jpg", input, {1, 3});
}

bool webp(std::string_view input) {
  static scratch_folder const folder("webp");
  return read_image(folder, "image.webp", input, {1, 3, 4});
}

bool mesh_ply(std::string_view input) {
  static scratch_folder const folder("mesh_ply");
  fs::path const file = folder.put("mesh.ply", input), again = folder.path() / "again.ply";
  return accepted(folder, [&] {
    gart::triangle_mesh const mesh = gart::read_mesh_ply(file);
    for (auto const& t : mesh.triangle)
      for (gart::u32 const corner : t) promise(corner < mesh.position.size(), "a corner that is no vertex");
    for (gart::vec3 const& p : mesh.position) promise(finite(gart::vec3d(p)), "a vertex that is not finite");
    gart::write_mesh_ply(again, mesh);
    gart::triangle_mesh const back = gart::read_mesh_ply(again);
    promise(back.position == mesh.position && back.triangle == mesh.triangle,
            "a mesh that is another when written and read again");
  });
}

bool gltf(std::string_view input) {
  static scratch_folder const folder("gltf");
  static bool const images = (put_photos(folder, "."), true);
  return images && read_scene(folder, folder.put("scene.gltf", input));
}

bool obj(std::string_view input) {
  static scratch_folder const folder("obj");
  static bool const images = (put_photos(folder, "."), true);
  put_parts<2>(folder, {"mesh.obj", "mesh.mtl"}, input);
  return images && read_scene(folder, folder.path() / "mesh.obj");
}

bool scene_json(std::string_view input) {
  static scratch_folder const folder("scene_json");
  static bool const beside =
      (put_photos(folder, "."), folder.put("mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
       gart::write_exr(folder.path() / "sky.exr", gart::image_float(4, 2, 3, 1.0f), "RGB"), true);
  return beside && read_scene(folder, folder.put("scene.json", input));
}

bool radiance(std::string_view input) {
  static scratch_folder const folder("radiance");
  fs::path const file = folder.put("light.exr", input);
  return accepted(folder, [&] {
    gart::image_float const image = gart::read_radiance(file);
    promise(image.channels == 3 && image.data.size() == std::size_t{3} * static_cast<std::size_t>(image.width) *
                                                            static_cast<std::size_t>(image.height),
            "an image whose data do not fit its size");
    promise(std::all_of(image.data.begin(), image.data.end(), [](float v) { return v >= 0 && v <= 65504; }),
            "light that is none");
  });
}

}  // namespace gart_fuzz
