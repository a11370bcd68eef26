#pragma once
// Runs the built `gart` program as a user would, in a folder of its own that goes when the test ends.

#include <gart/io/file.hpp>
#include <gart/io/image_file.hpp>
#include <gart/io/ply.hpp>

#include <nlohmann/json.hpp>

#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>

#include <sys/wait.h>
#include <unistd.h>

namespace cli_test {

namespace fs = std::filesystem;

struct outcome {
  int code = -1;
  std::string out, err;
};

inline std::string text_of(fs::path const& file) {
  auto const bytes = gart::read_file(file);
  return {bytes.begin(), bytes.end()};
}

class folder {
 public:
  folder() {
    std::string name = (fs::temp_directory_path() / "gart_cli_XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  folder(folder const&) = delete;
  folder& operator=(folder const&) = delete;

  fs::path operator/(std::string const& name) const { return path_ / name; }

  // Arguments are split at spaces by the shell, which runs in this folder; `before` goes in front of the program.
  outcome gart(std::string const& arguments, std::string const& before = {}) const {
    std::string const command =
        "cd '" + path_.string() + "' && " + before + " '" GART_PROGRAM "' " + arguments + " >stdout.txt 2>stderr.txt";
    int const status = std::system(command.c_str());
    return outcome_of(status);
  }
  // Interrupts the program as Ctrl-C does, or by another signal, once `sign` stands in what it has said; waits at most
  // two minutes for that, and two for its end.
  outcome gart_interrupted_at(std::string const& sign, std::string const& arguments, int signal = SIGINT) const {
    std::string const command =
        "cd '" + path_.string() + "' && exec '" GART_PROGRAM "' " + arguments + " >stdout.txt 2>stderr.txt";
    pid_t const child = fork();
    if (child == 0) {
      std::signal(signal, SIG_DFL);  // whatever began the tests: nohup ignores SIGHUP, and so would the program
      execl("/bin/sh", "sh", "-c", command.c_str(), static_cast<char*>(nullptr));
      _exit(127);
    }
    int status = 0;
    for (int waited_ms = 0; waited_ms < 120'000; waited_ms += 20) {
      if (has_said(sign)) break;
      if (waitpid(child, &status, WNOHANG) == child) return outcome_of(status);
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    // One wish, told by the terminal and by all who wait, while the program saves and takes its leave.
    for (int told = 0; told < 20; ++told) {
      kill(child, signal);
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      if (waitpid(child, &status, WNOHANG) == child) return outcome_of(status);
    }
    for (int waited_ms = 0; waited_ms < 120'000; waited_ms += 20) {
      if (waitpid(child, &status, WNOHANG) == child) return outcome_of(status);
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    kill(child, SIGKILL);
    waitpid(child, &status, 0);
    return outcome_of(status);
  }
  nlohmann::json json(std::string const& name) const { return nlohmann::json::parse(text_of(path_ / name)); }

 private:
  bool has_said(std::string const& sign) const {
    for (char const* name : {"stdout.txt", "stderr.txt"})
      if (fs::exists(path_ / name) && text_of(path_ / name).find(sign) != std::string::npos) return true;
    return false;
  }
  outcome outcome_of(int status) const {
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text_of(path_ / "stdout.txt"), text_of(path_ / "stderr.txt")};
  }

  fs::path path_;
};

// A Blender capture of 16 x 16 views, opaque, of a ball coloured by direction; cameras on a ring, 40 starting points.
inline void write_capture(fs::path const& at, int train_views = 4, int test_views = 2) {
  constexpr int size = 16;
  constexpr double angle = 0.7, distance = 4;
  fs::create_directories(at);
  for (std::string const split : {"train", "test"}) {
    int const views = split == "train" ? train_views : test_views;
    nlohmann::json file = {{"camera_angle_x", angle}, {"frames", nlohmann::json::array()}};
    for (int i = 0; i < views; ++i) {
      double const a = 6.2831853 * (i + (split == "test" ? 0.5 : 0.0)) / views, c = std::cos(a), s = std::sin(a);
      // Camera to world, y up and z back: the camera on the circle looks at the centre.
      file["frames"].push_back(
          {{"file_path", "./" + split + "/v" + std::to_string(i)},
           {"transform_matrix",
            {{-s, 0.0, c, distance * c}, {c, 0.0, s, distance * s}, {0.0, 1.0, 0.0, 0.0}, {0.0, 0.0, 0.0, 1.0}}}});
      gart::image8 image(size, size, 3, 20);
      for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
          double const u = (x + 0.5 - size / 2.0) / 6, v = (y + 0.5 - size / 2.0) / 6;
          if (u * u + v * v > 1) continue;
          image.at(x, y, 0) = static_cast<gart::u8>(150 + 90 * u * c);
          image.at(x, y, 1) = static_cast<gart::u8>(130 - 90 * v);
          image.at(x, y, 2) = static_cast<gart::u8>(120 + 60 * s);
        }
      }
      fs::create_directories(at / split);
      gart::write_png(at / split / ("v" + std::to_string(i) + ".png"), image);
    }
    gart::write_file(at / ("transforms_" + split + ".json"), file.dump());
  }
  gart::point_cloud points;
  for (int i = 0; i < 40; ++i) {
    double const z = -0.95 + 1.9 * i / 39, r = std::sqrt(1 - z * z), a = 2.4 * i;
    for (double const p : {r * std::cos(a), r * std::sin(a), z}) points.position.push_back(static_cast<float>(p));
    for (int c = 0; c < 3; ++c) points.color.push_back(128);
  }
  gart::write_point_ply(at / "points3d.ply", points);
}

// One Gaussian in the middle of the capture.
inline gart::gaussian_model one_gaussian() {
  gart::gaussian_model m;
  m.resize(1, 0);
  m.log_scale.assign(3, -0.7f);
  m.quaternion = {1, 0, 0, 0};
  m.opacity = {3};
  m.sh = {1, 0, -1};
  return m;
}

inline bool has(std::string const& text, std::string const& part) { return text.find(part) != std::string::npos; }

}  // namespace cli_test
