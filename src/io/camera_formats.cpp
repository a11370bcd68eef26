// https://github.com/colmap/colmap/blob/main/src/colmap/sensor/models.h
// https://docs.nerf.studio/quickstart/data_conventions.html

#include "camera_formats.hpp"

#include <gart/core/error.hpp>

#include <algorithm>
#include <iterator>

namespace gart::io {
namespace {

using kind = camera_kind;

// Of the names of one kind the writer takes the first that says all, so short ones come first.
constexpr camera_format formats[] = {
    {0, "SIMPLE_PINHOLE", "f cx cy", kind::perspective},
    {1, "PINHOLE", "fx fy cx cy", kind::perspective},
    {2, "SIMPLE_RADIAL", "f cx cy k1", kind::perspective},
    {3, "RADIAL", "f cx cy k1 k2", kind::perspective},
    {4, "OPENCV", "fx fy cx cy k1 k2 p1 p2", kind::perspective},
    {14, "SIMPLE_FISHEYE", "f cx cy", kind::fisheye},
    {15, "FISHEYE", "fx fy cx cy", kind::fisheye},
    {5, "OPENCV_FISHEYE", "fx fy cx cy k1 k2 k3 k4", kind::fisheye},
    {6, "FULL_OPENCV", "fx fy cx cy k1 k2 p1 p2 k3 k4=d1 k5=d2 k6=d3", kind::perspective},
    {7, "FOV", "fx fy cx cy omega", kind::fov},
    {8, "SIMPLE_RADIAL_FISHEYE", "f cx cy k=k1", kind::fisheye},
    {9, "RADIAL_FISHEYE", "f cx cy k1 k2", kind::fisheye},
    {10, "THIN_PRISM_FISHEYE", "fx fy cx cy k1 k2 p1 p2 k3 k4 sx1=s1 sy1=s3", kind::fisheye},
    {11, "RAD_TAN_THIN_PRISM_FISHEYE",
     "fx fy cx cy k0=k1 k1=k2 k2=k3 k3=k4 k4=k5 k5=k6 p0=p2 p1 s0=s1 s1=s2 s2=s3 s3=s4", kind::fisheye624},
    {12, "SIMPLE_DIVISION", "f cx cy k=k1", kind::division},
    {13, "DIVISION", "fx fy cx cy k=k1", kind::division},
    {16, "EUCM", "fx fy cx cy alpha beta", kind::eucm},
    {17, "EQUIRECTANGULAR", "width height", kind::equirectangular},
    {-1, "ORTHOPHOTO", "fx fy cx cy", kind::orthographic},
    {-1, "ORTHOGRAPHIC", "fx fy cx cy", kind::orthographic},
    {-1, "PERSPECTIVE", "fx fy cx cy k1 k2 p1 p2 k3 k4", kind::perspective},
};

template <class F>
camera_format const* find(F&& f) {
  auto const* const found = std::find_if(std::begin(formats), std::end(formats), f);
  return found == std::end(formats) ? nullptr : found;
}

}  // namespace

int camera_format::parameters() const { return 1 + static_cast<int>(std::count(fields.begin(), fields.end(), ' ')); }

namespace {
std::string_view word(std::string_view rest, int place) {
  for (; place > 0; --place) rest.remove_prefix(rest.find(' ') + 1);
  return rest.substr(0, rest.find(' '));
}
}  // namespace

std::string_view camera_format::field(int place) const {
  std::string_view const both = word(fields, place);
  return both.substr(0, both.find('='));
}

std::string_view camera_format::member(int place) const {
  std::string_view const both = word(fields, place);
  return both.find('=') == both.npos ? both : both.substr(both.find('=') + 1);
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
  // Programs write them in small letters too.
  auto const same = [](char a, char b) { return a == (b >= 'a' && b <= 'z' ? b - 'a' + 'A' : b); };
  return find(
      [&](camera_format const& f) { return std::equal(f.name.begin(), f.name.end(), name.begin(), name.end(), same); });
}

std::string traced_camera_formats() {
  std::string out;
  auto const traced = [](camera_format const& f) { return f.kind && (f.number >= 0 || f.kind != kind::perspective); };
  auto left = std::count_if(std::begin(formats), std::end(formats), traced);
  for (camera_format const& f : formats) {
    if (!traced(f)) continue;
    out += f.name;
    --left;
    out += left > 1 ? ", " : left == 1 ? " and " : "";
  }
  return out;
}

namespace {
struct member {
  std::string_view name;
  float camera::*own;
  float distortion::*of_lens;
};
constexpr member members[] = {
    {"fx", &camera::fx, nullptr},           {"fy", &camera::fy, nullptr},
    {"cx", &camera::cx, nullptr},           {"cy", &camera::cy, nullptr},
    {"k1", nullptr, &distortion::k1},       {"k2", nullptr, &distortion::k2},
    {"k3", nullptr, &distortion::k3},       {"k4", nullptr, &distortion::k4},
    {"k5", nullptr, &distortion::k5},       {"k6", nullptr, &distortion::k6},
    {"p1", nullptr, &distortion::p1},       {"p2", nullptr, &distortion::p2},
    {"d1", nullptr, &distortion::d1},       {"d2", nullptr, &distortion::d2},
    {"d3", nullptr, &distortion::d3},       {"s1", nullptr, &distortion::s1},
    {"s2", nullptr, &distortion::s2},       {"s3", nullptr, &distortion::s3},
    {"s4", nullptr, &distortion::s4},       {"omega", nullptr, &distortion::omega},
    {"alpha", nullptr, &distortion::alpha}, {"beta", nullptr, &distortion::beta},
};
}  // namespace

void set_member(camera& c, std::string_view name, double value) {
  float const v = static_cast<float>(value);
  if (name == "f") c.fx = c.fy = v;
  for (member const& m : members)
    if (m.name == name) (m.own ? c.*m.own : c.lens.*m.of_lens) = v;
}

float member_of(camera const& c, std::string_view name) {
  if (name == "f") return c.fx;
  for (member const& m : members)
    if (m.name == name) return m.own ? c.*m.own : c.lens.*m.of_lens;
  return 0;
}

bool is_pinhole_member(std::string_view name) {
  return name == "f" || name == "fx" || name == "fy" || name == "cx" || name == "cy";
}

camera_format const& camera_format_for(camera const& c) {
  camera const plain;
  for (camera_format const& f : formats) {
    if (f.kind != c.kind || f.fields.substr(0, 2) == "f ") continue;
    bool whole = true;
    for (member const& m : members) {
      bool said = m.own != nullptr || member_of(c, m.name) == plain.lens.*m.of_lens;
      for (int k = 0; k < f.parameters(); ++k) said = said || f.member(k) == m.name;
      whole = whole && said;
    }
    if (whole) return f;
  }
  throw unsupported("no camera model of files has all the parameters of this camera's lens");
}

}  // namespace gart::io
