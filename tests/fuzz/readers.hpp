#pragma once
// Every reader of files that gart has, as a function of bytes. Each writes the bytes into a memory-backed folder as the
// file or files that the reader wants, reads them, and returns whether they were accepted. A gart::error that names the
// file is how a reader refuses; whatever else is thrown is a bug, and so is an accepted file whose contents break what
// the reader's header promises (broken_promise). libFuzzer calls these functions (target.cpp), and so does the replay
// of the corpus (replay.cpp).

#include <stdexcept>
#include <string_view>

namespace gart_fuzz {

bool splat_ply(std::string_view input);  // and written again, which must give the same model
bool spz(std::string_view input);        // the formats of docs/formats.md, each by its first bytes or its name
bool compressed_ply(std::string_view input);
bool sog(std::string_view input);
bool splat_bytes(std::string_view input);
bool glb(std::string_view input);
bool point_ply(std::string_view input);
bool colmap_bin(std::string_view input);  // cameras, images, points3D, between them a line "===="
bool colmap_txt(std::string_view input);  // likewise
bool transforms(std::string_view input);  // nerfstudio's and instant-ngp's transforms.json
bool blender(std::string_view input);     // transforms_train.json and transforms_test.json, between them a line "===="
bool camera_json(std::string_view input);
bool exposures(std::string_view input);     // asked for a view, written and read again
bool depth(std::string_view input);         // and written again as .npy
bool view_message(std::string_view input);  // what a viewer's client may send; refused by the field's name
bool png(std::string_view input);
bool jpeg(std::string_view input);
bool webp(std::string_view input);
bool mesh_ply(std::string_view input);        // and written again, which must give the same mesh
bool gltf(std::string_view input);            // .gltf or .glb
bool obj(std::string_view input);             // and its MTL, between them a line "===="
bool scene_json(std::string_view input);      // whatever files it names
bool radiance(std::string_view input);        // EXR or HDR
bool checkpoint(std::string_view input);      // loaded by a session, which then takes a step
bool resume_config(std::string_view input);   // config.json, as --resume reads it
bool resume_history(std::string_view input);  // history.json, likewise

struct broken_promise : std::logic_error {
  using std::logic_error::logic_error;
};

}  // namespace gart_fuzz
