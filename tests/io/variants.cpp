// Files as other programs have them: WebP photographs, SOG as a folder, a zip file around a model, mip-splatting's
// filters, SPZ within GLB, quaternions of any length.

#include <gart/io/ply.hpp>
#include <gart/io/splat_file.hpp>

#include "support.hpp"
#include "support/glb_bytes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

namespace {

using namespace gart_test;

gart::gaussian_model few(std::size_t n, int degree = 0) {
  std::mt19937_64 random(seed());
  std::normal_distribution<float> normal;
  gart::gaussian_model m;
  m.resize(n, degree);
  for (auto* values : {&m.mean, &m.log_scale, &m.quaternion, &m.opacity, &m.sh})
    for (float& v : *values) v = std::clamp(normal(random), -3.0f, 3.0f);
  return m;
}

// The entries of a zip file that stores them as they are.
std::map<std::string, std::string> unpacked(std::string const& zip) {
  std::map<std::string, std::string> entries;
  for (std::size_t at = 0; zip.compare(at, 4, "PK\x03\x04") == 0;) {
    gart::u32 size = 0;
    gart::u16 name = 0, extra = 0;
    std::memcpy(&size, &zip[at + 18], 4), std::memcpy(&name, &zip[at + 26], 2), std::memcpy(&extra, &zip[at + 28], 2);
    std::size_t const body = at + 30 + name + extra;
    entries[zip.substr(at + 30, name)] = zip.substr(body, size);
    at = body + size;
  }
  return entries;
}

// The entries of a SOG; none where gart is built without libwebp.
std::map<std::string, std::string> sog_of(scratch_folder const& folder, gart::gaussian_model const& model) {
  std::string const said = error_of([&] { gart::write_splats(folder.path / "whole.sog", model); });
  if (said.empty()) return unpacked(text_of(folder.path / "whole.sog"));
  CHECK(holds(said, "libwebp-dev"));
  return {};
}

}  // namespace

TEST_CASE("WebP photographs are read as others are") {
  scratch_folder const folder;
  auto model = few(16);
  for (std::size_t i = 0; i < 16; ++i) model.opacity[i] = std::log((16 * i + 5) / (250.0f - 16 * i));
  auto const entries = sog_of(folder, model);
  if (entries.empty()) return;
  // 4 x 4 pixels, whose fourth byte is a Gaussian's opacity.
  auto const image = gart::read_image(folder.put("photo.webp", entries.at("sh0.webp")));
  CHECK(image.width == 4);
  CHECK(image.height == 4);
  REQUIRE(image.channels == 4);
  std::vector<int> alpha;
  for (std::size_t i = 0; i < 16; ++i) alpha.push_back(image.data[4 * i + 3]);
  std::sort(alpha.begin(), alpha.end());
  for (int i = 0; i < 16; ++i) CHECK(alpha[static_cast<std::size_t>(i)] == 16 * i + 5);
  CHECK(gart::read_image(folder.put("opaque.webp", entries.at("scales.webp"))).channels == 3);
  std::string const photo = entries.at("scales.webp");
  for (std::size_t cut = 0; cut < photo.size(); ++cut) {
    std::string const said = error_of([&] { gart::read_image(folder.put("cut.webp", photo.substr(0, cut))); });
    CHECK(holds(said, "cut.webp"));
  }

  // A capture of them, named without their ending.
  for (int i = 0; i < 3; ++i) folder.put("c/images/v" + std::to_string(i) + ".webp", photo);
  std::string frames;
  for (int i = 0; i < 3; ++i)
    frames += std::string(i ? "," : "") + "{\"file_path\": \"images/v" + std::to_string(i) +
              "\", \"transform_matrix\": [[1,0,0," + std::to_string(i) + "],[0,1,0,0],[0,0,1,4],[0,0,0,1]]}";
  folder.put("c/transforms.json", "{\"camera_angle_x\": 0.8, \"frames\": [" + frames + "]}");
  gart::dataset_options options;
  options.test_every = 0;
  auto const data = gart::load_dataset(folder.path / "c", options);
  REQUIRE(data.train.size() == 3);
  CHECK(data.train[1].name == "v1");
  CHECK(data.train[1].image.width == 4);
}

TEST_CASE("a photograph that its EXIF turns is named") {
  scratch_folder const folder;
  auto const with_exif = [&](std::string const& to, bool big, int orientation) {
    folder.put_image("plain.jpg", 24, 18);
    std::string jpeg = text_of(folder.path / "plain.jpg");
    auto const number = [&](gart::u32 value, int width) {
      std::string bytes;
      for (int i = 0; i < width; ++i) bytes += static_cast<char>(value >> 8 * (big ? width - 1 - i : i));
      return bytes;
    };
    std::string const tiff = std::string(big ? "MM" : "II") + number(42, 2) + number(8, 4) + number(1, 2) +
                             number(0x0112, 2) + number(3, 2) + number(1, 4) +
                             number(static_cast<gart::u32>(orientation), 2) + number(0, 2) + number(0, 4);
    std::size_t const length = 2 + 6 + tiff.size();
    std::string segment = "\xff\xe1";
    segment += static_cast<char>(length >> 8), segment += static_cast<char>(length);
    segment += std::string("Exif\0\0", 6) + tiff;
    jpeg.insert(2, segment);
    return folder.put(to, jpeg);
  };
  // The camera is of an upright photograph.
  folder.put("transforms.json",
             R"({"fl_x": 20, "w": 18, "h": 24, "frames": [{"file_path": "a.jpg", "transform_matrix":)"
             R"( [[1,0,0,0],[0,1,0,0],[0,0,1,4],[0,0,0,1]]}]})");
  gart::dataset_options options;
  options.test_every = 0;
  auto const said = [&] { return error_of([&] { gart::load_dataset(folder.path, options); }); };
  for (bool big : {false, true}) {
    with_exif("a.jpg", big, 6);
    CHECK(holds(said(), "is 24 x 18 pixels, but its camera is for 18 x 24, the same turned: its EXIF says"));
    CHECK(holds(said(), "orientation 6"));
    CHECK(holds(said(), "exiftran"));
  }
  with_exif("a.jpg", false, 1);
  CHECK_FALSE(holds(said(), "EXIF"));
  CHECK(holds(said(), "is 24 x 18 pixels"));
  // Whatever stands there.
  std::string const jpeg = text_of(folder.path / "a.jpg");
  std::mt19937_64 random(seed());
  for (int i = 0; i < 300; ++i) {
    std::string damaged = jpeg;
    for (int k = 0; k < 3; ++k) damaged[2 + random() % 60] = static_cast<char>(random());
    folder.put("a.jpg", damaged);
    said();
  }
}

TEST_CASE("SOG as a folder is the same as SOG in a file") {
  scratch_folder const folder;
  auto const entries = sog_of(folder, few(300, 2));
  if (entries.empty()) return;
  for (auto const& [name, bytes] : entries) folder.put("unpacked/" + name, bytes);
  auto const whole = gart::read_splats(folder.path / "whole.sog");
  for (fs::path const& path : {folder.path / "unpacked", folder.path / "unpacked/meta.json"}) {
    auto const model = gart::read_splats(path);
    CHECK(model.mean == whole.mean);
    CHECK(model.sh == whole.sh);
  }
  fs::remove(folder.path / "unpacked/quats.webp");
  CHECK(holds(error_of([&] { gart::read_splats(folder.path / "unpacked"); }), "quats.webp"));
  std::string meta = entries.at("meta.json");
  auto const at = meta.find("scales.webp");
  folder.put("secret", "x");
  folder.put("unpacked/meta.json", meta.replace(at, 11, "../secret"));
  folder.put("unpacked/quats.webp", entries.at("quats.webp"));
  CHECK(holds(error_of([&] { gart::read_splats(folder.path / "unpacked"); }), "../secret, which is not beside it"));
  CHECK(holds(error_of([&] { gart::read_splats(folder.path); }), "in no format of Gaussians"));
}

TEST_CASE("a zip file around a model is named as one") {
  scratch_folder const folder;
  auto const entries = sog_of(folder, few(5));
  if (entries.empty()) return;
  std::string const zip = text_of(folder.path / "whole.sog");
  auto const renamed = [&](std::string const& to) {
    std::string text = zip;
    for (std::size_t at = 0; (at = text.find("meta.json", at)) != text.npos; ++at) text.replace(at, 9, to);
    return folder.put("around.zip", text);
  };
  CHECK(holds(error_of([&] { gart::read_splats(renamed("scene.ply")); }),
              "is a zip file around scene.ply (unpack it, and name scene.ply)"));
  CHECK(holds(error_of([&] { gart::read_splats(renamed("notes.txt")); }), "without the meta.json of SOG"));
}

TEST_CASE("mip-splatting's filter is taken into scales and opacities") {
  scratch_folder const folder;
  std::string text = "ply\nformat ascii 1.0\nelement vertex 2\n";
  for (char const* name : {"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "filter_3D", "opacity", "scale_0", "scale_1",
                           "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"})
    text += std::string("property float ") + name + "\n";
  // Scales 1, 2 and 0.5, opacity 0.5; a filter of 0.75, and none.
  for (char const* filter : {"0.75", "0"})
    text +=
        (text.back() == '\n' && text.find("end_header") == text.npos ? std::string("end_header\n") : std::string()) +
        "1 2 3 0 0 0 " + filter + " 0 0 0.6931471805599453 -0.6931471805599453 1 0 0 0\n";
  gart::splat_traits traits;
  std::vector<std::string> notes;
  auto const m = gart::read_splats(folder.put("mip.ply", text), &traits, &notes);
  double const f2 = 0.75 * 0.75;
  double opacity = 0.5;
  double const scales[] = {1, 2, 0.5};
  for (std::size_t c = 0; c < 3; ++c) {
    double const wide = std::sqrt(scales[c] * scales[c] + f2);
    CHECK(m.log_scale[c] == doctest::Approx(std::log(wide)));
    CHECK(m.log_scale[3 + c] == doctest::Approx(std::log(scales[c])));
    opacity *= scales[c] / wide;
  }
  CHECK(1 / (1 + std::exp(-double{m.opacity[0]})) == doctest::Approx(opacity));
  CHECK(m.opacity[1] == 0);
  CHECK(traits.count("antialias") == 1);
  REQUIRE(notes.size() == 1);
  CHECK(holds(notes[0], "mip.ply is of mip-splatting: its filter_3D is taken into scales"));
}

TEST_CASE("a rotation is one whatever the length of its quaternion") {
  scratch_folder const folder;
  auto model = few(3);
  float const q[] = {0.5f, -0.5f, 0.1f, 0.7f};
  for (std::size_t k = 0; k < 4; ++k)
    model.quaternion[k] = 1e-6f * q[k], model.quaternion[4 + k] = 1e25f * q[k], model.quaternion[8 + k] = 0.01f * q[k];
  gart::write_splat_ply(folder.path / "q.ply", model);
  auto const back = gart::read_splats(folder.path / "q.ply");
  for (std::size_t i = 0; i < 2; ++i)
    for (std::size_t k = 0; k < 4; ++k) CHECK(back.quaternion[4 * i + k] == doctest::Approx(q[k]));
  for (std::size_t k = 0; k < 4; ++k) CHECK(back.quaternion[8 + k] == model.quaternion[8 + k]);
}

TEST_CASE("a GLB with SPZ in it is that SPZ, where its node places it") {
  scratch_folder const folder;
  auto const model = few(60, 1);
  if (!error_of([&] { gart::write_splats(folder.path / "m.spz", model); }).empty()) return;
  std::string const spz = text_of(folder.path / "m.spz");
  auto const whole = gart::read_splats(folder.path / "m.spz");
  auto const glb = [&](std::string const& node, std::size_t length) {
    return glb_of(
        R"({"asset":{"version":"2.0"},"extensionsUsed":["KHR_gaussian_splatting",)"
        R"("KHR_gaussian_splatting_compression_spz_2"],"extensionsRequired":["KHR_gaussian_splatting",)"
        R"("KHR_gaussian_splatting_compression_spz_2"],"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0)" +
            node +
            R"(}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"mode":0,"extensions":)"
            R"({"KHR_gaussian_splatting":{"extensions":{"KHR_gaussian_splatting_compression_spz_2":)"
            R"({"bufferView":0}}}}}]}],"accessors":[{"componentType":5126,"count":60,"type":"VEC3"}],)"
            R"("buffers":[{"byteLength":)" +
            std::to_string(spz.size()) + R"(}],"bufferViews":[{"buffer":0,"byteLength":)" + std::to_string(length) +
            "}]}",
        spz);
  };
  auto const plain = gart::read_splats(folder.put("plain.glb", glb("", spz.size())));
  CHECK(plain.mean == whole.mean);
  CHECK(plain.quaternion == whole.quaternion);
  CHECK(plain.sh == whole.sh);
  auto const moved = gart::read_splats(folder.put("moved.glb", glb(",\"translation\":[0,3,0]", spz.size())));
  for (std::size_t i = 0; i < 60; ++i) CHECK(moved.mean[3 * i + 1] == doctest::Approx(whole.mean[3 * i + 1] - 3));
  CHECK(holds(error_of([&] { gart::read_splats(folder.put("short.glb", glb("", spz.size() + 9))); }),
              "reaches past the end"));
  CHECK(holds(error_of([&] { gart::read_splats(folder.put("cut.glb", glb("", spz.size() / 2))); }), "cut.glb: SPZ"));
}

TEST_CASE("a GLB is written with SPZ 2 in it") {
  scratch_folder const folder;
  auto const model = few(60, 2);
  gart::splat_packing const packing{.spz = true};
  gart::splat_traits const traits{{"antialias", "0.3"}, {"origin", "1000,0,0"}};
  gart::write_splats(folder.path / "m.glb", model, traits, packing);
  std::string const bytes = text_of(folder.path / "m.glb");
  CHECK(holds(bytes, R"("extensionsRequired":["KHR_gaussian_splatting","KHR_gaussian_splatting_compression_spz_2"])"));
  gart::u32 text = 0;
  std::memcpy(&text, &bytes[12], 4);
  CHECK(bytes.compare(28 + text, 2, "\x1f\x8b") == 0);
  CHECK(bytes.size() % 4 == 0);
  CHECK(bytes.size() < 60 * 59 * 4 / 2);

  gart::splat_traits read;
  auto const back = gart::read_splats(folder.path / "m.glb", &read);
  CHECK(read == traits);
  // Version 4 has the same numbers in the same order, but finer rotations.
  if (!error_of([&] { gart::write_splats(folder.path / "m.spz", model); }).empty()) return;
  auto const fine = gart::read_splats(folder.path / "m.spz");
  CHECK(back.mean == fine.mean);
  CHECK(back.log_scale == fine.log_scale);
  CHECK(back.opacity == fine.opacity);
  CHECK(back.sh == fine.sh);
  for (std::size_t i = 0; i < 60; ++i) {
    float dot = 0;
    for (std::size_t k = 0; k < 4; ++k) dot += back.quaternion[4 * i + k] * fine.quaternion[4 * i + k];
    CHECK(std::abs(dot) > 0.99f);
  }
  CHECK(holds(error_of([&] { gart::write_splats(folder.path / "m.ply", model, {}, packing); }), "write a .glb"));
  auto far = model;
  far.mean[0] = 1e6f;
  CHECK(gart::left_out(folder.path / "m.glb", far, {}).empty());
  REQUIRE(gart::left_out(folder.path / "m.glb", far, {}, packing).size() == 1);
}
