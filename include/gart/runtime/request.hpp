#pragma once
/// \file
/// Which of the compiled configurations computes, and where: what make_session and make_renderer take.
/// Errors: resolve throws unsupported, naming the configurations there are and how to compile one, for a request that
/// none meets.

#include <gart/runtime/kinds.hpp>

#include <string>
#include <vector>

namespace gart {

class mpi_comm;

/// `automatic`, "auto" and 0: the best there is on this machine.
struct configuration_request {
  backend_kind backend = backend_kind::automatic;  ///< where it computes
  tracer_kind tracer = tracer_kind::automatic;     ///< what finds the hits
  std::string backward = "auto";  ///< a method by its name (backward/gradient_methods.hpp), or one of a program's own
  int sh_degree = 3;              ///< of the spherical harmonics of colour, 0 to 3
  int kernel_degree = 2;          ///< of the generalised Gaussians (math/response.hpp)
  hit_format_kind hit_format = hit_format_kind::automatic;  ///< of the slots of the hit buffer
  bool depth = false;  ///< gradients of depth and transmittance too; training by depth_weight asks for it itself
  int threads = 0;     ///< of the openmp policy; 0: as many as OpenMP gives
  int device = 0;      ///< of the cuda policy; ranks take a host's GPUs in turn
  /// The cuda policy's stream: the caller's cudaStream_t (cudaStreamLegacy for the default one), or null for its own.
  void* stream = nullptr;
  /// The ranks that train together (comm/mpi_comm.hpp); all make the same calls. Null: this process by itself. Must
  /// outlive the session or renderer made for the request.
  mpi_comm const* ranks = nullptr;
};

/// One that was compiled.
struct configuration_info {
  backend_kind backend = backend_kind::automatic;  ///< where it computes
  tracer_kind tracer = tracer_kind::automatic;     ///< what finds the hits
  std::string backward;                            ///< the method's name
  int sh_degree = 3;      ///< of the model's coefficients; of compiled_configurations() the highest
  int stored_degree = 3;  ///< that rows of coefficients have room for in the policy's memory
  int kernel_degree = 2;  ///< of the generalised Gaussians
  hit_format_kind hit_format = hit_format_kind::none;  ///< of the slots of the hit buffer
  bool depth = false;                                  ///< gradients of depth and transmittance too
  bool ranks = false;                                  ///< trains on several ranks
  std::string instruction_set = "";  ///< that a host configuration was compiled for (core/isa.hpp); empty on a device
};

/// A request with everything decided.
configuration_info resolve(configuration_request const& request);
/// All that were compiled in.
std::vector<configuration_info> compiled_configurations();

}  // namespace gart
