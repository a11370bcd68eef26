// A loss of one's own on several ranks: it sees the whole image, of which a rank alone may have a strip.
#include <train/capture.hpp>

#include "policy.hpp"

#include <gart/algorithm/reduce.hpp>
#include <gart/trace/tile_tracer.hpp>
#include <gart/train/trainer.hpp>

#include <doctest/doctest.h>

using namespace gart;

namespace {

using gart_test::every_rank, gart_test::exec_type, gart_test::rank_comm;
template <class Comm>
using trainer_of = trainer<exec_type, scene_traits<1>, tile_tracer<exec_type>, deterministic_method, Comm>;

struct twice_over_values {
  float const* image;
  float* gradient;
  float share;
  GART_KERNEL void operator()(index_t i) const { gradient[i] = 2 * image[i] * share; }
};

// The mean of the squares of all values.
void mean_square(loss_input<exec_type> const& in) {
  index_t const values = static_cast<index_t>(in.image.size());
  parallel_for(in.exec, "own loss", values,
               twice_over_values{in.image.data(), in.gradient.data(), 1.0f / static_cast<float>(values)});
  reduce(in.exec, in.image, in.value.subspan(0, 1));
  reduce(in.exec, in.image, in.value.subspan(1, 1), reduction::max);
}

}  // namespace

TEST_CASE("an own loss sees the whole image on any number of ranks") {
  exec_type exec = gart_test::make_exec();
  dataset const data = gart_test::capture(exec, 4);
  train_options options;
  options.iterations = 20, options.densify = densify_kind::none, options.shard_block = 8;
  gaussian_model const start = gart_test::cloud(11, 0.5f);
  trainer_of<self_comm> one(exec, options, data, start);
  trainer_of<rank_comm> all(exec, options, data, start, every_rank());
  for (int i = 0; i < options.iterations; ++i) {
    // The usual loss between, which ranks take by strips.
    step_report const alone = i % 3 == 1 ? one.step() : one.step(mean_square),
                      shared = i % 3 == 1 ? all.step() : all.step(mean_square);
    REQUIRE(shared.loss == alone.loss);
    REQUIRE(shared.psnr == alone.psnr);
  }
  CHECK(one.model().sh == all.model().sh);
  CHECK(one.model().mean == all.model().mean);
}
