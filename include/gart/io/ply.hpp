#pragma once
/// \file
/// Splat files in the layout of the INRIA reference. They are binary little endian, and every property is a float. The
/// order is
///   x y z nx ny nz f_dc_0..2 f_rest_0..(3K-4) opacity scale_0..2 rot_0..3
/// The coefficients f_rest are channel-major. Opacity is a logit, and scales are logarithms. The rotation rot is
/// w,x,y,z and not normalised. A file is written in that order, byte for byte. It is read by name in any order, ascii
/// or binary of either endianness, without normals and with extra properties. Features (scene/features.hpp) are floats
/// feature_0 to feature_(N-1) behind these. They are read where their numbers begin at 0 and have no gap. Traits of
/// gart's own travel as header comments ("comment gart kernel_degree 2"). A model with the trait antialias also gets
/// other programs' mark, "comment SplatRenderMode: mip". A file with that mark or "comment antialiased 1", and without
/// gart's trait, is read as antialiased without a value.
///
/// Errors: io_error naming the file, the property and the remedy. It is thrown for a truncated body, a missing
/// property, and numbers of f_rest that make no degree from 0 to 3. Also for a 2D Gaussian file (no scale_2), and where
/// no Gaussian can be used. Then it names the first one's vertex and property. invalid_argument for a model whose
/// arrays disagree in size.

#include <gart/comm/row_owners.hpp>
#include <gart/comm/shared_file.hpp>
#include <gart/io/dataset.hpp>
#include <gart/io/splat_file.hpp>
#include <gart/scene/gaussians.hpp>

#include <filesystem>

namespace gart {

/// Reads a splat file. `traits`, if not null, gets the header's comments that begin with "gart". `notes` gets what was
/// left out (read_splats in io/splat_file.hpp).
gaussian_model read_splat_ply(std::filesystem::path const& path, splat_traits* traits = nullptr,
                              std::vector<std::string>* notes = nullptr);
/// Writes a splat file, with these traits.
void write_splat_ply(std::filesystem::path const& path, gaussian_model const& model, splat_traits const& traits = {});

/// Whether the name's ending asks for a splat PLY.
bool is_splat_ply(std::filesystem::path const& path);
/// Writes this rank's rows, byte for byte as write_splat_ply of `total` Gaussians; rank 0 writes the header too. `path`
/// is for messages. Memory: a few MB.
void write_splat_ply_rows(shared_file& file, std::filesystem::path const& path, gaussian_model const& mine,
                          row_owners const& owners, u64 total, splat_traits const& traits = {});
/// This rank's rows of a splat PLY, and how many Gaussians there are. Of a binary file no other rows are read. An ascii
/// file, or one with lists before its vertices, is read whole.
gaussian_model read_splat_ply_rows(std::filesystem::path const& path, row_owners const& owners, u64& total,
                                   splat_traits* traits = nullptr);

/// A plain point cloud: x y z, and red green blue where present (else grey). Points that are not finite are left out,
/// which `notes`, where it is not null, says.
point_cloud read_point_ply(std::filesystem::path const& path, std::vector<std::string>* notes = nullptr);
/// Writes x y z and red green blue, binary; in double, the origin added, where there is one.
void write_point_ply(std::filesystem::path const& path, point_cloud const& points, vec3d const& origin = vec3d(0.0));

}  // namespace gart
