#pragma once
// The pictures of `gart synth`: a path tracer over Embree. Rays that miss leave the pixel transparent. A round lamp and
// a soft sky light surfaces, with shadows, interreflection and one glossy lobe. A pixel is the mean of its samples. The
// result depends on scene, camera, samples and seed only, never on the number of threads.
//
// Cost: about four rays a sample where there is something to see, one where there is not.

#include "synth_scene.hpp"

#include <gart/camera/models.hpp>
#include <gart/io/dataset.hpp>
#include <gart/scene/image.hpp>

#include <memory>
#include <vector>

namespace gart_cli {

class synth_renderer {
 public:
  // Throws gart::unsupported where gart was built without Embree. threads 0: as many as the machine has.
  explicit synth_renderer(synth_scene scene, int threads = 0);
  ~synth_renderer();

  // RGBA, sRGB with straight alpha; `samples` (1 to 4096) paths a pixel, evenest at powers of two.
  gart::image8 render(gart::camera const& view, int samples, u64 seed) const;

  // Distances along the rays through the middles of the pixels; 0 where one meets nothing.
  gart::image_float distances(gart::camera const& view) const;

  // Points on the surfaces, as structure from motion would find. Each is seen by at least one camera, and has the
  // colour that this camera sees.
  gart::point_cloud points(std::vector<gart::camera> const& cameras, std::size_t count, u64 seed) const;

 private:
  struct implementation;
  std::unique_ptr<implementation> implementation_;
};

}  // namespace gart_cli
