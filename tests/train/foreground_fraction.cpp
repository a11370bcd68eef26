// The share of its images that a capture fills.
#include <support/policies.hpp>

#include <gart/train/foreground_fraction.hpp>
#include <gart/train/view_order.hpp>

using namespace gart;

namespace {

// Views of 10 x 10; `filled` pixels of each are grey, the rest is `empty`.
dataset capture_of(int views, int filled, u8 empty, int channels = 3) {
  dataset out;
  for (int v = 0; v < views; ++v) {
    dataset_view view;
    view.image = image8(10, 10, channels);
    for (int i = 0; i < 100; ++i)
      for (int c = 0; c < channels; ++c)
        view.image.at(i % 10, i / 10, c) = i < filled ? (c == 3 ? 255 : 128) : c == 3 ? 0 : empty;
    out.train.push_back(view);
  }
  return out;
}

double share_of(dataset const& data, background_kind background, std::vector<std::size_t> const& held_out = {}) {
  return foreground_fraction(data, views_trained_on(data.train.size(), held_out), background);
}

}  // namespace

TEST_CASE("the share of the images that a capture fills") {
  CHECK(share_of(capture_of(3, 25, 255), background_kind::white) == doctest::Approx(0.25));
  CHECK(share_of(capture_of(3, 25, 0), background_kind::black) == doctest::Approx(0.25));
  CHECK(share_of(capture_of(3, 25, 0), background_kind::white) == doctest::Approx(1));
  CHECK(share_of(capture_of(100, 25, 0), background_kind::black) == doctest::Approx(0.25));
  // What is nearly the background is.
  CHECK(share_of(capture_of(3, 25, 250), background_kind::white) == doctest::Approx(0.25));
  // Transparent pixels are empty over any background, opaque ones of any colour over a random one are not.
  CHECK(share_of(capture_of(3, 25, 99, 4), background_kind::black) == doctest::Approx(0.25));
  CHECK(share_of(capture_of(3, 25, 99, 4), background_kind::random) == doctest::Approx(0.25));
  CHECK(share_of(capture_of(3, 25, 0), background_kind::random) == doctest::Approx(1));
  CHECK(share_of(capture_of(3, 0, 0), background_kind::black) == doctest::Approx(0.001));
  CHECK(share_of({}, background_kind::black) == 1);

  // What a mask excludes does not count, as it does not in the loss.
  dataset masked = capture_of(2, 50, 0);
  for (dataset_view& view : masked.train) {
    view.mask = image8(10, 10, 1, 255);
    for (int i = 0; i < 20; ++i) view.mask.data[i] = 0;
  }
  CHECK(share_of(masked, background_kind::black) == doctest::Approx(0.3));

  // Nor does a view that is held out.
  dataset held = capture_of(4, 20, 0);
  held.train[1] = capture_of(1, 100, 0).train[0];
  CHECK(share_of(held, background_kind::black) == doctest::Approx(0.4));
  CHECK(share_of(held, background_kind::black, {1}) == doctest::Approx(0.2));
}

TEST_CASE("penalties follow the foreground below a quarter of images") {
  CHECK(penalty_scale(1) == 1);
  CHECK(penalty_scale(0.25) == 1);
  CHECK(penalty_scale(0.02) == doctest::Approx(0.08));
}
