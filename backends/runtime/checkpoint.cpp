#include <gart/core/error.hpp>
#include <gart/io/crc32c.hpp>
#include <gart/io/file.hpp>
#include <gart/runtime/checkpoint.hpp>
#include <gart/train/state.hpp>

#include <cmath>
#include <cstring>
#include <limits>
#include <ostream>

namespace gart {

namespace {

constexpr char magic[] = "gart checkpoint 2\n", plain_magic[] = "gart checkpoint 1\n";
constexpr std::size_t magic_size = sizeof magic - 1;
constexpr u64 longest_name = 256;

class array_writer {
 public:
  explicit array_writer(std::ostream& out) : out_(out) {}
  void write(std::string const& name, checkpoint_array const& array) {
    crc_ = 0;
    number<u64>(name.size());
    put(name.data(), name.size());
    number<u32>(array.version);
    number<u64>(array.bytes.size());
    put(array.bytes.data(), array.bytes.size());
    number<u32>(crc_);
  }

 private:
  template <class T>
  void number(T value) {
    put(reinterpret_cast<char const*>(&value), sizeof value);
  }
  void put(char const* bytes, std::size_t size) {
    out_.write(bytes, static_cast<std::streamsize>(size));
    crc_ = crc32c(bytes, size, crc_);
  }
  std::ostream& out_;
  u32 crc_ = 0;
};

}  // namespace

void checkpoint_writer::write(std::filesystem::path const& path) const {
  write_file(path, [this](std::ostream& out) {
    out.write(magic, magic_size);
    array_writer writer(out);
    for (auto const& [name, array] : arrays_) writer.write(name, array);
    writer.write("end", {});
  });
}

checkpoint_reader::checkpoint_reader(std::filesystem::path const& path) : path_(path) {
  std::vector<u8> const file = read_file(path);
  std::size_t at = magic_size;
  auto const starts = [&](char const* with) {
    return file.size() >= magic_size && std::memcmp(file.data(), with, magic_size) == 0;
  };
  bool const checked = starts(magic);
  if (!checked && !starts(plain_magic)) fail("is not a gart checkpoint");
  auto const take = [&](void* to, std::size_t bytes) {
    if (file.size() - at < bytes) fail("is truncated: the last complete array is its last readable part");
    if (bytes) std::memcpy(to, file.data() + at, bytes);
    at += bytes;
  };
  for (;;) {
    std::size_t const begin = at;
    u64 length = 0, bytes = 0;
    checkpoint_array array;
    take(&length, sizeof length);
    if (length > longest_name) fail("is damaged: an array's name is too long");
    std::string name(length, '\0');
    take(name.data(), length);
    if (checked) take(&array.version, sizeof array.version);
    take(&bytes, sizeof bytes);
    if (bytes > file.size()) fail("is truncated or damaged: array " + name + " is longer than the file");
    array.bytes.resize(bytes);
    take(array.bytes.data(), bytes);
    if (checked) {
      u32 const found = crc32c(file.data() + begin, at - begin);
      u32 stored = 0;
      take(&stored, sizeof stored);
      if (found != stored) fail("is damaged: the checksum of array " + name + " is not that of its bytes");
    }
    if (name == "end") break;
    arrays_[name] = std::move(array);
  }
  if (checked && at != file.size()) fail("is damaged: there is more after its end");
}

void checkpoint_reader::fail(std::string const& what) const {
  throw io_error(path_.string(), what, "take a checkpoint that was saved whole, or start anew");
}

std::vector<char> const& checkpoint_reader::find(std::string const& name, std::size_t element,
                                                 u32 newest_version) const {
  auto const it = arrays_.find(name);
  if (it == arrays_.end()) fail("has no array " + name);
  auto const& [version, bytes] = it->second;
  if (version > newest_version) {
    fail("array " + name + " is of version " + std::to_string(version) + ", and this program reads up to " +
         std::to_string(newest_version) + ": a newer gart wrote it");
  }
  if (bytes.size() % element != 0) fail("array " + name + " is not a whole number of elements");
  return bytes;
}

training_state with_sh_degree(training_state state, int degree) {
  for (gaussian_model* model : {&state.scene, &state.first, &state.second})
    *model = with_sh_degree(std::move(*model), degree);
  return state;
}

void write_checkpoint(std::filesystem::path const& path, training_state const& state) {
  checkpoint_writer out;
  auto const add = [&](std::string const& prefix, gaussian_model const& m) {
    for_each_array([&](parameter_array const& a, auto const& values) { out.add(prefix + a.name, values); }, m);
  };
  add("", state.scene), add("first/", state.first), add("second/", state.second);
  out.add("step", std::vector<int>{state.step});
  out.add("sh_degree", std::vector<int>{state.scene.sh_degree});
  out.add("growth", std::vector<float>{state.growth});
  out.add("seed", std::vector<u64>{state.seed});
  out.add("error_growth/error_sum", state.error_sum);
  out.add("adc/gradient_sum", state.gradient_sum), out.add("adc/touched", state.touched);
  out.add("sh_trials", state.trials);
  if (exposure_state const& e = state.exposures; !e.value.empty()) {
    out.add("exposure", e.value), out.add("exposure/first", e.first), out.add("exposure/second", e.second);
    out.add("exposure/visits", e.visits);
  }
  if (pose_state const& p = state.poses; !p.value.empty()) {
    out.add("pose", p.value), out.add("pose/first", p.first), out.add("pose/second", p.second);
    out.add("pose/metric", p.metric), out.add("pose/visits", p.visits);
  }
  if (lens_state const& l = state.lenses; !l.value.empty()) {
    out.add("lens", l.value), out.add("lens/first", l.first), out.add("lens/second", l.second);
    out.add("lens/visits", l.visits);
  }
  out.write(path);
}

namespace {

training_state state_of(checkpoint_reader const& in) {
  training_state s;
  std::vector<int> const degree = in.get<int>("sh_degree"), step = in.get<int>("step");
  std::vector<u64> const seed = in.get<u64>("seed");
  std::vector<float> const growth = in.get<float>("growth");
  if (degree.size() != 1 || step.size() != 1 || seed.size() != 1 || growth.size() != 1)
    in.fail("a counter is not one number");
  if (degree[0] < 0 || degree[0] > 3) in.fail("is damaged: it is of SH degree " + std::to_string(degree[0]));
  if (step[0] < 0 || step[0] == std::numeric_limits<int>::max())
    in.fail("is damaged: it was saved after step " + std::to_string(step[0]));
  if (!(growth[0] > 0 && std::isfinite(growth[0]))) in.fail("is damaged: its growth is no factor");
  auto const get = [&](std::string const& prefix) {
    gaussian_model m;
    m.sh_degree = degree[0];
    for_each_array([&](parameter_array const& a, auto& values) { values = in.get<float>(prefix + a.name); }, m);
    if (!m.arrays_agree()) in.fail("its arrays " + prefix + "* differ in length");
    return m;
  };
  s.scene = get(""), s.first = get("first/"), s.second = get("second/");
  if (s.first.size() != s.scene.size() || s.second.size() != s.scene.size())
    in.fail("its moments differ in number from its Gaussians");
  s.step = step[0], s.growth = growth[0], s.seed = seed[0];
  if (in.has("error_growth/error_sum")) s.error_sum = in.get<float>("error_growth/error_sum");
  s.gradient_sum = in.get<float>("adc/gradient_sum"), s.touched = in.get<u32>("adc/touched");
  if (s.gradient_sum.size() != s.touched.size()) in.fail("its arrays adc/* differ in length");
  if (in.has("exposure")) {
    exposure_state& e = s.exposures;
    e.value = in.get<float>("exposure"), e.visits = in.get<u32>("exposure/visits");
    e.first = in.get<float>("exposure/first"), e.second = in.get<float>("exposure/second");
    std::size_t const floats = exposure::floats * e.visits.size();
    if (e.value.size() != floats || e.first.size() != floats || e.second.size() != floats)
      in.fail("its arrays exposure* differ in length");
  }
  if (in.has("pose")) {
    pose_state& p = s.poses;
    p.value = in.get<double>("pose"), p.visits = in.get<u32>("pose/visits");
    p.metric = in.get<double>("pose/metric");
    p.first = in.get<double>("pose/first"), p.second = in.get<double>("pose/second");
    std::size_t const numbers = std::tuple_size_v<pose_numbers> * p.visits.size();
    if (p.value.size() != numbers || p.first.size() != numbers || p.second.size() != numbers ||
        p.metric.size() != std::tuple_size_v<pose_numbers> * numbers)
      in.fail("its arrays pose* differ in length");
  }
  if (in.has("lens")) {
    lens_state& l = s.lenses;
    l.value = in.get<double>("lens"), l.visits = in.get<u32>("lens/visits");
    l.first = in.get<double>("lens/first"), l.second = in.get<double>("lens/second");
    std::size_t const numbers = std::tuple_size_v<lens_numbers> * l.visits.size();
    if (l.value.size() != numbers || l.first.size() != numbers || l.second.size() != numbers)
      in.fail("its arrays lens* differ in length");
  }
  if (in.has("sh_trials")) s.trials = in.get<band_trial>("sh_trials");
  for (band_trial const& t : s.trials)
    if (t.band < 1 || t.band > 3) in.fail("is damaged: a trial of SH band " + std::to_string(t.band));
  return s;
}

}  // namespace

training_state read_checkpoint(std::filesystem::path const& path) { return state_of(checkpoint_reader(path)); }

training_state read_checkpoint(std::filesystem::path const& path, int sh_degree) {
  checkpoint_reader const in(path);
  training_state s = state_of(in);
  if (s.scene.sh_degree != sh_degree) {
    in.fail("is of SH degree " + std::to_string(s.scene.sh_degree) + ", this run of " + std::to_string(sh_degree) +
            ": take configuration_request.sh_degree = " + std::to_string(s.scene.sh_degree));
  }
  return s;
}

}  // namespace gart
