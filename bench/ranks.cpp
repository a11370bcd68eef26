// Steps of training on the ranks that mpirun started, and their messages; rank 0 writes one line of JSON.
#include "support/scene.hpp"

#include <gart/comm/gathered.hpp>
#include <gart/comm/mpi_comm.hpp>
#include <gart/core/error.hpp>
#include <gart/exec/serial.hpp>
#include <gart/io/crc32c.hpp>
#include <gart/runtime/session.hpp>

#if defined(GART_WITH_NCCL)
#include <gart/comm/nccl_comm.hpp>
#endif

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <random>
#include <string>
#include <vector>

namespace {

using namespace gart;

constexpr char const* usage =
    "usage: mpirun -n N gart_bench_ranks [options]          one line of JSON, of the slowest rank\n"
    "  --model FILE.ply --cameras FILE.json | --gaussians N --size WxH\n"
    "  --degree N           of the colours' spherical harmonics, 0 to 3 (3)\n"
    "  --copies N           of the discs, each a share of the Gaussians: a view sees one, a rank makes its own rows\n"
    "  --steps N            steps that are timed (20), after 10 that are not\n"
    "  --batch N            views a step (1); as many as ranks: each rank takes a view\n"
    "  --backend NAME --backward NAME --threads N\n"
    "  --alone 1            the plain trainer, of one rank\n"
    "  --learn 1            usual rates in place of none, from the first step; its loss and the model's checksum "
    "count\n"
    "  --stages 1           time by stage instead of a step's, of each rank\n"
    "  --exchange MB        no steps: each rank sends so much to every other, of device memory and of the host's\n";

struct arguments {
  gart_bench::scene_options scene;
  int steps = 20, batch = 1, threads = 0;
  bool alone = false, learn = false, stages = false;
  double exchange_mb = 0;
  std::string backend = "auto", backward = "primitive";
};

bool parse(int argc, char** argv, arguments& a) {
  for (int i = 1; i < argc; i += 2) {
    if (i + 1 == argc) return false;
    std::string const name = argv[i], value = argv[i + 1];
    int const number = std::atoi(value.c_str());
    if (name == "--model")
      a.scene.model = value;
    else if (name == "--cameras")
      a.scene.cameras = value;
    else if (name == "--gaussians" && number > 0)
      a.scene.gaussians = static_cast<std::size_t>(number);
    else if (name == "--size" && std::sscanf(value.c_str(), "%dx%d", &a.scene.width, &a.scene.height) == 2)
      continue;
    else if (name == "--copies" && number > 0)
      a.scene.copies = number;
    else if (name == "--degree" && number >= 0 && number <= 3)
      a.scene.degree = number;
    else if (name == "--steps" && number > 0)
      a.steps = number;
    else if (name == "--batch" && number > 0)
      a.batch = number;
    else if (name == "--threads" && number >= 0)
      a.threads = number;
    else if (name == "--backend")
      a.backend = value;
    else if (name == "--backward")
      a.backward = value;
    else if (name == "--alone")
      a.alone = number != 0;
    else if (name == "--learn")
      a.learn = number != 0;
    else if (name == "--stages")
      a.stages = number != 0;
    else if (name == "--exchange" && (a.exchange_mb = std::atof(value.c_str())) > 0)
      continue;
    else
      return false;
  }
  return a.scene.copies == 1 || a.scene.model.empty();
}

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

// The largest of all ranks.
double largest(mpi_comm& ranks, double value) {
  std::vector<double> const all = gathered(ranks, value);
  return *std::max_element(all.begin(), all.end());
}

// Gigabytes a second that leave each rank.
template <class E, class Comm>
double exchange_rate(E& exec, Comm comm, mpi_comm& ranks, double megabytes) {
  std::size_t const bytes = static_cast<std::size_t>(megabytes * 1e6) / 16 * 16;
  auto const size = static_cast<std::size_t>(ranks.size());
  buffer<u8, E> out(exec, size * bytes), in(exec, size * bytes);
  out.zero();
  std::vector<message> sends, receives;
  for (int r = 0; r < ranks.size(); ++r) {
    if (r == ranks.rank()) continue;
    sends.push_back({r, out.data() + static_cast<std::size_t>(r) * bytes, bytes});
    receives.push_back({r, in.data() + static_cast<std::size_t>(r) * bytes, bytes});
  }
  constexpr int times = 10;
  double began = 0;
  for (int i = -3; i < times; ++i) {
    if (i == 0) exec.synchronize(), ranks.barrier(), began = seconds();
    comm.exchange(exec, {sends.data(), sends.size()}, {receives.data(), receives.size()});
  }
  exec.synchronize();
  double const took = largest(ranks, seconds() - began) / times;
  return static_cast<double>((size - 1) * bytes) / took * 1e-9;
}

void exchange(mpi_comm& ranks, arguments const& a) {
  std::string text = "{\"ranks\": " + std::to_string(ranks.size()) +
                     ", \"bytes_to_each\": " + std::to_string(static_cast<long long>(a.exchange_mb * 1e6));
  auto const add = [&](char const* name, double rate) {
    text += std::string(", \"") + name + "_gb_a_second\": " + std::to_string(rate);
  };
#if defined(GART_WITH_NCCL)
  if (!cuda_devices().empty()) {
    int const device = nccl_comm::device_of(ranks);
    cuda_exec exec(device);
    nccl_comm const best(ranks, device);
    if (best.transport() == device_transport::nccl)
      add("nccl", exchange_rate(exec, best, ranks, a.exchange_mb)), text += ", \"nccl\": \"" + best.version() + "\"";
    add("through_host", exchange_rate(exec, nccl_comm(ranks, device, device_transport::host), ranks, a.exchange_mb));
  }
#endif
  serial_exec host;
  add("host", exchange_rate(host, ranks, ranks, a.exchange_mb));
  if (ranks.rank() == 0) std::printf("%s}\n", text.c_str());
}

// Where this rank's time goes, milliseconds a step, as JSON.
std::string in_stages(profiler const& times, int steps) {
  std::string text = "{";
  for (auto const& [label, time] : times.stages()) {
    char number[32];
    std::snprintf(number, sizeof number, "%.4f", time.milliseconds / steps);
    text += (text.size() > 1 ? ", \"" : "\"") + label + "\": " + number;
  }
  return text + "}";
}

// Photographs of noise for the scene's cameras.
dataset captured(gart_bench::scene const& scene) {
  dataset data;
  std::mt19937 engine(7);
  for (auto const& [name, view] : scene.cameras) {
    dataset_view one;
    one.name = name, one.view = view;
    one.image = image8(view.width, view.height, 3);
    for (auto& byte : one.image.data) byte = static_cast<u8>(engine());
    data.train.push_back(std::move(one));
  }
  return data;
}

void steps(mpi_comm& ranks, arguments const& a) {
  bool const parts = a.scene.copies > 1;
  gart_bench::scene const scene =
      parts ? gart_bench::make_part(a.scene, {ranks.size(), ranks.rank()}) : gart_bench::make_scene(a.scene);
  dataset const data = captured(scene);
  configuration_request request;
  request.backend = from_string(a.backend, backend_kind::automatic), request.backward = a.backward;
  request.threads = a.threads, request.sh_degree = a.scene.degree;
  if (!a.alone) request.ranks = &ranks;
  train_options options;
  int const warm = a.learn ? 0 : 10;
  options.iterations = (a.steps + warm) * a.batch, options.sh_every = 1, options.batch = a.batch;
  options.densify = densify_kind::none, options.background = background_kind::black;
  if (!a.learn) options.rates = {0, 0, 0, 0, 0, 0, 0};
  auto const run = make_session(request, options, data, start_model(scene.model, parts && !a.alone));
  float loss = 0;
  for (int i = 0; i < warm; ++i) run->step();
  if (a.stages) run->profile().clear(), run->profile().enable(true);
  u64 const sent = run->sent_bytes();
  ranks.barrier();
  double const began = seconds();
  for (int i = 0; i < a.steps; ++i) loss = run->step().loss;
  profiler const& times = run->profile();  // waits
  double const took = largest(ranks, seconds() - began) / a.steps;
  double const most_sent = largest(ranks, static_cast<double>(run->sent_bytes() - sent)) / a.steps,
               peak = largest(ranks, static_cast<double>(run->peak_bytes())),
               lt = largest(ranks, static_cast<double>(run->hit_buffer_bytes()));
  u32 checksum = 0;
  if (a.learn) {
    gaussian_model const model = run->model();
    for_each_array([&](parameter_array const&, auto const& v) { checksum = crc32c(v.data(), 4 * v.size(), checksum); },
                   model);
  }
  std::vector<std::string> const stages = gathered(ranks, a.stages ? in_stages(times, a.steps) : std::string());
  if (ranks.rank() != 0) return;
  configuration_info const c = run->configuration();
  std::printf(
      "{\"ranks\": %d, \"backend\": \"%s\", \"tracer\": \"%s\", \"backward\": \"%s\", \"gaussians\": %zu, "
      "\"sh_degree\": %d, "
      "\"width\": %d, \"height\": %d, \"batch\": %d, \"step_ms\": %.4f, \"images_a_second\": %.3f, "
      "\"sent_bytes\": %.0f, \"peak_bytes\": %.0f, \"hit_buffer_bytes\": %.0f, \"loss\": %.9g",
      ranks.size(), to_string(c.backend), to_string(c.tracer), c.backward.c_str(),
      parts ? a.scene.gaussians : scene.model.size(), scene.model.sh_degree, scene.view().width, scene.view().height,
      a.batch, 1e3 * took, a.batch / took, most_sent, peak, lt, static_cast<double>(loss));
  if (a.learn) std::printf(", \"checksum\": \"%08x\"", checksum);
  if (a.stages) {
    std::printf(", \"stages_ms\": %s", stages[0].c_str());
    for (std::size_t r = 1; r < stages.size(); ++r)
      std::printf("%s%s", r == 1 ? ", \"stages_ms_of_others\": [" : ", ", stages[r].c_str());
    if (stages.size() > 1) std::printf("]");
  }
  std::printf("}\n");
}

}  // namespace

int main(int argc, char** argv) {
  arguments a;
  if (!parse(argc, argv, a)) {
    std::fputs(usage, stderr);
    return 2;
  }
  mpi_comm ranks;
  try {
    a.exchange_mb > 0 ? exchange(ranks, a) : steps(ranks, a);
  } catch (std::exception const& error) {
    std::fprintf(stderr, "gart_bench_ranks: rank %d: %s\n", ranks.rank(), error.what());
    std::fflush(stderr);
    if (ranks.size() > 1) ranks.abort(1);
    return 1;
  }
  return 0;
}
