// expects: c.exclusive_scan
#include <gart/comm/communicator.hpp>
#include <gart/exec/serial.hpp>

struct mine {
  static constexpr bool alone = false;
  int rank() const { return 0; }
  int size() const { return 1; }
  int sharers() const { return 1; }
  template <class E>
  void exchange(E&, gart::span<gart::message const>, gart::span<gart::message const>) {}
  template <class E>
  void begin(E&, gart::span<gart::message const>, gart::span<gart::message const>) {}
  template <class E>
  void finish(E&) {}
  void exchange(gart::span<gart::message const>, gart::span<gart::message const>) {}
  void all_gather(void const*, void*, std::size_t) {}
  void all_reduce(gart::span<double>) {}
  void all_reduce(gart::span<gart::u64>) {}
#ifdef GART_WHOLE
  gart::u64 exclusive_scan(gart::u64) { return 0; }
#else
  gart::u64 exclusive_sum(gart::u64) { return 0; }
#endif
  void broadcast(void*, std::size_t, int) {}
  void barrier() {}
  std::unique_ptr<gart::shared_file> open_file(std::filesystem::path const&, bool) { return {}; }
};
static_assert(gart::communicator<mine, gart::serial_exec>);
