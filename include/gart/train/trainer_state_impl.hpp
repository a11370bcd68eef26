#pragma once
/// \file
/// The bodies of trainer.hpp for states, checkpoints and models, of one rank and of all.

#include <gart/train/trainer.hpp>

namespace gart { inline namespace GART_ISA {

template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
train_options const& basic_trainer<E, Traits, Tracer, Method, Comm>::checked(E& exec, Comm& comm,
                                                                             train_options const& options,
                                                                             dataset const& data,
                                                                             start_model const& start) {
  require_options(options);
  if (Comm::alone && options.batch > 1)
    throw invalid_argument("train_options.batch needs a trainer that has a communicator");
  require_room(exec, comm, options, data, sh_degree, total_of(comm, start));
  return options;
}

template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
u64 basic_trainer<E, Traits, Tracer, Method, Comm>::total_of(Comm& comm, start_model const& start) {
  if (start.rows.sh_degree > sh_degree)
    throw invalid_argument("trainer: the model to start from has a higher SH degree than the trainer's traits");
  u64 total = start.rows.size();
  if (start.is_part) comm.all_reduce(span<u64>(&total, 1));
  return total;
}

template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
gaussian_model basic_trainer<E, Traits, Tracer, Method, Comm>::gather_all(gaussian_model mine, int root) const {
  if constexpr (Comm::alone)
    return mine;
  else
    return plans_.ranks.rows().gather_all(mine, root);
}

// This rank's rows, and the shared rest.
template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
training_state basic_trainer<E, Traits, Tracer, Method, Comm>::here() const {
  training_state s;
  s.scene = gaussians_.to_host(gaussians_.model);
  s.first = gaussians_.to_host(gaussians_.moments.first), s.second = gaussians_.to_host(gaussians_.moments.second);
  s.step = progress_.step, s.seed = options_.seed, s.origin = data_.origin;
  densifier_->save(s.parts);
  for (auto const& part : parts_) part->save(s.parts);
  return s;
}

template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
void basic_trainer<E, Traits, Tracer, Method, Comm>::take_up(training_state const& s) {
  if (s.scene.sh_degree != gaussians_.degree) throw invalid_argument("trainer: the state has another SH degree");
  if (s.origin != data_.origin)
    throw invalid_argument("trainer: the state is from the origin " + to_text(s.origin) + ", the capture from " +
                           to_text(data_.origin) + " (dataset_options.origin holds it from that)");
  if (s.seed != options_.seed)
    throw invalid_argument("trainer: the state is of seed " + std::to_string(s.seed) + ", the options of " +
                           std::to_string(options_.seed) + ", and draws would be of neither run");
  for (auto const& part : parts_) part->load(s.parts);
  gaussians_.assign(s.scene, s.first, s.second);
  gaussians_.total = static_cast<index_t>(total_of(comm_, {s.scene, true}));
  densifier_->load(s.parts);
  views_.order = view_order(data_.train.size(), options_.held_out, options_.seed);
  progress_.step = s.step;
}

template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
training_state basic_trainer<E, Traits, Tracer, Method, Comm>::state() const {
  training_state s = here();
  if constexpr (!Comm::alone) {
    for (gaussian_model* each : {&s.scene, &s.first, &s.second}) *each = gather_all(std::move(*each));
    for (auto& [name, values] : s.parts.bytes)
      if (of_gaussians(name)) values = plans_.ranks.rows().gather_all(values, sizeof(u32));
  }
  return s;
}

template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
void basic_trainer<E, Traits, Tracer, Method, Comm>::set_state(training_state const& all) {
  if constexpr (Comm::alone) {
    take_up(all);
  } else {
    training_state mine = all;
    for (gaussian_model* each : {&mine.scene, &mine.first, &mine.second}) *each = plans_.ranks.rows().local_part(*each);
    for (auto& [name, values] : mine.parts.bytes)
      if (of_gaussians(name)) values = plans_.ranks.rows().local_part(values, sizeof(u32));
    take_up(mine);
  }
}

template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
void basic_trainer<E, Traits, Tracer, Method, Comm>::save(std::filesystem::path const& path) const {
  if constexpr (Comm::alone)
    write_checkpoint(path, here());
  else
    write_checkpoint_collectively(comm_, plans_.ranks.rows().owners(), path, here());
}

template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
void basic_trainer<E, Traits, Tracer, Method, Comm>::load(std::filesystem::path const& path) {
  training_state const mine = [&] {
    if constexpr (Comm::alone)
      return read_checkpoint(path);
    else
      return read_checkpoint_collectively(comm_, plans_.ranks.rows().owners(), path);
  }();
  require_degree(path, mine, gaussians_.degree);
  require_seed(path, mine, options_.seed);
  take_up(mine);
}

template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
void basic_trainer<E, Traits, Tracer, Method, Comm>::save_model(std::filesystem::path const& path,
                                                                splat_traits const& given) const {
  splat_traits const traits = with_origin(given, data_.origin);
  gaussian_model const mine = gaussians_.to_host(gaussians_.model);
  if constexpr (!Comm::alone) {
    if (comm_.size() > 1 && is_splat_ply(path))
      return write_collectively(comm_, path, [&](shared_file& file) {
        write_splat_ply_rows(file, path, mine, plans_.ranks.rows().owners(), gaussians_.total, traits);
      });
    if (comm_.size() > 1) {
      gaussian_model const all = gather_all(mine, 0);
      return collective(comm_, path, [&] {
        if (comm_.rank() == 0) write_splats(path, all, traits);
      });
    }
  }
  write_splats(path, mine, traits);
}

template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
exposure_field basic_trainer<E, Traits, Tracer, Method, Comm>::exposures() const {
  learned_colors all;
  for (auto const& part : parts_) part->tell(all);
  return exposure_field(std::move(all.views), std::move(all.falloffs));
}

template <execution E, class Traits, class Tracer, gradient_method Method, communicator<E> Comm>
std::vector<named_camera> basic_trainer<E, Traits, Tracer, Method, Comm>::poses() const {
  std::vector<named_camera> out;
  bool const moved = std::any_of(parts_.begin(), parts_.end(), [](auto const& part) { return part->moves_cameras(); });
  for (std::size_t i = 0; moved && i < data_.train.size(); ++i) out.push_back({data_.train[i].name, seen_by(i)});
  return out;
}

}}  // namespace gart::GART_ISA
