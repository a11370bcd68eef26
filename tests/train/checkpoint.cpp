// Checkpoints: what was written comes back, one flipped bit does not pass, and files of the first format are read.
#include <support/policies.hpp>

#include <gart/core/error.hpp>
#include <gart/io/file.hpp>
#include <gart/train/state.hpp>

#include <unistd.h>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

using namespace gart;
namespace fs = std::filesystem;

namespace {

class scratch_file {
 public:
  scratch_file() : path_(fs::temp_directory_path() / ("gart_checkpoint_" + std::to_string(::getpid()))) {}
  ~scratch_file() {
    std::error_code ignored;
    fs::remove(path_, ignored);
  }
  fs::path const& path() const { return path_; }
  std::string bytes() const {
    auto const all = read_file(path_);
    return {all.begin(), all.end()};
  }
  void put(std::string const& bytes) const {
    std::ofstream(path_, std::ios::binary | std::ios::trunc).write(bytes.data(), static_cast<long>(bytes.size()));
  }

 private:
  fs::path path_;
};

training_state some_state(std::mt19937_64& random) {
  std::normal_distribution<float> normal;
  training_state s;
  for (gaussian_model* m : {&s.scene, &s.first, &s.second}) {
    m->resize(3, 1);
    for (auto* values : {&m->mean, &m->log_scale, &m->quaternion, &m->opacity, &m->sh})
      for (float& v : *values) v = normal(random);
  }
  s.step = 1234, s.seed = 77;
  s.parts.set("growth", std::vector<float>{1.25f});
  s.parts.set("error_growth/error_sum", std::vector<float>{7, 8, 9});
  s.parts.set("adc/touched", std::vector<u32>{4, 5, 6});
  s.parts.set("exposure", std::vector<float>(12, 0.5f)), s.parts.set("exposure/visits", std::vector<u32>{9});
  s.parts.set("pose", std::vector<double>(6, 0.125)), s.parts.set("none", std::vector<double>());
  return s;
}

void check_same(training_state const& a, training_state const& b) {
  auto const same = [](gaussian_model const& x, gaussian_model const& y) {
    return x.sh_degree == y.sh_degree && x.mean == y.mean && x.log_scale == y.log_scale &&
           x.quaternion == y.quaternion && x.opacity == y.opacity && x.sh == y.sh;
  };
  CHECK(same(a.scene, b.scene));
  CHECK(same(a.first, b.first));
  CHECK(same(a.second, b.second));
  CHECK(a.step == b.step);
  CHECK(a.seed == b.seed);
  CHECK(a.parts.bytes == b.parts.bytes);
}

// The same arrays as the first format has them: no version, no checksum.
std::string in_first_format(std::string const& file) {
  std::string out = "gart checkpoint 1\n";
  std::size_t at = out.size();
  while (at < file.size()) {
    u64 name = 0, bytes = 0;
    std::memcpy(&name, file.data() + at, 8);
    std::memcpy(&bytes, file.data() + at + 8 + name + 4, 8);
    out += file.substr(at, 8 + name) + file.substr(at + 8 + name + 4, 8 + bytes);
    at += 8 + name + 4 + 8 + bytes + 4;
  }
  return out;
}

}  // namespace

TEST_CASE("a checkpoint comes back, of the first format too") {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  scratch_file const file;
  training_state const state = some_state(random);
  write_checkpoint(file.path(), state);
  check_same(read_checkpoint(file.path()), state);
  file.put(in_first_format(file.bytes()));
  check_same(read_checkpoint(file.path()), state);
}

TEST_CASE("any flipped, missing or added bit of a checkpoint is found") {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  scratch_file const file;
  write_checkpoint(file.path(), some_state(random));
  std::string const whole = file.bytes();
  long passed = 0;
  // In place: a file that is cut to nothing and written anew costs a disk access each time.
  std::fstream in_place(file.path(), std::ios::binary | std::ios::in | std::ios::out);
  auto const put_byte = [&](std::size_t at, int value) {
    in_place.seekp(static_cast<std::streamoff>(at));
    in_place.put(static_cast<char>(value)).flush();
  };
  for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
    put_byte(bit / 8, whole[bit / 8] ^ (1 << bit % 8));
    try {
      read_checkpoint(file.path());
      ++passed;
    } catch (io_error const&) {
    }
    put_byte(bit / 8, whole[bit / 8]);
  }
  CHECK(passed == 0);
  for (std::size_t const size :
       {whole.size() - 1, whole.size() - 4, whole.size() / 2, std::size_t{18}, std::size_t{3}}) {
    file.put(whole.substr(0, size));
    CHECK_THROWS_AS(read_checkpoint(file.path()), io_error);
  }
  file.put(whole + '\0');
  CHECK_THROWS_WITH_AS(read_checkpoint(file.path()), doctest::Contains("more after its end"), io_error);

  std::string damaged = whole;
  std::size_t const mean = damaged.find("first/mean");
  damaged[mean + 10 + 4 + 8 + 5] ^= 16;
  file.put(damaged);
  CHECK_THROWS_WITH_AS(read_checkpoint(file.path()), doctest::Contains("the checksum of array first/mean"), io_error);
}

TEST_CASE("an array of a later version is refused by its name") {
  std::mt19937_64 random(1);
  scratch_file const file;
  write_checkpoint(file.path(), some_state(random));
  std::string bytes = file.bytes();
  bytes[bytes.find("seed") + 4] = 2;
  file.put(bytes);
  CHECK_THROWS_WITH_AS(read_checkpoint(file.path()), doctest::Contains("array seed is of version 2"), io_error);
}
