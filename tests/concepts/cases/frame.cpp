// A frame of a tracer that finds the hits of another response than the scene's.
// expects: hits of another response
#include <gart/exec/parallel.hpp>
#include <gart/render/frame.hpp>
#include <gart/trace/bvh_tracer.hpp>

using exec = gart::serial_exec;
#ifdef GART_WHOLE
using response = gart::generalized_gaussian<4>;
#else
using response = gart::generalized_gaussian<2>;
#endif
using traits = gart::scene_traits<1, gart::generalized_gaussian<4>>;
template class gart::frame<exec, traits, gart::bvh_tracer<exec, response>>;
