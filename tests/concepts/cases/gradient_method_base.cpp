// A method that trains: the trainer asks for what most methods leave to their base.
// expects: S::ordered
#include <gart/exec/parallel.hpp>
#include <gart/trace/bvh_tracer.hpp>
#include <gart/train/trainer.hpp>

#ifdef GART_WHOLE
struct again : gart::gradient_method_base {
#else
struct again {
#endif
  static constexpr char const* name = "again";
  template <int Size>
  using record = gart::record_none;
  using gather = gart::terms<>;
  using scatter = gart::terms<gart::term::color, gart::term::geometry>;
};

using exec = gart::serial_exec;
gart::trainer<exec, gart::scene_traits<0>, gart::bvh_tracer<exec>, again>* training = nullptr;
