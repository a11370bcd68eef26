#pragma once
// What the readers under test share: a folder in memory, and what to expect of an error.

#include "fuzz/readers.hpp"

#include <gart/core/error.hpp>
#include <gart/scene/camera.hpp>

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

namespace gart_fuzz {

namespace fs = std::filesystem;

inline void promise(bool kept, std::string const& what) {
  if (!kept) throw broken_promise(what);
}

inline bool finite(std::vector<float> const& values) {
  return std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); });
}

inline bool finite(gart::vec3d const& v) {
  bool all = true;
  for (int i = 0; i < 3; ++i) all = all && std::isfinite(static_cast<float>(v[i]));
  return all;
}

inline void check_camera(gart::camera const& c) {
  promise(c.width >= 1 && c.height >= 1, "a camera without pixels");
  bool const sphere = c.kind == gart::camera_kind::equirectangular;
  promise(sphere || (c.fx > 0 && c.fy > 0 && finite({c.fx, c.fy, c.cx, c.cy})), "intrinsics that are not finite");
  promise(finite({c.lens.k1, c.lens.k2, c.lens.p1, c.lens.p2}), "a lens that is not finite");
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      float dot = 0;
      for (int k = 0; k < 3; ++k) dot += c.rotation[i][k] * c.rotation[j][k];
      promise(std::abs(dot - (i == j ? 1.0f : 0.0f)) < 1e-3f, "a pose that is no rotation");
    }
  }
  promise(finite(c.position), "a position that is not finite");
}

// A folder of this process and this reader, gone when the process ends.
class scratch_folder {
 public:
  explicit scratch_folder(std::string const& reader) {
    fs::path const memory = "/dev/shm";
    path_ = (fs::is_directory(memory) ? memory : fs::temp_directory_path()) /
            ("gart_fuzz_" + std::to_string(::getpid()) + "_" + reader);
    fs::create_directories(path_);
  }
  ~scratch_folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  scratch_folder(scratch_folder const&) = delete;
  scratch_folder& operator=(scratch_folder const&) = delete;

  fs::path const& path() const { return path_; }
  // Without the care of gart::write_file: thousands of times a second.
  fs::path put(std::string const& name, std::string_view bytes) const {
    fs::path const file = path_ / name;
    fs::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary | std::ios::trunc)
        .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    return file;
  }

 private:
  fs::path path_;
};

// Whether `read` accepts what lies in the folder.
template <class Read>
bool accepted(scratch_folder const& folder, Read const& read) {
  try {
    read();
    return true;
  } catch (gart::error const& e) {
    promise(std::string_view(e.what()).find(folder.path().native()) != std::string_view::npos,
            std::string("an error does not name its file: ") + e.what());
    return false;
  }
}

}  // namespace gart_fuzz
