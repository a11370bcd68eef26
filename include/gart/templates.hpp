#pragma once
/// \file
/// The templates of training, rendering, rays, paths and the reference, on the host policies. Kernels on CUDA need nvcc
/// and exec/cuda_launch.cuh first.

#include <gart/actors/actor_tracer.hpp>
#include <gart/backward/backward.hpp>
#include <gart/bvh/walk.hpp>
#include <gart/camera/models.hpp>
#include <gart/comm/self_comm.hpp>
#include <gart/exec/cuda.hpp>
#include <gart/exec/parallel.hpp>
#include <gart/instances/instance_set.hpp>
#include <gart/instances/instance_track.hpp>
#include <gart/lens/differentiate_lens.hpp>
#include <gart/light/path_tracer.hpp>
#include <gart/pose/differentiate_pose.hpp>
#include <gart/rays/ray_tracer.hpp>
#include <gart/reference/reference.hpp>
#include <gart/render/frame.hpp>
#include <gart/trace/bvh_tracer.hpp>
#include <gart/trace/tile_tracer.hpp>
#include <gart/train/trainer.hpp>
