#include "capture_checksum.hpp"

#include <gart/io/crc32c.hpp>

namespace gart_cli {

nlohmann::json checksums_of(gart::dataset const& data) {
  gart::u32 names = 0, cameras = 0, images = 0;
  auto const add = [](gart::u32& sum, auto const& value) { sum = gart::crc32c(&value, sizeof value, sum); };
  for (auto const* views : {&data.train, &data.test}) {
    for (gart::dataset_view const& v : *views) {
      names = gart::crc32c(v.name.c_str(), v.name.size() + 1, names);
      gart::camera const& c = v.view;
      for (int const size : {c.width, c.height, static_cast<int>(c.kind), static_cast<int>(c.shutter)})
        add(cameras, size);
      for (float const number : {c.fx, c.fy, c.cx, c.cy}) add(cameras, number);
      static_assert(sizeof c.lens % sizeof(float) == 0, "numbers alone, with nothing between them");
      add(cameras, c.lens);
      for (int k = 0; k < 3; ++k) add(cameras, c.position[k]);
      for (int k = 0; k < 9; ++k) add(cameras, c.rotation[k / 3][k % 3]);
      images = gart::crc32c(v.image.data.data(), v.image.data.size(), images);
      images = gart::crc32c(v.mask.data.data(), v.mask.data.size(), images);
    }
  }
  return {{"names", names}, {"cameras", cameras}, {"images", images}};
}

}  // namespace gart_cli
