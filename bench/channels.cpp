// Features beside a view's colours, and the hit list that they share. What 1, 16 and 128 of them cost forward and back,
// detached from the geometry and not.
#include "support/frame.hpp"

#include <gart/channels/passes.hpp>
#include <gart/channels/pixel_hits.hpp>

namespace {

template <gart::execution E>
struct featured : gart_bench::frame<E, gart_bench::by_tiles<>> {
  using base = gart_bench::frame<E, gart_bench::by_tiles<>>;
  gart::buffer<float, E> color, features, by, gradients, shown, moments;
  gart::buffer<gart::u32, E> hits;
  gart::hit_table<E> table;
  gart::channel_gradient<E> back;
  gart::gaussian_channels channels;
  gart::channel_gradients given;

  featured(E& exec, int width)
      : base(exec),
        color(exec, 3 * this->pixels()),
        features(exec, gart_bench::noise(this->gaussians.size() * static_cast<std::size_t>(width), 1)),
        by(exec, gart_bench::noise(this->pixels() * static_cast<std::size_t>(width), 1e-6f)),
        gradients(exec, features.size()),
        shown(exec, by.size()),
        moments(exec, std::size_t{gart::moment_stride} * this->gaussians.size()),
        hits(exec, this->pixels()),
        table(exec),
        back(exec) {
    channels.features = {features.data(), this->gaussians.size(), width}, given.features = by;
    this->prepare();
    image(), list();
    moments.zero();
  }
  void image() { this->traced.render({.color = color.data(), .hits = hits.data()}); }
  void list() { gart::list_hits(this->traced, table, true, hits); }
  void sum() { gart::sum_channels(this->traced.exec(), table, channels, {shown.data()}); }
  void weigh() {
    back.begin(table);
    gart::weigh_channels(back, channels, given);
    back.add_moments(table, this->traced.gaussians(), moments);
  }
  void pull() {
    gart::pull_channels(this->traced.exec(), back, table, channels, given,
                        {{gradients.data(), channels.features.count, channels.features.width}});
  }
};

// What = a member of featured.
template <auto What, int Width, gart::execution E>
void stage(benchmark::State& state, E& exec) {
  featured<E> f(exec, Width);
  gart_bench::measure(state, exec, [&] { What(f); });
  state.counters["hits"] = static_cast<double>(f.table.ids.size());
}

constexpr auto image = [](auto& f) { f.image(); };
constexpr auto list = [](auto& f) { f.list(); };
constexpr auto order = [](auto& f) { f.list(), f.table.by_gaussian(f.traced.exec(), f.gaussians.size()); };
constexpr auto sum = [](auto& f) { f.sum(); };
constexpr auto weigh = [](auto& f) { f.weigh(); };
constexpr auto pull = [](auto& f) { f.pull(); };

}  // namespace

GART_BENCH("channels/image", stage<image, 1>)
GART_BENCH("channels/list", stage<list, 1>)
GART_BENCH("channels/list_and_order", stage<order, 1>)
GART_BENCH("channels/sum/1", stage<sum, 1>)
GART_BENCH("channels/sum/16", stage<sum, 16>)
GART_BENCH("channels/sum/128", stage<sum, 128>)
GART_BENCH("channels/moments/1", stage<weigh, 1>)
GART_BENCH("channels/moments/16", stage<weigh, 16>)
GART_BENCH("channels/moments/128", stage<weigh, 128>)
GART_BENCH("channels/pull/1", stage<pull, 1>)
GART_BENCH("channels/pull/16", stage<pull, 16>)
GART_BENCH("channels/pull/128", stage<pull, 128>)
