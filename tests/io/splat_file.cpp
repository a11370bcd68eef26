#include <gart/io/ply.hpp>
#include <gart/io/splat_file.hpp>

#include "support.hpp"

namespace {

using namespace gart_test;

gart::gaussian_model one() {
  gart::gaussian_model m;
  m.resize(1, 0);
  m.mean = {1, 2, 3}, m.log_scale = {-1, -2, -3}, m.quaternion = {1, 0, 0, 0}, m.opacity = {0.5f}, m.sh = {1, 2, 3};
  return m;
}

TEST_CASE("a file of Gaussians is known by its first bytes") {
  scratch_folder const folder;
  gart::write_splats(folder.path / "model.PLY", one(), {{"kernel_degree", "4"}});
  for (char const* name : {"model.bin", "model", "model.jpg"}) {
    CAPTURE(name);
    fs::copy_file(folder.path / "model.PLY", folder.path / name);
    gart::splat_traits traits;
    auto const back = gart::read_splats(folder.path / name, &traits);
    CHECK(back.mean == one().mean);
    CHECK(back.sh == one().sh);
    CHECK(traits == gart::splat_traits{{"kernel_degree", "4"}});
    CHECK(gart::read_splats(folder.path / name).size() == 1);
  }
}

TEST_CASE("what is in no format is refused with the list of formats") {
  scratch_folder const folder;
  for (char const* bytes : {"", "p", "glXF and more than 16 bytes"}) {
    auto const path = folder.put("model.xyz", bytes);
    std::string const said = error_of([&] { gart::read_splats(path); });
    CHECK(holds(said, "model.xyz"));
    CHECK(holds(said, "PLY (.ply)"));
  }
  // The name decides where the bytes say nothing: the format's own reader says what is wrong.
  CHECK(holds(error_of([&] { gart::read_splats(folder.put("damaged.ply", "pl")); }), "ply"));
  CHECK(holds(error_of([&] { gart::read_splats(folder.path / "none.xyz"); }), "no such file"));
  CHECK(holds(error_of([&] { gart::write_splats(folder.path / "model.xyz", one()); }), "PLY (.ply)"));
}

TEST_CASE("formats have names, endings and readers, and know their own") {
  CHECK(gart::splat_formats().size() >= 1);
  scratch_folder const folder;
  for (gart::splat_format const* format : gart::splat_formats()) {
    CAPTURE(format->name);
    bool const reads = format->read != nullptr;
    REQUIRE(reads);
    CHECK(format->extension[0] == '.');
    if (!format->write) continue;
    auto const path = folder.path / (std::string("model") + format->extension);
    try {
      gart::write_splats(path, one());
    } catch (gart::io_error const& e) {
      CHECK(holds(e.what(), "install lib"));  // built without the format's library
      continue;
    }
    auto const bytes = gart::read_file(path);
    std::string_view const first(reinterpret_cast<char const*>(bytes.data()),
                                 std::min<std::size_t>(4096, bytes.size()));
    // The first that knows the bytes is the one that reads them; a format without such bytes is known by its name.
    gart::splat_format const* known = nullptr;
    for (gart::splat_format const* any : gart::splat_formats())
      if (!known && any->begins && any->begins(first)) known = any;
    CHECK(known == (format->begins ? format : nullptr));
    CHECK(gart::read_splats(path).size() == 1);
  }
}

}  // namespace

TEST_CASE("a training, a capture or cameras in place of a model are called that") {
  scratch_folder const folder;
  auto const refused = [&](fs::path const& path) { return error_of([&] { gart::read_splats(path); }); };
  folder.put("cap/transforms.json", "{}"), folder.put("early/checkpoint.gart", "");
  fs::path const model = folder.put("run/model.ply", "");
  CHECK(holds(refused(folder.path / "run"), "is the folder of a training (name " + model.string() + ")"));
  CHECK(holds(refused(folder.path / "early"), "that has left no model.ply yet (resume the training"));
  for (char const* path : {"cap", "cap/transforms.json"}) {
    CHECK(holds(refused(folder.path / path), ", where a model is wanted"));
    CHECK(holds(refused(folder.path / path), "the two may be swapped"));
  }
}

TEST_CASE("a glTF file that is empty or no JSON is refused without the parser's own names") {
  scratch_folder const folder;
  CHECK(holds(error_of([&] { gart::read_splats(folder.put("a.glb", "")); }), "is empty (the file is truncated"));
  std::string const error = error_of([&] { gart::read_splats(folder.put("b.glb", "{\"meshes\": [1,]}")); });
  CHECK(holds(error, "glTF: parse error at line 1"));
}
