// What reading a small file may take: 64 times its bytes, beside what the program takes anyway.

#include "program.hpp"
#include "support/glb_bytes.hpp"

#include <gart/io/splat_file.hpp>

#include <doctest/doctest.h>

#include <malloc.h>
#include <sys/resource.h>
#include <zlib.h>

#include <cstring>

using namespace cli_test;
using gart_test::glb_of;

namespace {

constexpr double times = 64, beside = 16e6;  // bytes

// The most memory that the program held, in bytes. A child begins with what its parent has: that goes first.
double peak_of(folder const& here, std::string const& arguments) {
  std::string const command =
      "cd '" + (here / "").string() + "' && exec '" GART_PROGRAM "' " + arguments + " >stdout.txt 2>stderr.txt";
  malloc_trim(0);
  pid_t const child = fork();
  if (child == 0) {
    setenv("OMP_NUM_THREADS", "1", 1);
    execl("/bin/sh", "sh", "-c", command.c_str(), static_cast<char*>(nullptr));
    _exit(127);
  }
  int status = 0;
  struct rusage used {};
  wait4(child, &status, 0, &used);
  return 1024.0 * static_cast<double>(used.ru_maxrss);
}

std::string gzipped(std::string const& text) {
  z_stream stream{};
  REQUIRE(deflateInit2(&stream, 9, Z_DEFLATED, 16 + 15, 8, Z_DEFAULT_STRATEGY) == Z_OK);
  std::string out(deflateBound(&stream, text.size()) + 64, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  stream.avail_in = static_cast<uInt>(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data()), stream.avail_out = static_cast<uInt>(out.size());
  REQUIRE(deflate(&stream, Z_FINISH) == Z_STREAM_END);
  std::string const packed = out.substr(0, stream.total_out);
  deflateEnd(&stream);
  return packed;
}

template <class T>
void append(std::string& bytes, T value) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  bytes.append(raw, sizeof value);
}

// SPZ of version 2, degree 3, all zeros: a thousand times its bytes.
std::string spz_of(gart::u32 gaussians) {
  std::string raw;
  for (gart::u32 v : {0x5053474eu, 2u, gaussians}) append(raw, v);
  raw += std::string("\3\x0c\0\0", 4);
  raw += std::string(std::size_t{64} * gaussians, '\0');
  return gzipped(raw);
}

// All attributes of degree 3 in the same bytes, eight a Gaussian, in as many meshes.
std::string shared_glb(std::size_t gaussians, std::size_t meshes) {
  std::string const n = std::to_string(gaussians);
  std::string attributes = R"("POSITION":0,"KHR_gaussian_splatting:ROTATION":2,"KHR_gaussian_splatting:SCALE":0,)"
                           R"("KHR_gaussian_splatting:OPACITY":1)";
  for (int l = 0; l <= 3; ++l)
    for (int k = 0; k <= 2 * l; ++k)
      attributes += ",\"KHR_gaussian_splatting:SH_DEGREE_" + std::to_string(l) + "_COEF_" + std::to_string(k) + "\":0";
  std::string accessors;
  for (char const* type : {"VEC3", "SCALAR", "VEC4"})
    accessors += std::string(accessors.empty() ? "" : ",") +
                 R"({"bufferView":0,"componentType":5121,"normalized":true,"count":)" + n + R"(,"type":")" + type +
                 "\"}";
  std::string const bytes = std::to_string(8 * gaussians);
  return glb_of(R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[)" + std::string(meshes > 1 ? "0,1" : "0") +
                    R"(]}],"nodes":[{"mesh":0},{"mesh":0}],"meshes":)"
                    R"([{"primitives":[{"attributes":{)" +
                    attributes +
                    R"(},"mode":0,"extensions":{"KHR_gaussian_splatting":{"kernel":"ellipse","colorSpace":)"
                    R"("srgb_rec709_display"}}}]}],"accessors":[)" +
                    accessors + R"(],"buffers":[{"byteLength":)" + bytes +
                    R"(}],"bufferViews":[{"buffer":0,"byteLength":)" + bytes + R"(,"byteStride":8}]})",
                std::string(8 * gaussians, '\x55'));
}

std::string repeated(std::string const& what, std::size_t bytes) {
  std::string all;
  while (all.size() < bytes) all += what;
  return all;
}

}  // namespace

TEST_CASE("reading a file takes 64 times its bytes at the most") {
  folder const here;
  gart::write_splat_ply(here / "one.ply", one_gaussian());
  double const base = peak_of(here, "convert one.ply out.ply");
  auto const check = [&](std::string const& name, std::string const& bytes, std::string const& arguments) {
    CAPTURE(name);
    gart::write_file(here / name, bytes);
    double const peak = peak_of(here, arguments), more = std::max(0.0, peak - base - beside);
    MESSAGE(name, ": ", bytes.size(), " bytes, ", peak / 1e6, " MB of which ", base / 1e6, " MB beside it; ",
            more / static_cast<double>(bytes.size()), " times");
    CHECK(more <= times * static_cast<double>(bytes.size()));
  };
  for (gart::u32 n : {5'000u, 40'000u, 1'000'000u}) {
    check("zeros" + std::to_string(n) + ".spz", spz_of(n), "info zeros" + std::to_string(n) + ".spz");
    check("zeros.spz", spz_of(n), "convert zeros.spz out.ply");
  }
  for (std::size_t n : {4'000u, 130'000u, 200'000u})
    for (std::size_t meshes : {1u, 2u}) check("shared.glb", shared_glb(n, meshes), "convert shared.glb out.ply");
  std::size_t const size = 1'000'000;
  check("empty.glb", glb_of("{\"nodes\":[" + repeated("{},", size) + "{}]}", ""), "convert empty.glb out.ply");
  check("lists.glb", glb_of("[" + repeated("[],", size) + "[]]", ""), "convert lists.glb out.ply");
  check("deep.glb", glb_of(repeated("[", size), ""), "convert deep.glb out.ply");
  check("cameras.json", "[" + repeated("{},", size) + "{}]", "render one.ply cameras.json --out images");
  check("numbers.json", "[" + repeated("1,", size) + "1]", "render one.ply numbers.json --out images");
  check("transforms.json", "{\"fl_x\":9,\"frames\":[" + repeated("[],", size) + "[]]}", "info transforms.json");
  std::string ply = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(size / 34) + "\n";
  for (char const* p : {"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2",
                        "rot_0", "rot_1", "rot_2", "rot_3", "filter_3D"})
    ply += std::string("property double ") + p + "\n";
  check("ascii.ply", ply + "end_header\n" + repeated("1 1 1 1 1 1 1 1 1 1 1 1 1 1 1\n", size),
        "convert ascii.ply out.ply");
  check("mesh.ply",
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nelement face " +
            std::to_string(size / 6) + "\nproperty list uchar uchar vertex_index\nend_header\n0 0 0\n" +
            repeated("9 0 0 0 0 0 0 0 0 0\n", size),
        "mesh one.ply cameras.json --out mesh_out.ply --against mesh.ply");
}
