// A capture that the ranks of a host read and hold once: the same images, each decoded by one of them.
#include <train/capture.hpp>

#include <gart/comm/mpi_comm.hpp>
#include <gart/exec/parallel.hpp>
#include <gart/io/file.hpp>
#include <gart/io/image_file.hpp>
#include <gart/trace/tile_tracer.hpp>
#include <gart/train/trainer.hpp>

#include <doctest/doctest.h>

#include <cstdio>
#include <cstring>

using namespace gart;
namespace fs = std::filesystem;

namespace {

// Seven photographs, two of them with masks, of two sizes; the first rank makes and removes them.
struct capture_folder {
  mpi_comm ranks;
  fs::path path = "distributed_capture_" + std::to_string(ranks.size());
  capture_folder() {
    if (ranks.rank() == 0) {
      fs::remove_all(path), fs::create_directories(path);
      std::string frames;
      for (int i = 0; i < 7; ++i) {
        image8 image(i == 3 ? 36 : 32, 24, 3);
        for (std::size_t k = 0; k < image.data.size(); ++k)
          image.data[k] = static_cast<u8>(17 * k + 40 * static_cast<std::size_t>(i));
        std::string const name = std::to_string(i);
        write_png(path / (name + ".png"), image);
        image8 mask(image.width, image.height, 1, 255);
        mask.at(i, 2, 0) = 0;
        bool const masked = i == 2 || i == 5;
        if (masked) write_png(path / (name + "_mask.png"), mask);
        frames += std::string(i ? "," : "") + R"({"file_path":")" + name + R"(.png",)" +
                  (masked ? R"("mask_path":")" + name + R"(_mask.png",)" : "") + R"("w":)" +
                  std::to_string(image.width) + R"(,"h":24,"fl_x":30,"fl_y":30,"cx":16,"cy":12,"transform_matrix":)" +
                  "[[1,0,0," + std::to_string(0.2 * i) + "],[0,1,0,0],[0,0,1,4],[0,0,0,1]]}";
      }
      write_file(path / "transforms.json", std::string_view("{\"frames\":[" + frames + "]}"));
    }
    ranks.barrier();
  }
  ~capture_folder() {
    ranks.barrier();
    if (ranks.rank() == 0) fs::remove_all(path);
    ranks.barrier();
  }
};

}  // namespace

TEST_CASE("ranks of a host decode each photograph once") {
  capture_folder const here;
  mpi_comm ranks = here.ranks;
  dataset_options options;
  options.test_every = 4;
  dataset const alone = load_dataset(here.path, options);
  auto const host = ranks.on_host();
  REQUIRE(host->size() == ranks.size());
  options.host = host.get();
  dataset shared = load_dataset(here.path, options);
  CHECK(alone.decoded == 7);
  u64 decoded = shared.decoded, most = (7 + static_cast<u64>(ranks.size()) - 1) / static_cast<u64>(ranks.size());
  CHECK(decoded <= most);
  ranks.all_reduce(span<u64>(&decoded, 1));
  CHECK(decoded == 7);
  int masks = 0;
  for (auto const views : {&dataset::train, &dataset::test}) {
    REQUIRE((alone.*views).size() == (shared.*views).size());
    for (std::size_t i = 0; i < (alone.*views).size(); ++i) {
      dataset_view const &a = (alone.*views)[i], &b = (shared.*views)[i];
      CHECK(a.name == b.name);
      CHECK(a.image.width == b.image.width);
      CHECK(a.image.channels == b.image.channels);
      CHECK(a.image.data == b.image.data);
      CHECK(a.mask.data == b.mask.data);
      masks += !b.mask.empty();
    }
  }
  CHECK(masks == 2);

  // One memory: what one rank writes all see. A copy is its own.
  image8 copy = shared.train[0].image;
  ranks.barrier();
  u8 const before = copy.data[5];
  if (ranks.rank() == 0) shared.train[0].image.data[5] = static_cast<u8>(before + 1);
  host->barrier();
  CHECK(shared.train[0].image.data[5] == static_cast<u8>(before + 1));
  CHECK(copy.data[5] == before);
  host->barrier();
  if (ranks.rank() == 0) shared.train[0].image.data[5] = before;
  host->barrier();

  // The same bits are trained.
  serial_exec exec;
  train_options run;
  run.iterations = 40, run.densify = densify_kind::none, run.shard_block = 8;
  gaussian_model const start = gart_test::cloud(3, 0.5f);
  using trainer_type = trainer<serial_exec, scene_traits<1>, tile_tracer<serial_exec>, deterministic_method, mpi_comm>;
  trainer_type by_own(exec, run, alone, start, ranks), by_shared(exec, run, shared, start, ranks);
  for (int i = 0; i < 40; ++i) REQUIRE(by_own.step().loss == by_shared.step().loss);
  gaussian_model const a = by_own.model(), b = by_shared.model();
  for_each_array([](parameter_array const&, auto const& x, auto const& y) { CHECK(x == y); }, a, b);
}

TEST_CASE("without shared memory each rank reads all and says so") {
  // The ranks of a host of which none has any.
  struct crowded final : host_group {
    std::shared_ptr<host_group> of;
    int rank() const override { return of->rank(); }
    int size() const override { return of->size(); }
    void all_gather(void const* mine, void* all, std::size_t bytes) override { of->all_gather(mine, all, bytes); }
    void barrier() override { of->barrier(); }
    std::shared_ptr<void> allocate(u64) override { return nullptr; }
  };
  capture_folder const here;
  CHECK(here.ranks.on_host()->allocate(u64{1} << 60) == nullptr);
  crowded host;
  host.of = here.ranks.on_host();
  dataset_options options;
  dataset const alone = load_dataset(here.path, options);
  options.host = &host;
  dataset const all = load_dataset(here.path, options);
  CHECK(all.decoded == 7);
  REQUIRE(all.train.size() == alone.train.size());
  for (std::size_t i = 0; i < all.train.size(); ++i) CHECK(all.train[i].image.data == alone.train[i].image.data);
  REQUIRE(all.notes.size() == alone.notes.size() + 1);
  CHECK(all.notes.front().find("/dev/shm") != std::string::npos);
}

TEST_CASE("one photograph that cannot be decoded ends loading on all") {
  capture_folder const here;
  mpi_comm ranks = here.ranks;
  if (ranks.rank() == 0) {
    auto const bytes = read_file(here.path / "5.png");
    write_file(here.path / "5.png", std::string_view(reinterpret_cast<char const*>(bytes.data()), bytes.size() / 2));
  }
  ranks.barrier();
  auto const host = ranks.on_host();
  dataset_options options;
  options.host = host.get();
  try {
    load_dataset(here.path, options);
    FAIL("not refused");
  } catch (error const& e) {
    CHECK(std::string(e.what()).find("5.png") != std::string::npos);
  }
}
