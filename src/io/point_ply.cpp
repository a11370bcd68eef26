// PLY of points.
#include "capture.hpp"
#include "ply_body.hpp"

#include <gart/io/file.hpp>
#include <gart/io/ply.hpp>

namespace gart {
namespace {

using namespace io::ply;
using io::put;

// Colours are bytes, 16-bit integers, or floats in [0, 1].
struct point_store {
  io::exact_points& points;
  std::array<scalar, 3> color_type;

  double settled(std::size_t, double value) const { return value; }
  void resize(std::size_t n) const { points.position.resize(3 * n), points.color.assign(3 * n, 128); }
  void operator()(std::size_t c, std::size_t i, double value) const {
    if (c < 3) {
      points.position[3 * i + c] = value;
      return;
    }
    scalar const type = color_type[c - 3];
    double const scale = type == scalar::f32 || type == scalar::f64 ? 255.0 : type == scalar::u16 ? 1.0 / 257.0 : 1.0;
    if (std::isfinite(value))
      points.color[3 * i + c - 3] = static_cast<u8>(std::clamp(value * scale + 0.5, 0.0, 255.0));
  }
};

}  // namespace

io::exact_points io::read_exact_points(std::filesystem::path const& path, std::vector<std::string>* notes) {
  ply_file const file = open(path);
  element const& e = vertices(file);
  std::vector<std::string> columns{"x", "y", "z"};
  require_columns(file, e, columns, "export points with x, y and z");
  property const* const color[] = {find(e, "red"), find(e, "green"), find(e, "blue")};
  exact_points points;
  point_store store{points, {}};
  if (color[0] && color[1] && color[2]) {
    columns.insert(columns.end(), {"red", "green", "blue"});
    for (std::size_t c = 0; c < 3; ++c) store.color_type[c] = color[c]->type;
  }
  unusable bad;
  read_vertices(file, columns, store, bad);
  if (bad.records().empty()) return points;
  exact_points usable;
  for (std::size_t const i : bad.others(points.size(), "point", file.name, notes)) {
    usable.position.insert(usable.position.end(), &points.position[3 * i], &points.position[3 * i] + 3);
    usable.color.insert(usable.color.end(), &points.color[3 * i], &points.color[3 * i] + 3);
  }
  return usable;
}

point_cloud read_point_ply(std::filesystem::path const& path, std::vector<std::string>* notes) {
  io::exact_points const points = io::read_exact_points(path, notes);
  return {{points.position.begin(), points.position.end()}, points.color};
}

void write_point_ply(std::filesystem::path const& path, point_cloud const& points, vec3d const& origin) {
  std::size_t const n = points.size();
  if (points.position.size() != 3 * n || points.color.size() != 3 * n) {
    throw invalid_argument("the points to write to " + path.string() +
                           " need three coordinates and three colours each");
  }
  std::string text = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(n) + "\n";
  bool const in_double = origin != vec3d(0.0);
  for (char const* name : {"x", "y", "z"})
    text += std::string(in_double ? "property double " : "property float ") + name + "\n";
  for (char const* name : {"red", "green", "blue"}) text += std::string("property uchar ") + name + "\n";
  text += "end_header\n";
  write_file(path, [&](std::ostream& out) {
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        float const v = points.position[3 * i + c];
        in_double ? put(text, static_cast<double>(v) + origin[static_cast<int>(c)]) : put(text, v);
      }
      for (std::size_t c = 0; c < 3; ++c) text += static_cast<char>(points.color[3 * i + c]);
      drain(out, text, chunk);
    }
    drain(out, text, 0);
  });
}

}  // namespace gart
