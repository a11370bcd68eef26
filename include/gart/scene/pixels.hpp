#pragma once
/// \file
/// The values of an image: an array of its own, like std::vector, or memory that others hold too. The ranks of a host
/// hold a capture's images once (comm/host_group.hpp).

#include <gart/core/span.hpp>

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <memory>
#include <utility>
#include <vector>

namespace gart {

/// Values of T, one after the other. A copy is an array of its own.
template <class T>
class pixels {
 public:
  using value_type = T;  ///< of each

  ///@{
  /// As of a std::vector.
  pixels() = default;
  explicit pixels(std::size_t n, T value = T{}) : own_(n, value) { mine(); }
  pixels(std::vector<T> values) : own_(std::move(values)) { mine(); }
  pixels(std::initializer_list<T> values) : own_(values) { mine(); }
  pixels(pixels const& other) : own_(other.begin(), other.end()) { mine(); }
  pixels(pixels&& other) noexcept { swap(other); }
  pixels& operator=(pixels other) noexcept {
    swap(other);
    return *this;
  }
  ~pixels() = default;
  T* data() { return begin_; }
  T const* data() const { return begin_; }
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  T* begin() { return begin_; }
  T* end() { return begin_ + size_; }
  T const* begin() const { return begin_; }
  T const* end() const { return begin_ + size_; }
  T& operator[](std::size_t i) { return begin_[i]; }
  T const& operator[](std::size_t i) const { return begin_[i]; }
  void resize(std::size_t n, T value = T{}) {
    if (shared_) own_.assign(begin(), end());
    own_.resize(n, value), mine();
  }
  void assign(std::size_t n, T value) { own_.assign(n, value), mine(); }
  friend bool operator==(pixels const& a, pixels const& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end());
  }
  ///@}
  /// n values that are held as long as `values` is, and are nobody's to change.
  pixels(std::shared_ptr<T> values, std::size_t n) : shared_(std::move(values)), begin_(shared_.get()), size_(n) {}
  ///@{
  /// All of them.
  operator span<T>() { return {begin_, size_}; }
  operator span<T const>() const { return {begin_, size_}; }
  ///@}
  /// A copy.
  operator std::vector<T>() const { return {begin(), end()}; }

 private:
  void mine() { shared_.reset(), begin_ = own_.data(), size_ = own_.size(); }
  void swap(pixels& other) noexcept {
    own_.swap(other.own_), shared_.swap(other.shared_);
    std::swap(begin_, other.begin_), std::swap(size_, other.size_);
  }
  std::vector<T> own_;
  std::shared_ptr<T> shared_;
  T* begin_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace gart
