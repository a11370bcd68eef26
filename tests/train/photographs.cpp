// Photographs that find no room on a device are streamed: kernels read the same bytes.
#include <support/policies.hpp>

#include <gart/exec/buffer.hpp>
#include <gart/train/training_images.hpp>

#include <vector>

namespace {

gart::dataset photographs(std::mt19937_64& engine) {
  gart::dataset data;
  for (int i = 0; i < 5; ++i) {
    gart::dataset_view v;
    v.view.width = 12 + 4 * i, v.view.height = 8;
    v.image = gart::image8(v.view.width, v.view.height, 3), v.mask = gart::image8(v.view.width, v.view.height, 1);
    for (auto* image : {&v.image, &v.mask})
      for (auto& x : image->data) x = static_cast<gart::u8>(engine());
    data.train.push_back(std::move(v));
  }
  return data;
}

}  // namespace

TEST_CASE_TEMPLATE("photographs without room are streamed", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 engine(seed);
  gart::dataset const data = photographs(engine);
  E exec;
  for (gart::u64 const room : {0, 800, 1'000'000}) {  // for none, for some, for all
    CAPTURE(room);
    gart::training_images<E> images(exec, data, room);
    for (int const view : {0, 1, 2, 3, 4, 2, 0, 4}) {
      auto const& v = data.train[static_cast<std::size_t>(view)];
      gart::truth_view const truth = images.get(static_cast<std::size_t>(view), gart::vec3(0), 1);
      std::vector<gart::u8> pixels(v.image.data.size()), mask(v.mask.data.size());
      exec.copy_out(pixels.data(), truth.pixels, pixels.size());
      exec.copy_out(mask.data(), truth.mask, mask.size());
      CHECK(pixels == v.image.data);
      CHECK(mask == v.mask.data);
    }
  }
}
