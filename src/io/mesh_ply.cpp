// PLY of triangles.
#include "ply_body.hpp"

#include <gart/io/file.hpp>
#include <gart/io/mesh_file.hpp>

namespace gart {
namespace {

using namespace io::ply;
using io::put;

class mesh_reader {
 public:
  mesh_reader(std::filesystem::path const& path, vec3d const& origin)
      : file_(open(path)), body_(file_), origin_(origin) {}

  triangle_mesh read() {
    bool vertices = false, faces = false;
    for (element const& e : file_.head.elements) {
      u64 const smallest = e.smallest(file_.head.format);
      require_room(file_, e, body_.remaining());
      if (e.name == "vertex") {
        for (char const* name : {"x", "y", "z"})
          if (!find(e, name)) file_.refuse(std::string("property '") + name + "' is missing", "name a PLY of a mesh");
        vertices = true;
      }
      faces = faces || e.name == "face";
      for (u64 record = 0; smallest && record < e.count; ++record) read_record(e, record);
    }
    if (!vertices || !faces) file_.refuse("has no vertices, or no faces", "name a PLY of a mesh");
    for (auto const& t : mesh_.triangle)
      for (u32 const corner : t)
        if (corner >= mesh_.position.size())
          file_.refuse("a face has the corner " + std::to_string(corner) + ", and there are " +
                           std::to_string(mesh_.position.size()) + " vertices",
                       "the file is damaged: export it again");
    return std::move(mesh_);
  }

 private:
  void read_record(element const& e, u64 record) {
    vec3d at(0.0);
    for (property const& p : e.properties) {
      bool const corners = e.name == "face" && (p.name == "vertex_indices" || p.name == "vertex_index");
      if (p.list && corners)
        read_face(e, record, p);
      else if (p.list)
        body_.skip_list(e, record, p);
      else if (double const v = body_.next(p.type, e, record, p); e.name == "vertex" && p.name.size() == 1)
        for (int k = 0; k < 3; ++k)
          if (p.name[0] == "xyz"[k]) at[k] = v;
    }
    if (e.name != "vertex") return;
    vec3 const position(at - origin_);
    if (!std::isfinite(position.x + position.y + position.z))
      file_.refuse("vertex " + std::to_string(record) + " is not finite", "remove it, or export the mesh again");
    mesh_.position.push_back(position);
  }

  void read_face(element const& e, u64 record, property const& p) {
    auto const corner = [&](scalar type) {
      double const v = body_.next(type, e, record, p);
      if (!(v >= 0 && v < 4294967296.0 && v == std::floor(v)))
        file_.refuse(body_.place(e, record, p) + " is no whole number", "the file is damaged: export it again");
      return static_cast<u32>(v);
    };
    u32 const corners = corner(p.count_type);
    u32 first = 0, last = 0;
    for (u32 i = 0; i < corners; ++i) {
      u32 const now = corner(p.type);
      if (i >= 2) mesh_.triangle.push_back({first, last, now});
      (i == 0 ? first : last) = now;
    }
  }

  ply_file file_;
  body_reader body_;
  vec3d origin_;
  triangle_mesh mesh_;
};

}  // namespace

triangle_mesh read_mesh_ply(std::filesystem::path const& path, vec3d const& origin) {
  return mesh_reader(path, origin).read();
}

void write_mesh_ply(std::filesystem::path const& path, triangle_mesh const& mesh, vec3d const& origin) {
  bool const in_double = origin != vec3d(0.0);
  std::string text =
      "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(mesh.position.size()) + "\n";
  for (char const* name : {"x", "y", "z"})
    text += std::string(in_double ? "property double " : "property float ") + name + "\n";
  text +=
      "element face " + std::to_string(mesh.triangle.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
  write_file(path, [&](std::ostream& out) {
    for (vec3 const& v : mesh.position) {
      for (int k = 0; k < 3; ++k)
        in_double ? put(text, static_cast<double>(v[k]) + origin[k]) : put(text, static_cast<float>(v[k]));
      drain(out, text, chunk);
    }
    for (auto const& t : mesh.triangle) {
      put(text, u8{3});
      for (u32 const corner : t) put(text, corner);
      drain(out, text, chunk);
    }
    drain(out, text, 0);
  });
}

}  // namespace gart
