// One rank's rows of a checkpoint.
#include <gart/core/error.hpp>
#include <gart/io/crc32c.hpp>
#include <gart/train/checkpoint_rows.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>

namespace gart {

namespace {

constexpr char magic[] = "gart checkpoint 2\n", plain_magic[] = "gart checkpoint 1\n";
constexpr std::size_t magic_size = sizeof magic - 1;
constexpr u64 longest_name = 256;

// f(name, values, elements of a Gaussian; 0: of the run) for each array of a state.
template <class F>
void for_each_state_array(training_state const& state, F const& f) {
  auto const model = [&](std::string const& prefix, gaussian_model const& m) {
    for_each_array(
        [&](parameter_array const& a, auto const& values) { f(prefix + a.name, values, a.width(m.sh_degree)); }, m);
  };
  model("", state.scene), model("first/", state.first), model("second/", state.second);
  f("step", std::vector<int>{state.step}, 0);
  f("sh_degree", std::vector<int>{state.scene.sh_degree}, 0);
  f("seed", std::vector<u64>{state.seed}, 0);
  if (vec3d const& o = state.origin; o != vec3d(0.0)) f("origin", std::vector<double>{o.x, o.y, o.z}, 0);
  for (auto const& [name, values] : state.parts.bytes) f(name, values, of_gaussians(name) ? sizeof(u32) : 0);
}

template <class T>
void append(std::string& out, T value) {
  out.append(reinterpret_cast<char const*>(&value), sizeof value);
}

std::string head_of(std::string const& name, u32 version, u64 bytes) {
  std::string out;
  append<u64>(out, name.size());
  out += name;
  append<u32>(out, version), append<u64>(out, bytes);
  return out;
}

constexpr u64 checksum_bytes = sizeof(u32);

u32 checksum_of(std::string const& bytes) { return crc32c(bytes.data(), bytes.size()); }

}  // namespace

checkpoint_rows::checkpoint_rows(training_state const& mine, row_owners const& owners) : owners_(owners) {
  for_each_state_array(mine, [&]<class T>(std::string const& name, std::vector<T> const& values, std::size_t width) {
    array a;
    a.name = name, a.row = width * sizeof(T), a.bytes = values.size() * sizeof(T);
    auto const* const bytes = reinterpret_cast<char const*>(values.data());
    if (width != 0)
      a.data = bytes;
    else if (owners.rank == 0)
      a.small.assign(bytes, bytes + a.bytes);
    else
      a.bytes = 0;
    arrays_.push_back(std::move(a));
  });
  std::sort(arrays_.begin(), arrays_.end(), [](array const& a, array const& b) { return a.name < b.name; });
}

std::vector<u64> checkpoint_rows::bytes() const {
  std::vector<u64> out;
  for (array const& a : arrays_) out.push_back(a.bytes);
  return out;
}

std::string checkpoint_rows::head(array const& a) const { return head_of(a.name, 1, a.total); }

void checkpoint_rows::place(std::vector<u64> const& bytes_of_all) {
  u64 at = magic_size;
  for (std::size_t i = 0; i < arrays_.size(); ++i) {
    array& a = arrays_[i];
    a.total = bytes_of_all[i], a.begin = at;
    at += head(a).size() + a.total + checksum_bytes;
  }
}

template <class F>
void checkpoint_rows::for_each_piece(array const& a, F const& f) const {
  if (a.row == 0) {
    if (a.bytes != 0) f(u64{0}, a.small.data(), a.bytes);
    return;
  }
  owners_.for_each_run(a.total / a.row,
                       [&](u64 first, u64 count, u64 row) { f(first * a.row, a.data + row * a.row, count * a.row); });
}

std::vector<u32> checkpoint_rows::checksum_shares() const {
  std::vector<u32> out;
  for (array const& a : arrays_) {
    u32 share = 0;
    if (std::string const start = head(a); owners_.rank == 0)
      share = crc32c_before(crc32c(start.data(), start.size()), a.total);
    for_each_piece(a, [&](u64 at, char const* data, u64 bytes) {
      share ^= crc32c_before(crc32c(data, bytes), a.total - at - bytes);
    });
    out.push_back(share);
  }
  return out;
}

void checkpoint_rows::write(shared_file& file, std::vector<u32> const& checksums) const {
  bool const first = owners_.rank == 0;
  if (first) file.write(0, magic, magic_size);
  u64 end = magic_size;
  for (std::size_t i = 0; i < arrays_.size(); ++i) {
    array const& a = arrays_[i];
    std::string const start = head(a);
    if (first) file.write(a.begin, start.data(), start.size());
    for_each_piece(a,
                   [&](u64 at, char const* data, u64 bytes) { file.write(a.begin + start.size() + at, data, bytes); });
    end = a.begin + start.size() + a.total + checksum_bytes;
    if (first) file.write(end - checksum_bytes, &checksums[i], checksum_bytes);
  }
  if (!first) return;
  std::string last = head_of("end", 1, 0);
  append<u32>(last, checksum_of(last));
  file.write(end, last.data(), last.size());
}

checkpoint_rows_reader::checkpoint_rows_reader(std::filesystem::path const& path, row_owners const& owners)
    : path_(path), owners_(owners), file_(path, std::ios::binary) {
  std::error_code code;
  size_ = std::filesystem::file_size(path, code);
  if (!file_ || code) throw io_error(path.string(), "cannot be opened", "check the path, and that every host has it");
  char start[magic_size] = {};
  if (size_ >= magic_size) read(0, start, magic_size);
  checked_ = std::memcmp(start, magic, magic_size) == 0;
  if (!checked_ && std::memcmp(start, plain_magic, magic_size) != 0) fail("is not a gart checkpoint");
  for (u64 at = magic_size;;) {
    array a;
    a.begin = at;
    auto const take = [&](void* to, u64 bytes) { read(at, to, bytes), at += bytes; };
    u64 length = 0;
    take(&length, sizeof length);
    if (length > longest_name) fail("is damaged: an array's name is too long");
    std::string name(length, '\0');
    take(name.data(), length);
    if (checked_) take(&a.version, sizeof a.version);
    take(&a.bytes, sizeof a.bytes);
    a.at = at;
    if (a.bytes > size_ - at) fail("is truncated or damaged: array " + name + " is longer than the file");
    at += a.bytes;
    if (checked_) take(&a.checksum, sizeof a.checksum);
    if (name == "end") {
      if (checked_ && a.checksum != checksum_of(head_of(name, a.version, a.bytes)))
        fail("is damaged: the checksum of its end is another");
      if (checked_ && at != size_) fail("is damaged: there is more after its end");
      break;
    }
    arrays_[name] = a;
  }
  std::vector<int> const degree = get<int>("sh_degree");
  if (degree.size() != 1 || degree[0] < 0 || degree[0] > 3) fail("is damaged: it is of no SH degree from 0 to 3");
  // All of a state; the names and the rows are used.
  training_state like;
  like.scene.sh_degree = like.first.sh_degree = like.second.sh_degree = degree[0];
  for (auto const& [name, array] : arrays_)
    if (of_gaussians(name)) like.parts.bytes[name];
  gaussians_ = find("opacity").bytes / sizeof(float);
  for_each_state_array(like, [&]<class T>(std::string const& name, std::vector<T> const&, std::size_t width) {
    auto const found = arrays_.find(name);
    if (width == 0 || found == arrays_.end()) return;
    found->second.row = width * sizeof(T);
    u64 const bytes = found->second.bytes;
    if (bytes != gaussians_ * found->second.row && !(bytes == 0 && of_gaussians(name)))
      fail("is damaged: its array " + name + " is not of its " + std::to_string(gaussians_) + " Gaussians");
  });
}

std::vector<std::string> checkpoint_rows_reader::names() const {
  std::vector<std::string> all;
  for (auto const& [name, array] : arrays_) all.push_back(name);
  return all;
}

void checkpoint_rows_reader::fail(std::string const& what) const {
  throw io_error(path_.string(), what, "take a checkpoint that was saved whole, or start anew");
}

checkpoint_rows_reader::array const& checkpoint_rows_reader::find(std::string const& name) const {
  auto const it = arrays_.find(name);
  if (it == arrays_.end()) fail("has no array " + name);
  return it->second;
}

void checkpoint_rows_reader::read(u64 at, void* to, u64 bytes) const {
  if (at > size_ || bytes > size_ - at) fail("is truncated: the last complete array is its last readable part");
  file_.seekg(static_cast<std::streamoff>(at));
  file_.read(static_cast<char*>(to), static_cast<std::streamsize>(bytes));
  if (!file_) throw io_error(path_.string(), "cannot be read", "check the disk, and that nothing is writing the file");
}

template <class T>
std::vector<T> checkpoint_rows_reader::get(std::string const& name, u32 newest_version) const {
  array const& a = find(name);
  if (a.version > newest_version) {
    fail("array " + name + " is of version " + std::to_string(a.version) + ", and this program reads up to " +
         std::to_string(newest_version) + ": a newer gart wrote it");
  }
  if (a.bytes % sizeof(T) != 0) fail("array " + name + " is not a whole number of elements");
  u64 const total = a.row ? a.bytes / a.row : 0;
  std::vector<T> values((a.row ? owners_.owned(total) * a.row : a.bytes) / sizeof(T));
  char* const to = reinterpret_cast<char*>(values.data());
  if (a.row == 0) read(a.at, to, a.bytes);
  owners_.for_each_run(
      total, [&](u64 first, u64 count, u64 row) { read(a.at + first * a.row, to + row * a.row, count * a.row); });
  if (!checked_) return values;
  std::string const start = head_of(name, a.version, a.bytes);
  u32 share = a.row == 0 || owners_.rank == 0 ? crc32c_before(crc32c(start.data(), start.size()), a.bytes) : 0;
  if (a.row == 0) {
    if ((share ^ crc32c(to, a.bytes)) != a.checksum)
      fail("is damaged: the checksum of array " + name + " is not that of its bytes");
    return values;
  }
  owners_.for_each_run(total, [&](u64 first, u64 count, u64 row) {
    share ^= crc32c_before(crc32c(to + row * a.row, count * a.row), a.bytes - (first + count) * a.row);
  });
  shares_.push_back(share), shared_.push_back(name);
  return values;
}

training_state checkpoint_rows_reader::state() const {
  training_state s;
  std::vector<int> const degree = get<int>("sh_degree"), step = get<int>("step");
  std::vector<u64> const seed = get<u64>("seed");
  if (degree.size() != 1 || step.size() != 1 || seed.size() != 1) fail("a counter is not one number");
  if (degree[0] < 0 || degree[0] > 3) fail("is damaged: it is of SH degree " + std::to_string(degree[0]));
  if (step[0] < 0 || step[0] == std::numeric_limits<int>::max())
    fail("is damaged: it was saved after step " + std::to_string(step[0]));
  auto const model = [&](std::string const& prefix) {
    gaussian_model m;
    m.sh_degree = degree[0];
    for_each_array([&](parameter_array const& a, auto& values) { values = get<float>(prefix + a.name); }, m);
    if (!m.arrays_agree()) fail("its arrays " + prefix + "* differ in length");
    return m;
  };
  s.scene = model(""), s.first = model("first/"), s.second = model("second/");
  if (s.first.size() != s.scene.size() || s.second.size() != s.scene.size())
    fail("its moments differ in number from its Gaussians");
  s.step = step[0], s.seed = seed[0];
  if (arrays_.count("origin")) {
    std::vector<double> const origin = get<double>("origin");
    if (origin.size() != 3) fail("its array origin is not three numbers");
    s.origin = {origin[0], origin[1], origin[2]};
  }
  std::set<std::string> own;
  for_each_state_array(s, [&](std::string const& name, auto const&, std::size_t) { own.insert(name); });
  for (std::string const& name : names()) {
    if (own.count(name)) continue;
    std::vector<char> const& values = s.parts.bytes[name] = get<char>(name);
    if (of_gaussians(name) && !values.empty() && values.size() != sizeof(u32) * s.scene.size())
      fail("its array " + name + " is not of its " + std::to_string(s.scene.size()) + " Gaussians");
  }
  std::vector<float> const growth = s.parts.get<float>("growth");
  if (growth.size() > 1 || (growth.size() == 1 && !(growth[0] > 0 && std::isfinite(growth[0]))))
    fail("is damaged: its growth is no factor");
  return s;
}

void checkpoint_rows_reader::require(std::vector<u32> const& checksums) const {
  for (std::size_t i = 0; i < checksums.size(); ++i)
    if (checksums[i] != find(shared_[i]).checksum)
      fail("is damaged: the checksum of array " + shared_[i] + " is not that of its bytes");
}

}  // namespace gart
