// https://github.com/colmap/colmap/blob/main/src/colmap/sensor/models.h
// https://docs.nerf.studio/quickstart/data_conventions.html

#include "camera_formats.hpp"

#include <algorithm>
#include <iterator>

namespace gart::io {
namespace {

constexpr camera_kind perspective = camera_kind::perspective;

constexpr camera_format formats[] = {
    {0, "SIMPLE_PINHOLE", "f cx cy", perspective},
    {1, "PINHOLE", "fx fy cx cy", perspective},
    {2, "SIMPLE_RADIAL", "f cx cy k1", perspective},
    {3, "RADIAL", "f cx cy k1 k2", perspective},
    {4, "OPENCV", "fx fy cx cy k1 k2 p1 p2", perspective},
    {5, "OPENCV_FISHEYE", "fx fy cx cy k1 k2 k3 k4", {}},
    {6, "FULL_OPENCV", "fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6", {}},
    {7, "FOV", "fx fy cx cy omega", {}},
    {8, "SIMPLE_RADIAL_FISHEYE", "f cx cy k1", {}},
    {9, "RADIAL_FISHEYE", "f cx cy k1 k2", {}},
    {10, "THIN_PRISM_FISHEYE", "fx fy cx cy k1 k2 p1 p2 k3 k4 sx1 sy1", {}},
    {11, "RAD_TAN_THIN_PRISM_FISHEYE", "fx fy cx cy k0 k1 k2 k3 k4 k5 p0 p1 s0 s1 s2 s3", {}},
    {12, "SIMPLE_DIVISION", "f cx cy k1", {}},
    {13, "DIVISION", "fx fy cx cy k1", {}},
    {14, "SIMPLE_FISHEYE", "f cx cy", {}},
    {15, "FISHEYE", "fx fy cx cy", {}},
    {16, "EUCM", "fx fy cx cy alpha beta", {}},
    {17, "EQUIRECTANGULAR", "width height", {}},
    {-1, "PERSPECTIVE", "fx fy cx cy k1 k2 p1 p2", perspective},
};

template <class F>
camera_format const* find(F&& f) {
  auto const* const found = std::find_if(std::begin(formats), std::end(formats), f);
  return found == std::end(formats) ? nullptr : found;
}

}  // namespace

int camera_format::parameters() const { return 1 + static_cast<int>(std::count(fields.begin(), fields.end(), ' ')); }

std::string_view camera_format::field(int place) const {
  std::string_view rest = fields;
  for (; place > 0; --place) rest.remove_prefix(rest.find(' ') + 1);
  return rest.substr(0, rest.find(' '));
}

bool camera_format::has(std::string_view wanted) const {
  for (int k = 0; k < parameters(); ++k)
    if (field(k) == wanted) return true;
  return false;
}

camera_format const* camera_format_of(int number) {
  return number < 0 ? nullptr : find([&](camera_format const& f) { return f.number == number; });
}

camera_format const* camera_format_of(std::string_view name) {
  return find([&](camera_format const& f) { return f.name == name; });
}

std::string traced_camera_formats() {
  std::string out;
  auto const traced = [](camera_format const& f) { return f.kind && f.number >= 0; };
  auto left = std::count_if(std::begin(formats), std::end(formats), traced);
  for (camera_format const& f : formats) {
    if (!traced(f)) continue;
    out += f.name;
    --left;
    out += left > 1 ? ", " : left == 1 ? " and " : "";
  }
  return out;
}

void set_field(camera& c, std::string_view field, double value) {
  float const v = static_cast<float>(value);
  if (field == "f") c.fx = c.fy = v;
  struct {
    std::string_view name;
    float* at;
  } const fields[] = {{"fx", &c.fx},      {"fy", &c.fy},      {"cx", &c.cx},      {"cy", &c.cy},
                      {"k1", &c.lens.k1}, {"k2", &c.lens.k2}, {"p1", &c.lens.p1}, {"p2", &c.lens.p2}};
  for (auto const& f : fields)
    if (f.name == field) *f.at = v;
}

}  // namespace gart::io
