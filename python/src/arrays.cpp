#include "arrays.hpp"

#include <cstring>

namespace gart_python {

namespace {

std::string shape_text(std::vector<std::int64_t> const& shape) {
  std::string out;
  for (std::int64_t const n : shape)
    out += (out.empty() ? "" : ", ") + (n < 0 ? std::string("any") : std::to_string(n));
  return "[" + out + "]";
}

// The element of a buffer's format: a code and bits of DLPack, or none.
std::pair<int, int> element_of(char const* format, Py_ssize_t item_bytes) {
  if (!format) return {1, 8};
  if (std::strchr("@=<", *format) && *format) ++format;
  if (!*format || format[1]) return {-1, 0};
  int const bits = static_cast<int>(8 * item_bytes);
  if (std::strchr("fde", *format)) return {2, bits};
  if (std::strchr("BHILQ", *format)) return {1, bits};
  if (std::strchr("bhilq", *format)) return {0, bits};
  if (*format == '?') return {1, bits};
  return {-1, 0};
}

// Strides in any unit, of the length of an item in it.
template <class Stride>
bool c_order(std::vector<std::int64_t> const& shape, Stride const* strides, std::int64_t item) {
  if (!strides) return true;
  std::int64_t expected = item;
  for (std::size_t k = shape.size(); k-- > 0;) {
    if (shape[k] > 1 && strides[k] != expected) return false;
    expected *= shape[k];
  }
  return true;
}

// None where there is no buffer, and where what has DLPack refuses one. Arrays of CuPy and JAX on a device do so.
std::unique_ptr<Py_buffer> buffer_of(py::handle argument, bool& writable) {
  if (!PyObject_CheckBuffer(argument.ptr())) return nullptr;
  auto out = std::make_unique<Py_buffer>();
  int const flags = PyBUF_FORMAT | PyBUF_STRIDES;
  writable = PyObject_GetBuffer(argument.ptr(), out.get(), flags | PyBUF_WRITABLE) == 0;
  if (writable) return out;
  PyErr_Clear();
  if (PyObject_GetBuffer(argument.ptr(), out.get(), flags) == 0) return out;
  py::python_error const refused;
  if (!py::hasattr(argument, "__dlpack__")) throw refused;
  return nullptr;
}

// The capsule itself, as torch.utils.dlpack.to_dlpack makes it, where the caller keeps the order of work.
py::object capsule_of(py::handle argument, wanted const& w, place const& where) {
  if (PyCapsule_IsValid(argument.ptr(), "dltensor")) return py::borrow(argument);
  if (!py::hasattr(argument, "__dlpack__"))
    throw gart::invalid_argument(std::string(w.name) +
                                 " must be an array: an object with the buffer protocol or with " + "__dlpack__, not " +
                                 py::cast<std::string>(py::repr(argument.attr("__class__"))));
  auto const device = py::cast<std::pair<int, int>>(argument.attr("__dlpack_device__")());
  if (device.first != dl_cuda || !where.cuda) return argument.attr("__dlpack__")();
  return argument.attr("__dlpack__")(py::arg("stream") = reinterpret_cast<std::intptr_t>(where.stream));
}

}  // namespace

std::size_t lent::size() const {
  std::size_t n = 1;
  for (std::int64_t const one : shape_) n *= static_cast<std::size_t>(one);
  return n;
}

lent lent::take(py::handle argument, wanted const& w, place const& where) {
  lent out;
  if (auto buffer = buffer_of(argument, out.writable_)) {
    Py_buffer const& b = *buffer;
    out.data_ = b.buf;
    out.shape_.assign(b.shape, b.shape + b.ndim);
    auto const [code, bits] = element_of(b.format, b.itemsize);
    out.type_ = {static_cast<std::uint8_t>(code), static_cast<std::uint8_t>(bits)};
    out.in_order_ = c_order(out.shape_, b.strides, b.itemsize);
    out.kept_ = std::shared_ptr<void>(buffer.release(), [](void* p) {
      PyBuffer_Release(static_cast<Py_buffer*>(p));
      delete static_cast<Py_buffer*>(p);
    });
    return out;
  }
  py::object const capsule = capsule_of(argument, w, where);
  auto* managed = static_cast<dl_managed_tensor*>(PyCapsule_GetPointer(capsule.ptr(), "dltensor"));
  if (!managed) throw py::python_error();
  PyCapsule_SetName(capsule.ptr(), "used_dltensor");
  out.kept_ = std::shared_ptr<void>(managed, [](void* p) {
    auto* m = static_cast<dl_managed_tensor*>(p);
    if (m->deleter) m->deleter(m);
  });
  dl_tensor const& t = managed->tensor;
  bool const on_device = t.device.type == dl_cuda || t.device.type == dl_cuda_managed;
  if (!on_device && t.device.type != dl_cpu && t.device.type != dl_cuda_host)
    throw gart::invalid_argument(std::string(w.name) +
                                 " must be on the host or on a CUDA device, and lies on a device " +
                                 "of DLPack's type " + std::to_string(t.device.type));
  out.data_ = static_cast<char*>(t.data) + t.byte_offset;
  out.shape_.assign(t.shape, t.shape + t.dimensions);
  out.type_ = {t.type.code, t.type.lanes == 1 ? t.type.bits : std::uint8_t{0}};
  out.in_order_ = c_order(out.shape_, t.strides, 1);
  out.writable_ = true;
  out.where_.cuda = on_device, out.where_.device = t.device.id;
  return out;
}

std::string lent::described() const {
  static constexpr char const* kinds[] = {"int", "uint", "float"};
  std::string const type = type_.code < 3 ? kinds[type_.code] + std::to_string(type_.bits) : "of another type";
  return type + " " + shape_text(shape_) + (in_order_ ? "" : ", not contiguous") +
         (where_.cuda ? " on cuda:" + std::to_string(where_.device) : " on the host") +
         (writable_ ? "" : ", read only");
}

void lent::require(wanted const& w, place const& where, element type) const {
  bool fits = shape_.size() == w.shape.size();
  for (std::size_t k = 0; fits && k < w.shape.size(); ++k) fits = w.shape[k] < 0 || w.shape[k] == shape_[k];
  // Signs are not looked at: torch had no unsigned words for long.
  bool const same_type = type_ == type || (type.code == 1 && type_.code == 0 && type.bits == type_.bits);
  bool const there = where.cuda == where_.cuda && (!where.cuda || where.device == where_.device);
  if (fits && same_type && there && in_order_ && (writable_ || !w.writable)) return;
  throw gart::invalid_argument(std::string(w.name) + " must be " + (type.code == 2 ? "float" : "uint") +
                               std::to_string(type.bits) + " " + shape_text(w.shape) + ", contiguous, " +
                               (where.cuda ? "on cuda:" + std::to_string(where.device) : "on the host") +
                               (w.writable ? " and writable" : "") + "; it is " + described());
}

}  // namespace gart_python
