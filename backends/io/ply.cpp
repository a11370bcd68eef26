// PLY, read by property name whatever the order, encoding and types; written in the INRIA layout.
// http://paulbourke.net/dataformats/ply/

#include "bytes.hpp"
#include "ply_header.hpp"

#include <gart/core/error.hpp>
#include <gart/io/file.hpp>
#include <gart/io/ply.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <ostream>
#include <string_view>

namespace gart {
namespace {

using namespace io::ply;
using io::next_word;
using io::parse_number;
using io::put;

// The values of the body one after the other, whatever their encoding.
class body_reader {
 public:
  explicit body_reader(ply_file const& file)
      : file_(file),
        text_(reinterpret_cast<char const*>(file.bytes.data()) + file.head.size, file.bytes.size() - file.head.size) {}

  u64 remaining() const { return text_.size(); }

  double next(scalar type, element const& e, u64 record, property const& p) {
    return file_.head.format == encoding::ascii ? next_ascii(e, record, p) : next_binary(type, e, record, p);
  }

  void skip_list(element const& e, u64 record, property const& p) {
    double const n = next(p.count_type, e, record, p);
    if (!(n >= 0 && n <= std::numeric_limits<u32>::max() && n == std::floor(n)))
      file_.refuse(place(e, record, p) + " is a list whose length is not a count",
                   "the file is damaged: export it again");
    u64 const count = static_cast<u64>(n);
    if (file_.head.format == encoding::ascii) {
      for (u64 i = 0; i < count; ++i) next_ascii(e, record, p);
    } else {
      if (count > remaining() / scalar_size(p.type)) truncated(e, record, p);
      text_.remove_prefix(count * scalar_size(p.type));
    }
  }

  std::string place(element const& e, u64 record, property const& p) const {
    return e.name + " " + std::to_string(file_.owners.global(static_cast<index_t>(record))) + ", property " + p.name;
  }

 private:
  [[noreturn]] void truncated(element const& e, u64 record, property const& p) const {
    file_.refuse("ends at " + place(e, record, p), "the file is truncated: copy or export it again");
  }

  double next_ascii(element const& e, u64 record, property const& p) {
    std::string_view const word = next_word(text_);
    if (word.empty()) truncated(e, record, p);
    double value = 0;
    if (!parse_number(word, value)) {
      file_.refuse(place(e, record, p) + " is '" + std::string(word.substr(0, 40)) + "', not a number in range",
                   "correct the value");
    }
    return value;
  }

  template <class T>
  double take(bool swap) {
    std::array<char, sizeof(T)> raw;
    std::copy_n(text_.data(), sizeof(T), raw.data());
    if (swap) std::reverse(raw.begin(), raw.end());
    text_.remove_prefix(sizeof(T));
    return static_cast<double>(std::bit_cast<T>(raw));
  }

  double next_binary(scalar type, element const& e, u64 record, property const& p) {
    if (remaining() < scalar_size(type)) truncated(e, record, p);
    bool const swap = file_.head.format == encoding::big;
    switch (type) {
      case scalar::i8:
        return take<std::int8_t>(swap);
      case scalar::u8:
        return take<u8>(swap);
      case scalar::i16:
        return take<std::int16_t>(swap);
      case scalar::u16:
        return take<u16>(swap);
      case scalar::i32:
        return take<std::int32_t>(swap);
      case scalar::u32:
        return take<u32>(swap);
      case scalar::f32:
        return take<float>(swap);
      case scalar::f64:
        return take<double>(swap);
    }
    return 0;
  }

  ply_file const& file_;
  std::string_view text_;
};

element const& vertices(ply_file const& file) {
  for (element const& e : file.head.elements) {
    if (e.name == "vertex") return e;
  }
  file.refuse("the header has no 'element vertex'", "name a PLY of points or Gaussians");
}

property const* find(element const& e, std::string_view name) {
  for (property const& p : e.properties) {
    if (p.name == name && !p.list) return &p;
  }
  return nullptr;
}

// Where a property's value goes: store(column, vertex, value). The values are finite floats.
template <class Store>
void read_vertices(ply_file const& file, std::vector<std::string> const& columns, Store const& store) {
  body_reader body(file);
  for (element const& e : file.head.elements) {
    bool const wanted = e.name == "vertex";
    u64 const smallest = e.smallest(file.head.format);
    if (!smallest && !wanted) continue;
    // The last ascii value needs no separator.
    if (e.count > (body.remaining() + 1) / smallest) {
      file.refuse("the header promises " + std::to_string(e.count) + " of '" + e.name + "', more than the " +
                      std::to_string(body.remaining()) + " bytes that follow can hold",
                  "the file is truncated: copy or export it again");
    }
    std::vector<int> column_of(e.properties.size(), -1);
    for (std::size_t i = 0; wanted && i < e.properties.size(); ++i) {
      auto const found = std::find(columns.begin(), columns.end(), e.properties[i].name);
      if (found != columns.end() && !e.properties[i].list) column_of[i] = static_cast<int>(found - columns.begin());
    }
    if (wanted) store.resize(static_cast<std::size_t>(e.count));
    for (u64 record = 0; record < e.count; ++record) {
      for (std::size_t i = 0; i < e.properties.size(); ++i) {
        property const& p = e.properties[i];
        if (p.list) {
          body.skip_list(e, record, p);
          continue;
        }
        double const value = body.next(p.type, e, record, p);
        if (column_of[i] < 0) continue;
        if (!std::isfinite(static_cast<float>(value))) {
          file.refuse(
              body.place(e, record, p) + (std::isnan(value) ? " is NaN" : " is infinite or too large for a float"),
              "remove or correct that vertex");
        }
        store(static_cast<std::size_t>(column_of[i]), static_cast<std::size_t>(record), value);
      }
    }
    if (wanted) return;
  }
}

void require_columns(ply_file const& file, element const& e, std::vector<std::string> const& columns,
                     char const* remedy) {
  for (std::string const& name : columns) {
    if (!find(e, name)) file.refuse("property '" + name + "' is missing", remedy);
  }
}

// INRIA's order; without the normals where `read`, since nothing uses them.
std::vector<std::string> splat_columns(int degree, bool normals) {
  std::vector<std::string> names{"x", "y", "z"};
  if (normals) names.insert(names.end(), {"nx", "ny", "nz"});
  auto const numbered = [&](char const* stem, int n) {
    for (int i = 0; i < n; ++i) names.push_back(stem + std::to_string(i));
  };
  numbered("f_dc_", 3);
  numbered("f_rest_", 3 * (sh_coefficients(degree) - 1));
  names.push_back("opacity");
  numbered("scale_", 3);
  numbered("rot_", 4);
  return names;
}

// Puts column c of vertex i, in the order of splat_columns(degree, false), into its array.
struct splat_store {
  gaussian_model& model;

  void resize(std::size_t n) const { model.resize(n, model.sh_degree); }
  void operator()(std::size_t c, std::size_t i, double value) const {
    float const v = static_cast<float>(value);
    std::size_t const k = static_cast<std::size_t>(sh_coefficients(model.sh_degree)), rest = k - 1;
    if (c < 3) {
      model.mean[3 * i + c] = v;
      return;
    }
    c -= 3;
    if (c < 3) {
      model.sh[3 * k * i + c] = v;
      return;
    }
    c -= 3;
    if (c < 3 * rest) {
      model.sh[3 * (k * i + 1 + c % rest) + c / rest] = v;
      return;
    }
    c -= 3 * rest;
    if (c == 0) {
      model.opacity[i] = v;
      return;
    }
    c -= 1;
    if (c < 3) {
      model.log_scale[3 * i + c] = v;
      return;
    }
    model.quaternion[4 * i + c - 3] = v;
  }
};

// Colours are bytes, 16-bit integers, or floats in [0, 1].
struct point_store {
  point_cloud& points;
  std::array<scalar, 3> color_type;

  void resize(std::size_t n) const { points.position.resize(3 * n), points.color.assign(3 * n, 128); }
  void operator()(std::size_t c, std::size_t i, double value) const {
    if (c < 3) {
      points.position[3 * i + c] = static_cast<float>(value);
      return;
    }
    scalar const type = color_type[c - 3];
    double const scale = type == scalar::f32 || type == scalar::f64 ? 255.0 : type == scalar::u16 ? 1.0 / 257.0 : 1.0;
    points.color[3 * i + c - 3] = static_cast<u8>(std::clamp(value * scale + 0.5, 0.0, 255.0));
  }
};

// Hands the text to the stream now and then, so that it stays small.
void drain(std::ostream& out, std::string& text, std::size_t limit) {
  if (text.size() < limit) return;
  out.write(text.data(), static_cast<std::streamsize>(text.size()));
  text.clear();
}

constexpr std::size_t chunk = std::size_t{1} << 20;

}  // namespace

namespace {

gaussian_model splats_of(ply_file const& file) {
  element const& e = vertices(file);
  if (!find(e, "f_dc_0") && (find(e, "red") || !find(e, "opacity"))) {
    file.refuse("property 'f_dc_0' is missing: these are points, not Gaussians", "name the model.ply of a training");
  }
  if (find(e, "scale_0") && find(e, "scale_1") && !find(e, "scale_2")) {
    file.refuse("property 'scale_2' is missing: these are 2D Gaussians",
                "gart renders 3D Gaussians: train or convert a 3D model");
  }
  auto const rest = std::count_if(e.properties.begin(), e.properties.end(),
                                  [](property const& p) { return p.name.rfind("f_rest_", 0) == 0; });
  gaussian_model model;
  while (model.sh_degree < 4 && 3 * (sh_coefficients(model.sh_degree) - 1) != rest) ++model.sh_degree;
  if (model.sh_degree > 3) {
    file.refuse("there are " + std::to_string(rest) + " properties f_rest_*, not 0, 9, 24 or 45",
                "gart reads spherical harmonics of degree 0 to 3: export the model with one of them");
  }
  std::vector<std::string> const columns = splat_columns(model.sh_degree, false);
  require_columns(file, e, columns, "export the model with every property of the INRIA layout");
  read_vertices(file, columns, splat_store{model});
  for (std::size_t i = 0; i < model.size(); ++i) {
    float const* q = model.quaternion.data() + 4 * i;
    if (q[0] == 0 && q[1] == 0 && q[2] == 0 && q[3] == 0) {
      file.refuse("vertex " + std::to_string(file.owners.global(static_cast<index_t>(i))) +
                      ", properties rot_0 to rot_3 are all zero, which is no rotation",
                  "remove that vertex");
    }
  }
  return model;
}

std::string header_of(std::filesystem::path const& path, int sh_degree, u64 count, splat_traits const& traits) {
  std::string text = header_start(path, traits);
  text += "element vertex " + std::to_string(count) + "\n";
  for (std::string const& name : splat_columns(sh_degree, true)) text += "property float " + name + "\n";
  return text + "end_header\n";
}

// Gaussian i, as a vertex.
void put_vertex(std::string& text, gaussian_model const& model, std::size_t i) {
  std::size_t const k = static_cast<std::size_t>(sh_coefficients(model.sh_degree));
  for (std::size_t c = 0; c < 3; ++c) put(text, model.mean[3 * i + c]);
  for (int c = 0; c < 3; ++c) put(text, 0.0f);
  float const* sh = model.sh.data() + 3 * k * i;
  for (std::size_t c = 0; c < 3; ++c) put(text, sh[c]);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t j = 1; j < k; ++j) put(text, sh[3 * j + c]);
  }
  put(text, model.opacity[i]);
  for (std::size_t c = 0; c < 3; ++c) put(text, model.log_scale[3 * i + c]);
  for (std::size_t c = 0; c < 4; ++c) put(text, model.quaternion[4 * i + c]);
}

void require_agreement(std::filesystem::path const& path, gaussian_model const& model) {
  if (model.sh_degree < 0 || model.sh_degree > 3 || !model.arrays_agree())
    throw invalid_argument("the arrays of the model to write to " + path.string() + " do not agree in size");
}

}  // namespace

gaussian_model read_splat_ply(std::filesystem::path const& path, splat_traits* traits) {
  ply_file const file = open(path);
  gaussian_model model = splats_of(file);
  if (traits) *traits = file.head.traits;
  return model;
}

gaussian_model read_splat_ply_rows(std::filesystem::path const& path, row_owners const& owners, u64& total,
                                   splat_traits* traits) {
  ply_file const file = open_rows(path, owners, total);
  gaussian_model model = splats_of(file);
  if (traits) *traits = file.head.traits;
  return file.owners.ranks == owners.ranks ? model : rows_of(model, owners);
}

void write_splat_ply(std::filesystem::path const& path, gaussian_model const& model, splat_traits const& traits) {
  require_agreement(path, model);
  std::string text = header_of(path, model.sh_degree, model.size(), traits);
  write_file(path, [&](std::ostream& out) {
    for (std::size_t i = 0; i < model.size(); ++i) {
      put_vertex(text, model, i);
      drain(out, text, chunk);
    }
    drain(out, text, 0);
  });
}

void write_splat_ply_rows(shared_file& file, std::filesystem::path const& path, gaussian_model const& mine,
                          row_owners const& owners, u64 total, splat_traits const& traits) {
  require_agreement(path, mine);
  std::string const head = header_of(path, mine.sh_degree, total, traits);
  u64 const record = sizeof(float) * splat_columns(mine.sh_degree, true).size();
  if (owners.rank == 0) file.write(0, head.data(), head.size());
  std::string text;
  owners.for_each_run(total, [&](u64 first, u64 count, u64 row) {
    u64 at = head.size() + first * record;
    for (u64 i = 0; i < count; ++i) {
      put_vertex(text, mine, row + i);
      if (text.size() < chunk && i + 1 < count) continue;
      file.write(at, text.data(), text.size());
      at += text.size();
      text.clear();
    }
  });
}

point_cloud read_point_ply(std::filesystem::path const& path) {
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
  read_vertices(file, columns, store);
  return points;
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

extern splat_format const ply_format;
splat_format const ply_format = {
    "PLY",
    ".ply",
    {.traits = true, .kernel = true},
    [](std::string_view first) { return first.starts_with("ply\n") || first.starts_with("ply\r"); },
    read_splat_ply,
    [](std::filesystem::path const& path, gaussian_model const& model, splat_traits const& traits,
       splat_packing const&) { write_splat_ply(path, model, traits); }};

}  // namespace gart
