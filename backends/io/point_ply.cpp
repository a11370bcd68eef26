// PLY of points.
#include "ply_body.hpp"

#include <gart/io/file.hpp>
#include <gart/io/ply.hpp>

namespace gart {
namespace {

using namespace io::ply;
using io::put;

// Colours are bytes, 16-bit integers, or floats in [0, 1].
struct point_store {
  point_cloud& points;
  std::array<scalar, 3> color_type;

  double settled(std::size_t, double value) const { return value; }
  void resize(std::size_t n) const { points.position.resize(3 * n), points.color.assign(3 * n, 128); }
  void operator()(std::size_t c, std::size_t i, double value) const {
    if (c < 3) {
      points.position[3 * i + c] = static_cast<float>(value);
      return;
    }
    scalar const type = color_type[c - 3];
    double const scale = type == scalar::f32 || type == scalar::f64 ? 255.0 : type == scalar::u16 ? 1.0 / 257.0 : 1.0;
    if (std::isfinite(value))
      points.color[3 * i + c - 3] = static_cast<u8>(std::clamp(value * scale + 0.5, 0.0, 255.0));
  }
};

}  // namespace

point_cloud read_point_ply(std::filesystem::path const& path, std::vector<std::string>* notes) {
  ply_file const file = open(path);
  element const& e = vertices(file);
  std::vector<std::string> columns{"x", "y", "z"};
  require_columns(file, e, columns, "export points with x, y and z");
  property const* const color[] = {find(e, "red"), find(e, "green"), find(e, "blue")};
  point_cloud points;
  point_store store{points, {}};
  if (color[0] && color[1] && color[2]) {
    columns.insert(columns.end(), {"red", "green", "blue"});
    for (std::size_t c = 0; c < 3; ++c) store.color_type[c] = color[c]->type;
  }
  io::unusable bad;
  read_vertices(file, columns, store, bad);
  if (bad.records().empty()) return points;
  point_cloud usable;
  for (std::size_t const i : bad.others(points.size(), "point", file.name, notes)) {
    usable.position.insert(usable.position.end(), &points.position[3 * i], &points.position[3 * i] + 3);
    usable.color.insert(usable.color.end(), &points.color[3 * i], &points.color[3 * i] + 3);
  }
  return usable;
}

void write_point_ply(std::filesystem::path const& path, point_cloud const& points) {
  std::size_t const n = points.size();
  if (points.position.size() != 3 * n || points.color.size() != 3 * n) {
    throw invalid_argument("the points to write to " + path.string() +
                           " need three coordinates and three colours each");
  }
  std::string text = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(n) + "\n";
  for (char const* name : {"x", "y", "z"}) text += std::string("property float ") + name + "\n";
  for (char const* name : {"red", "green", "blue"}) text += std::string("property uchar ") + name + "\n";
  text += "end_header\n";
  write_file(path, [&](std::ostream& out) {
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t c = 0; c < 3; ++c) put(text, points.position[3 * i + c]);
      for (std::size_t c = 0; c < 3; ++c) text += static_cast<char>(points.color[3 * i + c]);
      drain(out, text, chunk);
    }
    drain(out, text, 0);
  });
}

}  // namespace gart
