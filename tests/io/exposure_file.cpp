#include "support.hpp"

#include <gart/io/exposure_file.hpp>

using namespace gart_test;

namespace {

gart::exposure_field some_field() {
  std::vector<gart::view_exposure> views;
  for (int i = 0; i < 3; ++i) {
    gart::view_exposure v{"00" + std::to_string(i), {0.1 * i, 1e7 + 0.25, -3}, {0.6f, 0, 0.8f}, {}};
    for (int k = 0; k < gart::exposure::floats; ++k) v.value.m[k] += 0.1f * static_cast<float>(i + k) / 3;
    views.push_back(v);
  }
  std::vector<gart::lens_falloff> lenses(2);
  for (auto& l : lenses)
    l.focal = {0.9f / 7, 1.2f}, l.center = {0.5f, 1 / 3.0f},
    l.value = {{-0.1f, 0.7f / 3, 1e-9f, 1, 2, 3, 4, 5, 1 / 7.0f}};
  lenses[1].focal.x = 3;
  return gart::exposure_field(views, lenses);
}

char const* const sound =
    R"({"views": [{"name": "a", "position": [0, 0, 0], "direction": [0, 0, 1], "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0]}]})";

}  // namespace

TEST_CASE("exposures come back from their file with every bit") {
  scratch_folder folder;
  auto const path = folder.path / "exposures.json";
  auto const written = some_field();
  gart::write_exposures(path, written);
  auto const read = gart::read_exposures(path);
  REQUIRE(read.views().size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    auto const &a = written.views()[i], &b = read.views()[i];
    CHECK(a.name == b.name);
    CHECK(a.position == b.position);
    CHECK(a.direction == b.direction);
    for (int k = 0; k < gart::exposure::floats; ++k) CHECK(a.value.m[k] == b.value.m[k]);
  }
  REQUIRE(read.lenses().size() == 2);
  for (std::size_t i = 0; i < 2; ++i) {
    auto const &a = written.lenses()[i], &b = read.lenses()[i];
    CHECK(a.focal == b.focal);
    CHECK(a.center == b.center);
    for (int k = 0; k < gart::vignetting::floats; ++k) CHECK(a.value.k[k] == b.value.k[k]);
  }
  // Lenses alone are enough: a run may learn no exposures.
  gart::write_exposures(path, gart::exposure_field({}, written.lenses()));
  CHECK(gart::read_exposures(path).views().empty());
  CHECK(gart::read_exposures(path).lenses().size() == 2);
}

TEST_CASE("a file without exposures is refused by view and field") {
  scratch_folder folder;
  CHECK(gart::read_exposures(folder.put("sound.json", sound)).views().size() == 1);
  auto const refused = [&](std::string const& what, std::string const& with, std::string const& expected) {
    std::string text = sound;
    auto const at = text.find(what);
    REQUIRE(at != std::string::npos);
    text.replace(at, what.size(), with);
    auto const path = folder.put("bad.json", text);
    try {
      gart::read_exposures(path);
      FAIL("not refused: " << text);
    } catch (gart::io_error const& e) {
      std::string const said = e.what();
      CHECK_MESSAGE(said.find(path.string()) != std::string::npos, said);
      CHECK_MESSAGE(said.find(expected) != std::string::npos, said);
      CHECK_MESSAGE(said.find("gart train") != std::string::npos, said);
    }
  };
  refused("\"views\"", "\"view\"", "list 'views'");
  refused("}]}", "}", "list 'views'");
  refused(sound, "[]", "list 'views'");
  refused(sound, "{\"views\": []}", "list 'views'");
  refused(sound, "{\"views\": [3]}", "view 0: is not an object");
  refused("[0, 0, 0]", "[0, 0]", "view 0: 'position' is not a list of 3 finite numbers");
  refused("[0, 0, 1]", "[0, null, 1]", "'direction'");
  refused("0,0,1,0]", "0,0,1e999,0]", "list 'views'");
  refused("0,0,1,0]", "0,0,1e99,0]", "'matrix' is not a list of 12 finite numbers");
  refused("0,0,1,0]", "0,0,1]", "'matrix'");
  refused("[0, 0, 0]", "[0, 1e200, 0]", "'position'");
  refused("\"views\"", "\"lenses\": 3, \"views\"", "'lenses' is no list");
  refused("\"views\"", "\"lenses\": [3], \"views\"", "lens 0: is not an object");
  std::string const lens = R"("lenses": [{"focal": [1, 1], "center": [0.5, 0.5]}], "views")";
  refused("\"views\"", lens, "lens 0: 'falloff' is not a list of 9 finite numbers");
  refused("\"matrix\"", "\"matrices\"", "'matrix'");
  CHECK_THROWS_AS(gart::read_exposures(folder.path / "nowhere.json"), gart::io_error);
}
