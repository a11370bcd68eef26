#pragma once
/// \file
/// The bodies of trainer.hpp for what a run can be taken up from and for what it leaves: states, checkpoints, models,
/// of one rank and of all.

#include <gart/train/trainer.hpp>

namespace gart::inline GART_ISA {

template <execution E, class Traits, class Tracer, strategy Strategy, class Comm>
training_state basic_trainer<E, Traits, Tracer, Strategy, Comm>::part() const {
  training_state s;
  s.scene = model_part();
  s.first = with_sh_degree(state_.first.to_host(), degree_);
  s.second = with_sh_degree(state_.second.to_host(), degree_);
  s.step = step_, s.growth = growth_, s.seed = options_.seed, s.origin = data_.origin;
  if (exposures_) s.exposures = exposures_->state();
  if (vignetting_) s.vignetting = vignetting_->state();
  if (poses_) s.poses = poses_->state();
  if (lenses_) s.lenses = lenses_->state();
  s.error_sum = error_.error_sum.to_host();
  s.gradient_sum = adc_.gradient_sum.to_host(), s.touched = adc_.touched.to_host();
  return s;
}

template <execution E, class Traits, class Tracer, strategy Strategy, class Comm>
training_state basic_trainer<E, Traits, Tracer, Strategy, Comm>::whole_of(training_state const& mine) const {
  if constexpr (Comm::alone) {
    return mine;
  } else {
    training_state all = without_rows(mine);
    all.scene = whole_of(mine.scene), all.first = whole_of(mine.first), all.second = whole_of(mine.second);
    all.error_sum = shards_.rows.whole_of(mine.error_sum, 1);
    all.gradient_sum = shards_.rows.whole_of(mine.gradient_sum, 1);
    all.touched = shards_.rows.whole_of(mine.touched, 1);
    return all;
  }
}

template <execution E, class Traits, class Tracer, strategy Strategy, class Comm>
void basic_trainer<E, Traits, Tracer, Strategy, Comm>::write_part(std::filesystem::path const& path,
                                                                  training_state const& mine) const {
  if constexpr (Comm::alone)
    write_checkpoint(path, mine);
  else
    write_checkpoint_collectively(comm_, shards_.rows.owners(), path, mine);
}

template <execution E, class Traits, class Tracer, strategy Strategy, class Comm>
training_state basic_trainer<E, Traits, Tracer, Strategy, Comm>::read_part(std::filesystem::path const& path) const {
  if constexpr (Comm::alone)
    return read_checkpoint(path);
  else
    return read_checkpoint_collectively(comm_, shards_.rows.owners(), path);
}

template <execution E, class Traits, class Tracer, strategy Strategy, class Comm>
void basic_trainer<E, Traits, Tracer, Strategy, Comm>::write_part(std::filesystem::path const& path,
                                                                  gaussian_model const& mine,
                                                                  splat_traits const& given) const {
  splat_traits const traits = with_origin(given, data_.origin);
  if constexpr (!Comm::alone) {
    if (comm_.size() > 1 && is_splat_ply(path)) {
      u64 total = mine.size();
      comm_.all_reduce(span<u64>(&total, 1));
      write_collectively(comm_, path, [&](shared_file& file) {
        write_splat_ply_rows(file, path, mine, shards_.rows.owners(), total, traits);
      });
      return;
    }
    if (comm_.size() > 1) {
      gaussian_model const all = whole_of(mine, 0);
      together(comm_, path, [&] {
        if (comm_.rank() == 0) write_splats(path, all, traits);
      });
      return;
    }
  }
  write_splats(path, mine, traits);
}

template <execution E, class Traits, class Tracer, strategy Strategy, class Comm>
void basic_trainer<E, Traits, Tracer, Strategy, Comm>::load(std::filesystem::path const& path) {
  training_state const mine = read_part(path);
  require_degree(path, mine, degree_);
  set_part(mine);
}

template <execution E, class Traits, class Tracer, strategy Strategy, class Comm>
void basic_trainer<E, Traits, Tracer, Strategy, Comm>::set_part(training_state const& s) {
  if (s.scene.sh_degree != degree_) throw invalid_argument("trainer: the state has another SH degree");
  if (s.origin != data_.origin)
    throw invalid_argument("trainer: the state is from the origin " + to_text(s.origin) + ", the capture from " +
                           to_text(data_.origin) + " (dataset_options.origin holds it from that)");
  assign_rows(scene_, s.scene), assign_rows(state_.first, s.first), assign_rows(state_.second, s.second);
  total_ = static_cast<index_t>(total_of(comm_, {s.scene, true}));
  gradients_.resize_keep(scene_.size());
  error_.error_sum.assign(s.error_sum);
  adc_.gradient_sum.assign(s.gradient_sum), adc_.touched.assign(s.touched);
  if (exposures_) {
    if (s.exposures.visits.size() != data_.train.size())
      throw invalid_argument("trainer: the state has exposures of another number of training views");
    exposures_->set_state(s.exposures);
  }
  if (vignetting_) {
    if (s.vignetting.visits.size() != vignetting_->lenses().size())
      throw invalid_argument("trainer: the state has falloffs of another number of lenses");
    vignetting_->set_state(s.vignetting);
  }
  if (poses_) {
    if (s.poses.visits.size() != data_.train.size())
      throw invalid_argument("trainer: the state has poses of another number of training views");
    poses_->set_state(s.poses);
  }
  if (lenses_) {
    if (s.lenses.visits.size() != lenses_->state().visits.size())
      throw invalid_argument("trainer: the state has lenses of another number of cameras");
    lenses_->set_state(s.lenses);
  }
  options_.seed = s.seed;
  order_ = view_order(data_.train.size(), options_.held_out, options_.seed);
  step_ = s.step;
  growth_ = s.growth;
  mcmc_.set_growth(growth_);
}

}  // namespace gart::inline GART_ISA
