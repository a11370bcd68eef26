#pragma once
/// \file
/// Memory that a policy owns: move-only, growing only, with slack. A size that changes a little every step does not
/// allocate. Its policy must outlive it.
///
/// A buffer converts to span<T> and span<T const>; where a function deduces T from a span, pass view().
/// Errors: out_of_memory from the policy; the buffer is then empty.

#include <gart/core/span.hpp>
#include <gart/exec/concepts.hpp>

#include <type_traits>
#include <utility>
#include <vector>

namespace gart {

/// [size] elements in the memory of a policy.
template <class T, execution E>
class buffer {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  /// What growth allocates, times what was asked for.
  static constexpr double slack = 1.25;

  buffer() = default;
  /// Of n elements, undefined.
  explicit buffer(E& exec, std::size_t n = 0) : exec_(&exec) { resize(n); }
  /// A copy of the host's elements.
  buffer(E& exec, std::vector<T> const& host) : exec_(&exec) { assign(host); }
  ///@{
  /// The other is left empty.
  buffer(buffer&& other) noexcept { swap(other); }
  buffer& operator=(buffer&& other) noexcept {
    buffer moved(std::move(other));
    swap(moved);
    return *this;
  }
  ///@}
  ~buffer() { release(); }

  /// Elements.
  std::size_t size() const { return size_; }
  /// The number of elements that memory suffices for.
  std::size_t capacity() const { return capacity_; }
  /// In the policy's memory; null where nothing was allocated.
  T* data() const { return data_; }
  /// All elements.
  span<T> view() const { return {data_, size_}; }
  ///@{
  /// All elements, where a function asks for a span.
  operator span<T>() const { return view(); }
  operator span<T const>() const { return {data_, size_}; }
  ///@}
  /// The policy whose memory it is.
  E& exec() const { return *exec_; }

  /// Contents are undefined after a growth. The first allocation is exact, because most sizes never change; growth has
  /// slack.
  void resize(std::size_t n) {
    if (n > capacity_) {
      std::size_t const wanted = capacity_ ? static_cast<std::size_t>(static_cast<double>(n) * slack) : n;
      release();
      data_ = static_cast<T*>(exec_->allocate(bytes_of(wanted)));
      capacity_ = wanted;
    }
    size_ = n;
  }
  /// Keeps the contents; the rest is undefined.
  void resize_keep(std::size_t n) {
    if (size_ == 0) return resize(n);
    if (n > capacity_) reserve(static_cast<std::size_t>(static_cast<double>(n) * slack));
    size_ = n;
  }
  /// Makes room for exactly n elements in all, where there is less. An array whose final size is known grows without
  /// slack and without a copy. Keeps the contents.
  void reserve(std::size_t n) {
    if (n <= capacity_) return;
    buffer grown(*exec_, n);
    if (size_) exec_->copy(grown.data_, data_, size_ * sizeof(T));
    grown.size_ = size_;
    swap(grown);
  }
  /// Sets every byte to 0.
  void zero() { exec_->zero(data_, size_ * sizeof(T)); }
  ///@{
  /// A copy of the host's elements takes the place of all.
  void assign(span<T const> host) {
    resize(host.size());
    exec_->copy_in(data_, host.data(), host.size() * sizeof(T));
  }
  void assign(std::vector<T> const& host) { assign(span<T const>(host)); }
  ///@}
  /// A copy for the host; waits for it.
  std::vector<T> to_host() const {
    std::vector<T> out(size_);
    if (size_) exec_->copy_out(out.data(), data_, size_ * sizeof(T));
    return out;
  }
  /// The first element; the buffer must not be empty.
  T front() const {
    T value;
    exec_->copy_out(&value, data_, sizeof(T));
    return value;
  }
  /// Gives the memory back.
  void release() {
    if (data_) exec_->deallocate(data_, capacity_ * sizeof(T));
    data_ = nullptr;
    size_ = capacity_ = 0;
  }

 private:
  // A size beyond the address space becomes half of it, which no policy has. The product must not wrap to an
  // allocatable size.
  static std::size_t bytes_of(std::size_t n) {
    std::size_t const half = static_cast<std::size_t>(-1) / 2;
    return n > half / sizeof(T) ? half : n * sizeof(T);
  }
  void swap(buffer& other) noexcept {
    std::swap(exec_, other.exec_);
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    std::swap(capacity_, other.capacity_);
  }
  E* exec_ = nullptr;
  T* data_ = nullptr;
  std::size_t size_ = 0, capacity_ = 0;
};

}  // namespace gart
