// Sizes of views meet a time, and views keep to their share of it.
#include <gart/view/pacing.hpp>

#include <doctest/doctest.h>

TEST_CASE("moving views come to their time, whatever they cost") {
  for (double fixed_cost : {0.0, 5.0, 40.0}) {
    for (double per_pixel : {1e-6, 1e-4, 5e-4}) {
      CAPTURE(fixed_cost);
      CAPTURE(per_pixel);
      gart::frame_pacing pacing;
      int const width = 1280, height = 960;
      double const target = 80, whole = fixed_cost + per_pixel * width * height;
      double took = 0;
      std::pair<int, int> size;
      for (int i = 0; i < 30; ++i) {
        size = pacing.size(width, height, target);
        CHECK(size.first * height == size.second * width);
        took = fixed_cost + per_pixel * size.first * size.second;
        pacing.measured(took, static_cast<double>(size.first) * size.second);
      }
      if (whole <= target) {
        CHECK(size.first == width);
      } else {
        CHECK(took <= 1.02 * target);
        CHECK(took >= 0.8 * target);  // sides are parts in 32
      }
    }
  }
}

TEST_CASE("sides shrink to an eighth, and to no less than a pixel") {
  gart::frame_pacing pacing;
  pacing.measured(1e6, 100);
  CHECK(pacing.size(640, 480, 80) == std::pair(80, 60));
  CHECK(pacing.size(3, 5, 80) == std::pair(1, 1));
  pacing.measured(0, 100), pacing.measured(-1, 100), pacing.measured(5, 0);
  CHECK(pacing.rate() == 1e4);
}

TEST_CASE("a client that has measured nothing starts from the others") {
  gart::frame_pacing all, own;
  CHECK(own.size(640, 480, 80) == std::pair(160, 120));
  all.measured(1, 10000);
  own.start_from(all);
  CHECK(own.size(640, 480, 80) == std::pair(640, 480));
  all.measured(1e9, 1);
  own.start_from(all);
  CHECK(own.rate() == 1e-4);
}

TEST_CASE("views keep to their share of the time, whatever one takes") {
  for (double share : {0.05, 0.1, 0.5}) {
    for (double view_seconds : {0.001, 0.05, 0.7}) {
      for (double step_seconds : {0.002, 0.3}) {
        CAPTURE(share);
        CAPTURE(view_seconds);
        CAPTURE(step_seconds);
        gart::time_share time(share);
        double worked = 0, viewed = 0;
        while (worked + viewed < 2000) {
          worked += step_seconds;
          time.worked(step_seconds);
          while (time.may_view()) {
            viewed += view_seconds;
            time.viewed(view_seconds);
          }
        }
        CHECK(viewed <= share * worked + 1);
        // Views are there as often as they may be, where a step does not earn more than is saved up.
        if (step_seconds * share < 0.1) CHECK(viewed >= 0.9 * share * worked - 1);
      }
    }
  }
}

TEST_CASE("a slower step after a view counts as the view's share") {
  gart::time_share time(0.1);
  double usual = 0, views = 0;
  bool after = false;
  for (int step = 0; step < 20000; ++step) {
    double const slower = after ? 0.002 : 0;
    time.worked(0.004 + slower);
    usual += 0.004, views += slower;
    after = time.may_view();
    time.viewed(after ? 0.003 : 1e-6, after);
    views += after ? 0.003 : 1e-6;
  }
  CHECK(views <= 0.1 * usual + 0.01);
  CHECK(views >= 0.095 * usual);
}

TEST_CASE("an unused share is kept for a moment only") {
  gart::time_share time(0.1);
  CHECK_FALSE(time.may_view());
  time.worked(10000);
  int views = 0;
  for (; time.may_view(); ++views) time.viewed(0.01);
  CHECK(views <= 11);
  time.set(1);
  CHECK(time.may_view());
}
