#pragma once
/// \file
/// Training and rendering chosen at run time, by the compiled configurations: sessions, renderers, scores, tracking.

#include <gart/comm/mpi_comm.hpp>
#include <gart/io.hpp>
#include <gart/loss/affine_color.hpp>
#include <gart/loss/metrics.hpp>
#include <gart/runtime/capture_defaults.hpp>
#include <gart/runtime/evaluate.hpp>
#include <gart/runtime/initial.hpp>
#include <gart/runtime/instances.hpp>
#include <gart/runtime/matched_points.hpp>
#include <gart/runtime/model_file.hpp>
#include <gart/runtime/path_renderer.hpp>
#include <gart/runtime/renderer.hpp>
#include <gart/runtime/session.hpp>
#include <gart/runtime/shared_model.hpp>
#include <gart/runtime/track.hpp>
#include <gart/runtime/validation.hpp>
