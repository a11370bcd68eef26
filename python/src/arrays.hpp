#pragma once
// Memory of other Python libraries, and theirs of ours, without a copy. An argument lends its memory by the buffer
// protocol (numpy, bytes, memoryview) or by DLPack (torch, CuPy, JAX, numpy). What gart makes on the host becomes a
// numpy array that owns it.

#include "dlpack.hpp"
#include "py.hpp"

#include <gart/core/error.hpp>
#include <gart/scene/image.hpp>

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace gart_python {

// Where memory lies.
struct place {
  bool cuda = false;
  int device = 0;
  // What a producer is told to order its work before: a cudaStream_t, or null.
  void* stream = nullptr;
};

// What an argument must be. -1: any length.
struct wanted {
  char const* name;  // "Renderer.bind: mean"
  std::vector<std::int64_t> shape;
  bool writable = false;
};

// The memory of an argument, which stays as long as this.
class lent {
 public:
  lent() = default;
  // Errors: invalid_argument, naming the argument, for another type, shape, order or place.
  template <class T>
  static lent of(py::handle argument, wanted const& w, place const& where = {}) {
    lent out = take(argument, w, where);
    out.require(w, where, kind_of<T>());
    return out;
  }
  // The same of None: nothing.
  template <class T>
  static lent if_given(py::handle argument, wanted const& w, place const& where = {}) {
    return argument.is_none() ? lent() : of<T>(argument, w, where);
  }
  // Of either type on the host; a refusal asks for the second.
  template <class T, class Else>
  static lent of_either(py::handle argument, wanted const& w) {
    lent out = take(argument, w, {});
    out.require(w, {}, out.holds<T>() ? kind_of<T>() : kind_of<Else>());
    return out;
  }

  template <class T>
  T* data() const {
    return static_cast<T*>(data_);
  }
  template <class T>
  bool holds() const {
    return type_ == kind_of<T>();
  }
  std::vector<std::int64_t> const& shape() const { return shape_; }
  std::size_t size() const;

 private:
  struct element {
    std::uint8_t code = 0, bits = 0;
    bool operator==(element const&) const = default;
  };
  template <class T>
  static constexpr element kind_of() {
    std::uint8_t const bits = 8 * sizeof(T);
    return {std::is_floating_point_v<T> ? std::uint8_t{2} : std::uint8_t{1}, bits};
  }
  static lent take(py::handle argument, wanted const& w, place const& where);
  void require(wanted const& w, place const& where, element type) const;
  std::string described() const;

  void* data_ = nullptr;
  std::vector<std::int64_t> shape_;
  element type_;
  bool writable_ = false, in_order_ = true;
  place where_;
  std::shared_ptr<void> kept_;  // let go with the interpreter's lock held
};

// A numpy array of this shape that owns what it is given.
template <class Values>
py::object owned_array(std::vector<std::int64_t> const& shape, Values values) {
  using T = std::remove_cvref_t<decltype(*values.data())>;
  auto kept = std::make_unique<Values>(std::move(values));
  T* const data = kept->data();
  py::capsule const owner(kept.get(), [](void* p) noexcept { delete static_cast<Values*>(p); });
  kept.release();
  return py::numpy_array<T>(shape, data, owner);
}
// One that shows memory which `owner` keeps.
template <class T>
py::object shown_array(std::vector<std::int64_t> const& shape, T* data, py::handle owner) {
  using written = std::remove_const_t<T>;
  return py::numpy_array<written>(shape, const_cast<written*>(data), owner);
}

// [height, width], and channels where there is not just one.
template <class T>
py::object image_array(gart::basic_image<T> image) {
  std::vector<std::int64_t> shape{image.height, image.width};
  if (image.channels != 1) shape.push_back(image.channels);
  return owned_array(shape, std::move(image.data));
}

}  // namespace gart_python
