// Scenes: what a glTF, an OBJ, a PLY and scene.json say is what is there, placed by hand; what is wrong is named.
#include "support.hpp"

#include <gart/io/exr_file.hpp>
#include <gart/io/mesh_file.hpp>
#include <gart/io/scene_file.hpp>

#include <cmath>

using namespace gart_test;

namespace {

// A triangle as text: positions, normals, uvs, 16-bit indices.
std::string triangle_bytes() {
  std::string bytes;
  for (float const v : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f}) append(bytes, v);
  for (int i = 0; i < 3; ++i)
    for (float const v : {0.f, 0.f, 1.f}) append(bytes, v);
  for (float const v : {0.f, 0.f, 1.f, 0.f, 0.f, 1.f}) append(bytes, v);
  for (gart::u16 const v : {0, 1, 2, 0}) append(bytes, v);
  return bytes;
}

std::string with(std::string text, std::string const& from, std::string const& to) {
  auto const at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

// `more` goes to the top, `node` to the node of the mesh.
std::string gltf(std::string const& node = "", std::string const& more = "", std::string const& material = "{}") {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0)" + node + R"(}],
"buffers":[{"byteLength":104,"uri":"a%20b.bin"}],
"bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":36},
{"buffer":0,"byteOffset":72,"byteLength":24},{"buffer":0,"byteOffset":96,"byteLength":6}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
{"bufferView":1,"componentType":5126,"count":3,"type":"VEC3"},
{"bufferView":2,"componentType":5126,"count":3,"type":"VEC2"},
{"bufferView":3,"componentType":5123,"count":3,"type":"SCALAR"}],
"materials":[)" +
         material + R"(],"meshes":[{"name":"one","primitives":[{"attributes":{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2},
"indices":3,"material":0}]}])" +
         more + "}";
}

bool near(gart::vec3 const& a, gart::vec3 const& b) {
  gart::vec3 const d = a - b;
  return std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z) < 1e-5f;
}

gart::vec3 face_of(gart::light::mesh const& m, std::size_t t) {
  gart::vec3 const a = m.positions[m.triangles[3 * t]], u = m.positions[m.triangles[3 * t + 1]] - a,
                   v = m.positions[m.triangles[3 * t + 2]] - a;
  return {u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x};
}

std::string refusal(fs::path const& path) {
  std::string const what = error_of([&] { gart::read_scene(path); });
  CHECK_MESSAGE(!what.empty(), "accepted ", path.string());
  return what;
}

}  // namespace

TEST_CASE("a glTF's triangle is where its nodes place it") {
  scratch_folder const folder;
  folder.put("a b.bin", triangle_bytes());
  auto const read = [&](std::string const& text) { return gart::read_scene(folder.put("a.gltf", text)); };
  gart::light::mesh const plain = read(gltf()).scene.meshes.at(0);
  CHECK(plain.name == "one");
  CHECK(near(plain.positions[1], {-1, 0, 0}));
  CHECK(near(plain.positions[2], {0, -1, 0}));
  CHECK(near(plain.normals[0], {0, 0, 1}));
  CHECK(plain.uvs[1] == gart::vec2(1, 0));
  CHECK(face_of(plain, 0).z > 0.9f);

  // Half a turn about x, then scaled unevenly and moved: (x, y, z) -> (2x + 1, -y, -z + 3) of glTF's axes.
  auto const moved = read(gltf(R"(,"translation":[1,0,3],"rotation":[1,0,0,0],"scale":[2,1,1])")).scene.meshes.at(0);
  CHECK(near(moved.positions[1], {-3, 0, 3}));
  CHECK(near(moved.positions[2], {-1, 1, 3}));
  CHECK(near(moved.normals[2], {0, 0, -1}));
  CHECK(face_of(moved, 0).z < 0);

  // A mirrored one keeps its outside.
  auto const mirrored = read(gltf(R"(,"matrix":[-1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1])")).scene.meshes.at(0);
  CHECK(near(mirrored.positions[1], {1, 0, 0}));
  CHECK(near(mirrored.normals[0], {0, 0, 1}));
  CHECK(face_of(mirrored, 0).z > 0);
}

TEST_CASE("materials, textures, lights and cameras of a glTF") {
  scratch_folder const folder;
  folder.put("a b.bin", triangle_bytes());
  folder.put_image("red.png", 2, 2, 4, 128);
  auto const read = [&](std::string const& material, std::string const& node = "", std::string const& more = "") {
    return gart::read_scene(folder.put("a.gltf", gltf(node, more, material)));
  };
  std::string const textures =
      R"(,"images":[{"uri":"red.png"}],"samplers":[{"wrapS":33071}],"textures":[{"source":0,"sampler":0}])";
  auto const scene =
      read(R"({"name":"paint","pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,1,0.5],"metallicFactor":0,
"roughnessFactor":0.3,"baseColorTexture":{"index":0},"metallicRoughnessTexture":{"index":0}},
"emissiveFactor":[1,0,0],"extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":4}}})",
           "", textures)
          .scene;
  gart::light::material const& m = scene.materials.at(scene.meshes[0].triangle_material[0]);
  CHECK(m.name == "paint");
  CHECK(m.base_color.y == 0.25f);
  CHECK(m.roughness == 0.3f);
  CHECK(m.emission.x == 4);
  CHECK(m.opacity == 1);
  gart::light::texture const &colour = scene.textures.at(static_cast<std::size_t>(m.base_color_texture)),
                             &rough = scene.textures.at(static_cast<std::size_t>(m.metallic_roughness_texture));
  CHECK(colour.texels[0] == doctest::Approx(0.21586).epsilon(1e-4));  // sRGB 128
  CHECK(rough.texels[0] == doctest::Approx(128.0 / 255));
  CHECK(colour.texels[3] == 1);  // opaque, whatever the image says
  CHECK_FALSE(colour.repeat_u);
  CHECK(colour.repeat_v);

  auto const glass = read(R"({"extensions":{"KHR_materials_transmission":{"transmissionFactor":1},
"KHR_materials_ior":{"ior":1.33}}})")
                         .scene.materials[0];
  CHECK(glass.kind == gart::light::material_kind::dielectric);
  CHECK(glass.ior == 1.33f);

  auto const lit = read("{}", R"(,"camera":0,"translation":[1,2,3],"extensions":{"KHR_lights_punctual":{"light":0}})",
                        R"(,"cameras":[{"type":"perspective","perspective":{"yfov":1.5707963,"aspectRatio":2}}],
"extensions":{"KHR_lights_punctual":{"lights":[{"type":"directional","color":[1,0.5,0],"intensity":2}]}})");
  REQUIRE(lit.scene.lights.size() == 1);
  CHECK(near(lit.scene.lights[0].color, {2, 1, 0}));
  CHECK(near(lit.scene.lights[0].direction, {0, 0, -1}));
  REQUIRE(lit.cameras.size() == 1);
  gart::camera const& view = lit.cameras[0].view;
  CHECK(view.width == 1440);
  CHECK(view.fx == doctest::Approx(360));
  CHECK(near(gart::vec3(view.position), {-1, -2, 3}));
  CHECK(near(view.rotation[2], {0, 0, -1}));  // looks along -z
  CHECK(near(view.rotation[1], {0, 1, 0}));   // down is y, which is glTF's -y
}

TEST_CASE("a glTF that cannot be is refused by its field") {
  scratch_folder const folder;
  folder.put("a b.bin", triangle_bytes());
  auto const why = [&](std::string const& text) { return refusal(folder.put("a.gltf", text)); };
  CHECK(holds(why(with(gltf(), "a%20b.bin", "gone.bin")), "'gone.bin', which is not there"));
  CHECK(holds(why(with(gltf(), "a%20b.bin", "https://x.org/b.bin")), "download it"));
  CHECK(holds(why(with(gltf(), "\"count\":3", "\"count\":3000000000")), "more than the file has bytes"));
  CHECK(holds(why(with(gltf(), "\"count\":3", "\"count\":4")), "is not 4 VEC3 of a buffer"));
  CHECK(holds(why(with(gltf(), "\"indices\":3", "\"indices\":9")), "a.gltf"));
  CHECK(holds(why(with(gltf(), "\"material\":0", "\"material\":7")), "'material' is 7"));
  // Numbers are not cut to fit, and a wrong type is not the default.
  CHECK(holds(why(with(gltf(), "\"mesh\":0", "\"mesh\":4294967296")), "4294967296 is out of range"));
  CHECK(holds(why(with(gltf(), "\"indices\":3", "\"indices\":\"3\"")), "must be number, but is string"));
  CHECK(holds(why(gltf(R"(,"translation":[1,"0",2])")), "must be number, but is string"));
  CHECK(
      holds(why(gltf("", "", R"({"pbrMetallicRoughness":{"metallicFactor":"1"}})")), "must be number, but is string"));
  CHECK(holds(why(gltf(R"(,"children":[0])")), "is below two others, or itself"));
  CHECK(holds(why(gltf(R"(,"rotation":[0,0,0,0])")), "node 0: 'rotation' is all zero"));
  CHECK(holds(why(gltf("", R"(,"extensionsRequired":["KHR_draco_mesh_compression"])")), "KHR_draco_mesh_compression"));
  CHECK(holds(why(gltf("", "", R"({"pbrMetallicRoughness":{"metallicFactor":2}})")), "'metallicFactor'"));
  CHECK(holds(
      why(gltf("", R"(,"images":[{"uri":"no.png"}],"textures":[{"source":0}])", R"({"normalTexture":{"index":0}})")),
      "image 0 of material 0, 'normalTexture' is in 'no.png', which is not there"));

  std::string broken = triangle_bytes();
  float const nan = std::nanf("");
  std::memcpy(broken.data() + 4, &nan, 4);
  folder.put("a b.bin", broken);
  CHECK(holds(why(gltf()), "1 triangle of"));
  folder.put("a b.bin", triangle_bytes().substr(0, 90));
  CHECK(holds(why(gltf()), "reaches past the end"));
  folder.put("a b.bin", triangle_bytes() + "more");  // may be longer than "byteLength"
  CHECK(gart::read_scene(folder.put("a.gltf", gltf())).scene.meshes.size() == 1);
}

TEST_CASE("an OBJ has its faces, its groups and its materials") {
  scratch_folder const folder;
  folder.put_image("wood.png", 2, 2, 3, 255);
  folder.put("a.mtl", "newmtl paint\nKd 0.1 0.2 0.3\nPr 0.4\nmap_Kd wood.png\nnewmtl glass\nillum 4\nNi 1.3\nd 0.2\n");
  std::string const text =
      "# a square and a triangle\nmtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n"
      "o square\nusemtl paint\nf 1/1/1 2/1/1 3/1/1 4/1/1\ng tri angle\nusemtl glass\nf -4 -3 -2\nf 1 1 2\nl 1 2\n";
  auto const file = gart::read_scene(folder.put("a.obj", text));
  REQUIRE(file.scene.meshes.size() == 2);
  auto const &square = file.scene.meshes[0], &one = file.scene.meshes[1];
  CHECK(square.name == "square");
  CHECK(square.triangles == std::vector<gart::u32>{0, 1, 2, 0, 2, 3});
  CHECK(square.normals.size() == 4);
  CHECK(square.uvs[0] == gart::vec2(0, 1));  // v goes down
  CHECK(one.name == "tri angle");
  CHECK(one.normals.empty());
  CHECK(one.triangles.size() == 3);  // the other has no area
  auto const& paint = file.scene.materials.at(square.triangle_material[1]);
  CHECK(paint.base_color.z == 0.3f);
  CHECK(paint.roughness == 0.4f);
  CHECK(paint.base_color_texture == 0);
  auto const& glass = file.scene.materials.at(one.triangle_material[0]);
  CHECK(glass.kind == gart::light::material_kind::dielectric);
  CHECK(glass.ior == 1.3f);
  REQUIRE(file.notes.size() == 2);
  CHECK(holds(file.notes[0], "1 triangle of"));
  CHECK(holds(file.notes[1], "1 record of"));

  auto const why = [&](std::string const& changed) { return refusal(folder.put("b.obj", changed)); };
  CHECK(holds(why(with(text, "f -4", "f -5")), "b.obj, line 14: a face has the vertex '-5', and there are 4"));
  CHECK(holds(why(with(text, "f -4", "f 4294967297")), "the vertex '4294967297'"));
  CHECK(holds(why(with(text, "f -4", "f 1x")), "the vertex '1x'"));
  CHECK(holds(why(with(text, "1/1/1", "1/2/1")), "the texture coordinate '2'"));
  CHECK(holds(why(with(text, "v 1 0 0", "v 1 x 0")), "line 4: a coordinate is 'x'"));
  CHECK(holds(why(with(text, "a.mtl", "b.mtl")), "mtllib 'b.mtl' is not there"));
  CHECK(holds(why("v 0 0 0\n"), "no triangle"));
  folder.put("a.mtl", "newmtl paint\nKd red 0.2 0.3\n");
  CHECK(holds(why(text), "a.mtl, line 2: Kd is 'red'"));
  folder.put("a.mtl", "newmtl paint\nmap_Kd none.png\n");
  CHECK(holds(why(text), "a.mtl, line 2: the texture 'none.png' is not there"));
}

TEST_CASE("scene.json places models, shapes and lights in the world") {
  scratch_folder const folder;
  folder.put("m.ply", "x");
  gart::image_float sky(4, 2, 3);
  sky.data[0] = 7;
  gart::write_exr(folder.path / "sky.exr", sky, "RGB");
  std::string const text = R"({
"models": [{"file": "m.ply", "rotation": [0, 0, 1, 0], "scale": 2, "translation": [1, 2, 3]}],
"up": [0, 0, 1], "background": [0.1, 0.2, 0.3],
"materials": [{"name": "ball", "kind": "mirror"}],
"meshes": [{"shape": "sphere", "material": "ball", "scale": 0.5, "translation": [10, 0, 0]},
           {"name": "floor", "shape": "plane", "scale": [4, 1, 2]}, {"shape": "box"}, {"shape": "torus"}],
"lights": [{"kind": "directional", "direction": [0, 0, -1], "angle": 90, "color": [3, 2, 1]},
           {"kind": "point", "position": [10, 0, 5]}],
"environment": {"file": "sky.exr", "degrees": 90},
"cameras": [{"name": "a", "width": 8, "height": 4, "fx": 5, "fy": 5, "cx": 4, "cy": 2,
             "c2w": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}],
"options": {"samples": 3, "shadows": "per-hit", "tone_map": "filmic", "exposure": -1}})";
  fs::path const path = folder.put("scene.json", text);
  auto const splats = gart::read_scene_splats(path);
  REQUIRE(splats.size() == 1);
  CHECK(splats[0].file.filename() == "m.ply");
  CHECK(splats[0].scale == 2);
  CHECK(splats[0].translation.z == 3);

  auto const file = gart::read_scene(path, gart::vec3d(10, 0, 0));
  REQUIRE(file.scene.meshes.size() == 4);
  auto const& ball = file.scene.meshes[0];
  CHECK(file.scene.materials.at(ball.triangle_material[0]).kind == gart::light::material_kind::mirror);
  for (std::size_t k = 0; k < 4; ++k) {
    gart::light::mesh const& m = file.scene.meshes[k];
    CAPTURE(m.name);
    int outwards = 0, all = static_cast<int>(m.triangles.size() / 3);
    for (std::size_t t = 0; t < m.triangles.size() / 3; ++t) {
      gart::vec3 const n = m.normals[m.triangles[3 * t]], f = face_of(m, t);
      outwards += n.x * f.x + n.y * f.y + n.z * f.z > 0;
    }
    CHECK(outwards == all);
  }
  for (gart::vec3 const& p : ball.positions)
    CHECK(std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z) == doctest::Approx(0.5));
  for (gart::vec3 const& p : file.scene.meshes[1].positions) {  // its y is up, which is z here
    CHECK(std::abs(p.x + 10) == doctest::Approx(4));
    CHECK(std::abs(p.z) < 1e-5f);
  }
  CHECK(near(file.scene.meshes[1].normals[0], {0, 0, 1}));
  CHECK(file.scene.lights[0].angle == doctest::Approx(0.785398));
  CHECK(near(file.scene.lights[1].position, {0, 0, 5}));
  CHECK(file.scene.around.texels[0] == 7);
  CHECK(near(file.scene.around.to_image * gart::vec3(0, 0, 1), {0, 1, 0}));
  CHECK(file.background->z == 0.3f);
  CHECK(file.cameras.at(0).name == "a");
  CHECK(file.paths.samples == 3);
  CHECK(file.paths.shadows == gart::light::shadow_kind::per_hit);
  CHECK(file.paths.tone == gart::light::tone_kind::filmic);

  auto const why = [&](std::string const& from, std::string const& to) {
    return refusal(folder.put("b.json", with(text, from, to)));
  };
  CHECK(holds(why("\"up\"", "\"upp\""), "has no field 'upp'; did you mean up?"));
  CHECK(holds(why("\"kind\": \"mirror\"", "\"kind\": \"miror\""), "did you mean mirror?"));
  CHECK(
      holds(why("\"material\": \"ball\"", "\"material\": \"bal\""), "mesh 0: 'material' is 'bal'; did you mean ball?"));
  CHECK(holds(why("\"shape\": \"box\"", "\"shape\": \"bx\""), "'shape' is 'bx'"));
  CHECK(holds(why("\"shape\": \"box\"", "\"file\": \"box.glb\""), "mesh 2: 'file' is 'box.glb', which is not there"));
  CHECK(holds(why("\"scale\": 0.5", "\"scale\": 0"), "'scale' is zero"));
  CHECK(holds(why("\"direction\": [0, 0, -1]", "\"direction\": [0, 0, 0]"), "light 0: 'direction'"));
  CHECK(holds(why("\"direction\"", "\"position\""), "light 0: has no field 'position'"));
  CHECK(holds(why("[0.1, 0.2, 0.3]", "[0.1, 0.2]"), "'background' is not a list of 3 numbers"));
  CHECK(holds(why("\"samples\": 3", "\"samples\": -3"), "options: 'samples' is -3"));
  CHECK(holds(why("\"filmic\"", "\"film\""), "'tone_map'"));
  CHECK(holds(why("sky.exr", "m.ply"), "is neither OpenEXR nor Radiance HDR"));
  CHECK(holds(error_of([&] { gart::read_scene_splats(folder.put("b.json", with(text, "m.ply", "n.ply"))); }),
              "model 0: 'file' is 'n.ply', which is not there"));
}

TEST_CASE("a PLY mesh is a scene, and another file is none") {
  scratch_folder const folder;
  gart::write_mesh_ply(folder.path / "m.ply", {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}});
  CHECK(gart::read_scene(folder.path / "m.ply").scene.meshes.at(0).triangles.size() == 3);
  CHECK(holds(refusal(folder.put("m.stl", "solid")), "is no scene"));
}

TEST_CASE("damaged scenes are refused, not crashed on") {
  scratch_folder const folder;
  folder.put("a b.bin", triangle_bytes());
  std::string const text = gltf();
  fs::path const path = folder.put("a.gltf", text);
  maltreat(path, text, true, [&] { gart::read_scene(path); });
}
