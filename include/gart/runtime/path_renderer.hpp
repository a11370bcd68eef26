#pragma once
/// \file
/// Light among the Gaussians behind one host-safe interface. It takes a model and a scene of meshes and lights; its
/// pictures improve with each sample.
///
///   auto tracer = make_path_renderer(request);
///   tracer->set_model(model);
///   tracer->set_scene(scene);
///   tracer->begin(view, options, paths);
///   while (tracer->samples() < paths.samples) tracer->add(4);   // or all of them at once
///   image_float picture = tracer->picture();
///
/// Memory: the tree over the Gaussians as for batches, 150 bytes a triangle, 150 bytes a pixel.
/// Errors: unsupported where light is not compiled for the backend. Also invalid_argument for options, scenes and
/// cameras that cannot be traced, and for a picture before there is a sample. Also out_of_memory.

#include <gart/exec/profile.hpp>
#include <gart/light/path_options.hpp>
#include <gart/light/scene.hpp>
#include <gart/render/options.hpp>
#include <gart/render/rendered.hpp>
#include <gart/runtime/request.hpp>
#include <gart/scene/camera.hpp>
#include <gart/scene/gaussians.hpp>
#include <gart/scene/image.hpp>

#include <memory>

namespace gart {

/// In place of a Gaussian, a mesh or a triangle, where a pixel has none.
inline constexpr u32 no_number = 0xffffffffu;

/// The first surface that a path through the middle of each pixel meets. Of samples there are means in the colour
/// alone.
struct path_layers {
  image_float albedo;         ///< [H][W][3]: base colours of Gaussians and surface, blended as colours are
  image_float normal;         ///< [H][W][3]: world, of the surface, times the transmittance before it
  image_float depth;          ///< [H][W][1]: sum of weight * t, the surface as a last hit
  image_float transmittance;  ///< [H][W][1]: of the Gaussians before the surface
  basic_image<u32> gaussian;  ///< [H][W][1]: of the largest weight
  basic_image<u32> mesh;      ///< [H][W][1]: of the surface
  basic_image<u32> triangle;  ///< [H][W][1]: of that mesh
};

/// Depth and transmittance of the layers, without a colour. Nothing is seen behind a surface.
rendered depth_of(path_layers const& layers);

/// Traces paths.
class path_renderer {
 public:
  /// The policy's memory goes with it.
  virtual ~path_renderer() = default;

  /// Copies the model.
  virtual void set_model(gaussian_model const& model) = 0;
  /// Copies the scene.
  virtual void set_scene(light::scene const& scene) = 0;

  /// A picture anew, without a sample. The model and the scene must be set; options.antialias must be 0.
  virtual void begin(camera const& view, render_options const& options, light::path_options const& paths) = 0;
  /// So many samples more a pixel; sample k is the same whether it is added alone or with others.
  virtual void add(int samples) = 0;
  /// How many there are.
  virtual int samples() const = 0;

  /// The mean so far, linear: [H][W][3].
  virtual image_float radiance() = 0;
  /// The same exposed and in the tone of the options.
  virtual image_float picture() = 0;
  /// The picture as to_8bit makes it. The policy converts it, so 3 bytes a pixel are copied in place of 12.
  virtual image8 picture_8bit() = 0;
  /// The layers, for a denoiser or a compositor.
  virtual path_layers layers() = 0;

  /// Times of stages; waits for the policy.
  virtual profiler& profile() = 0;
  /// The configuration chosen for the request.
  virtual configuration_info configuration() const = 0;
};

/// The best backend that meets the request: its backend, threads and device count, and its kernel degree.
std::unique_ptr<path_renderer> make_path_renderer(configuration_request const& request);

/// Makes the renderer that a request asks for.
using path_renderer_maker = std::unique_ptr<path_renderer> (*)(configuration_request const&);
/// Adds one to the table; before main, from static initialisers (runtime/compiled_paths.hpp).
void register_path_renderer(backend_kind backend, int kernel_degree, bool (*available)(std::string*),
                            path_renderer_maker make);

}  // namespace gart
