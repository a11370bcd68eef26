// The program of the benchmarks: Google Benchmark's options, and the scene to run on.
#include "support/scene.hpp"

#include <gart/core/error.hpp>

#include <benchmark/benchmark.h>

#include <cstdio>
#include <exception>
#include <optional>

namespace gart_bench {

namespace {

scene const* current = nullptr;

constexpr char const* usage =
    "usage: gart_bench [--model FILE.ply --cameras FILE.json | --model FILE.ply --scene SCENE.json --size WxH |\n"
    "                   --gaussians N --size WxH] [--write STEM]\n"
    "                  [--benchmark_filter=REGEX and Google Benchmark's other options]\n\n"
    "Times every stage of a training step on one view: the first camera of CAMERAS, or of a scene of N discs (default\n"
    "20000 at 320x240). Paths of light meet the meshes and lights of SCENE. --write makes STEM.ply and STEM.json of "
    "that scene instead. Names: stage/policy.\n";

struct arguments {
  scene_options scene;
  std::filesystem::path write;
};

// Nothing where what is left after Google Benchmark's own options is not understood.
std::optional<arguments> parse(int argc, char** argv) {
  arguments out;
  for (int i = 1; i < argc; i += 2) {
    std::string const name = argv[i];
    if (i + 1 == argc) return {};
    char const* const value = argv[i + 1];
    unsigned long long n = 0;
    if (name == "--model")
      out.scene.model = value;
    else if (name == "--cameras")
      out.scene.cameras = value;
    else if (name == "--scene")
      out.scene.scene = value;
    else if (name == "--write")
      out.write = value;
    else if (name == "--gaussians" && std::sscanf(value, "%llu", &n) == 1 && n > 0)
      out.scene.gaussians = n;
    else if (name == "--size" && std::sscanf(value, "%dx%d", &out.scene.width, &out.scene.height) == 2 &&
             out.scene.width > 0 && out.scene.height > 0)
      continue;
    else
      return {};
  }
  if (out.scene.model.empty() != (out.scene.cameras.empty() && out.scene.scene.empty())) return {};
  if (!out.scene.cameras.empty() && !out.scene.scene.empty()) return {};
  return out;
}

int run(int argc, char** argv) {
  for (int i = 1; i < argc; ++i)
    if (std::string(argv[i]) == "--help") {
      std::fputs(usage, stdout);
      return 0;
    }
  benchmark::Initialize(&argc, argv);
  std::optional<arguments> const a = parse(argc, argv);
  if (!a) {
    std::fputs(usage, stderr);
    return 2;
  }
  scene const made = make_scene(a->scene);
  if (!a->write.empty()) {
    write_scene(a->write, made);
    return 0;
  }
  current = &made;
  benchmark::AddCustomContext("gaussians", std::to_string(made.model.size()));
  benchmark::AddCustomContext("image", std::to_string(made.view().width) + "x" + std::to_string(made.view().height));
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}

}  // namespace

scene const& the_scene() { return *current; }

}  // namespace gart_bench

int main(int argc, char** argv) {
  try {
    return gart_bench::run(argc, argv);
  } catch (std::exception const& error) {
    std::fprintf(stderr, "gart_bench: %s\n", error.what());
    return 1;
  }
}
