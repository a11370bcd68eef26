#pragma once
/// \file
/// Everything that is safe in any host translation unit: captures and models in and out, training and rendering over
/// rows chosen at run time, and the templates on the host policies. Kernels on CUDA need nvcc and exec/cuda_launch.cuh
/// first.

#include <gart/backward/backward.hpp>
#include <gart/bvh/walk.hpp>
#include <gart/camera/models.hpp>
#include <gart/comm/mpi_comm.hpp>
#include <gart/comm/self_comm.hpp>
#include <gart/core/version.hpp>
#include <gart/exec/cuda.hpp>
#include <gart/exec/parallel.hpp>
#include <gart/io/camera_file.hpp>
#include <gart/io/dataset.hpp>
#include <gart/io/image_file.hpp>
#include <gart/io/ply.hpp>
#include <gart/io/splat_file.hpp>
#include <gart/loss/affine_color.hpp>
#include <gart/loss/metrics.hpp>
#include <gart/pose/differentiate_pose.hpp>
#include <gart/reference/reference.hpp>
#include <gart/render/frame.hpp>
#include <gart/runtime/choose.hpp>
#include <gart/runtime/degree_selection.hpp>
#include <gart/runtime/evaluate.hpp>
#include <gart/runtime/initial.hpp>
#include <gart/runtime/model_file.hpp>
#include <gart/runtime/presets.hpp>
#include <gart/runtime/renderer.hpp>
#include <gart/runtime/session.hpp>
#include <gart/runtime/track.hpp>
#include <gart/scene/similarity.hpp>
#include <gart/trace/bvh_tracer.hpp>
#include <gart/trace/tile_tracer.hpp>
#include <gart/train/trainer.hpp>
