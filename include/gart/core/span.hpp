#pragma once
/// \file
/// A pointer and a length that device code may hold: what kernels receive of a buffer.

#include <gart/core/macros.hpp>
#include <gart/core/types.hpp>

#include <type_traits>
#include <vector>

namespace gart {

/// [size] elements that somebody else owns.
template <class T>
class span {
 public:
  using value_type = std::remove_const_t<T>;  ///< of an element

  constexpr span() = default;
  /// Of `size` elements from `data` on.
  GART_HD constexpr span(T* data, std::size_t size) : data_(data), size_(size) {}
  /// Of the same elements, which can be read alone.
  template <class U>
  requires std::is_same_v<U const, T> GART_HD constexpr span(span<U> other)
      : data_(other.data()), size_(other.size()) {}
  ///@{
  /// Of all elements of a vector.
  span(std::vector<value_type>& v) requires(!std::is_const_v<T>) : data_(v.data()), size_(v.size()) {}
  span(std::vector<value_type> const& v) requires(std::is_const_v<T>) : data_(v.data()), size_(v.size()) {}
  ///@}

  /// The address of the first element.
  GART_HD constexpr T* data() const { return data_; }
  /// How many elements.
  GART_HD constexpr std::size_t size() const { return size_; }
  /// Whether there is no element.
  GART_HD constexpr bool empty() const { return size_ == 0; }
  /// Element i, below size().
  GART_HD constexpr T& operator[](std::size_t i) const { return data_[i]; }
  ///@{
  /// Elements, in order.
  GART_HD constexpr T* begin() const { return data_; }
  GART_HD constexpr T* end() const { return data_ + size_; }
  ///@}
  /// `count` elements from `offset` on, which are there.
  GART_HD constexpr span subspan(std::size_t offset, std::size_t count) const { return {data_ + offset, count}; }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace gart
