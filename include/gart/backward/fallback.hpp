#pragma once
/// \file
/// A method and those that it falls back to. The first that fits into memory does the step.
///
///   backward_passes<frame<E, Traits, Tracer>, primitive_method> passes(exec);
///   passes.with_room(frame, byte_budget, [&](auto& pass) { pass.render(frame, targets); ... });

#include <gart/backward/backward.hpp>

namespace gart { inline namespace GART_ISA {

/// The passes of Method, of its fallback, of the fallback's fallback and so on.
template <class Frame, gradient_method Method>
class backward_passes {
  using fallback = typename Method::fallback;
  static constexpr bool is_last = std::is_void_v<fallback>;
  struct none {
    explicit none(typename Frame::execution_type&) {}
  };
  template <class S>
  struct rest_of {
    using type = backward_passes<Frame, S>;
  };

 public:
  /// Allocates nothing; `exec` must outlive it.
  explicit backward_passes(typename Frame::execution_type& exec) : pass_(exec), rest_(exec) {}

  /// Calls f with the first pass whose hit buffer has room (backward_pass.prepare), prepared. Errors: out_of_memory
  /// where none has.
  template <class F>
  void with_room(Frame const& frame, u64 byte_budget, F&& f) {
    if (pass_.prepare(frame, byte_budget))
      f(pass_);
    else if constexpr (is_last)
      throw pass_.out_of_memory_error();
    else
      rest_.with_room(frame, byte_budget, f);
  }

 private:
  backward_pass<Frame, Method> pass_;
  typename std::conditional_t<is_last, std::type_identity<none>, rest_of<fallback>>::type rest_;
};

}}  // namespace gart::GART_ISA
