// Replays the corpus: a few good inputs of each reader, and those that once broke one. What is named refused_* must be
// refused.

#include "fuzz/readers.hpp"

#include <gart/io/file.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include <sys/resource.h>

namespace {

namespace fs = std::filesystem;

struct reader {
  char const* name;
  bool (*read)(std::string_view);
};

constexpr reader readers[] = {
    {"splat_ply", gart_fuzz::splat_ply},
    {"spz", gart_fuzz::spz},
    {"compressed_ply", gart_fuzz::compressed_ply},
    {"sog", gart_fuzz::sog},
    {"splat_bytes", gart_fuzz::splat_bytes},
    {"glb", gart_fuzz::glb},
    {"point_ply", gart_fuzz::point_ply},
    {"colmap_bin", gart_fuzz::colmap_bin},
    {"colmap_txt", gart_fuzz::colmap_txt},
    {"transforms", gart_fuzz::transforms},
    {"blender", gart_fuzz::blender},
    {"camera_json", gart_fuzz::camera_json},
    {"exposures", gart_fuzz::exposures},
    {"depth", gart_fuzz::depth},
    {"view_message", gart_fuzz::view_message},
    {"png", gart_fuzz::png},
    {"jpeg", gart_fuzz::jpeg},
    {"webp", gart_fuzz::webp},
    {"mesh_ply", gart_fuzz::mesh_ply},
    {"gltf", gart_fuzz::gltf},
    {"obj", gart_fuzz::obj},
    {"scene_json", gart_fuzz::scene_json},
    {"radiance", gart_fuzz::radiance},
    {"checkpoint", gart_fuzz::checkpoint},
#if defined(GART_FUZZ_RESUME)
    {"resume_config", gart_fuzz::resume_config},
    {"resume_history", gart_fuzz::resume_history},
#endif
};

std::vector<fs::path> inputs_of(char const* name) {
  std::vector<fs::path> files;
  for (auto const& entry : fs::directory_iterator(fs::path(GART_SOURCE_DIR) / "tests/fuzz/corpus" / name)) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

TEST_CASE("every corpus input is read or refused by its file's name") {
  for (reader const& r : readers) {
    CAPTURE(std::string(r.name));
    int accepted = 0, refused = 0;
    for (fs::path const& file : inputs_of(r.name)) {
      CAPTURE(file.filename().string());
      auto const bytes = gart::read_file(file);
      auto const begin = std::chrono::steady_clock::now();
      try {
        bool const taken = r.read({reinterpret_cast<char const*>(bytes.data()), bytes.size()});
        if (file.filename().string().rfind("refused_", 0) == 0) CHECK_FALSE(taken);
        (taken ? accepted : refused)++;
      } catch (std::exception const& e) {
        FAIL_CHECK("not an error of gart's: ", std::string(e.what()));
      }
      double const seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      CHECK(seconds < 5);
    }
    CHECK(accepted > 0);  // else the reader is not reached
    CHECK(refused > 0);
  }
  rusage use{};
  getrusage(RUSAGE_SELF, &use);
  CHECK(use.ru_maxrss < 1000000);  // kilobytes: no small file may take a gigabyte
}
