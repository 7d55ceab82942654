#include "runtime/step/epochs.h"

#include <algorithm>
#include <chrono>
#include <span>
#include <utility>

#include "physics/particles/patch_split.h"

namespace lahar {

namespace {

/// Particles that left a patch [-] wait in its memory until the graph drains. So many of them, 70
/// KiB, make it drain, because perhaps nothing else does. Where few may leave, one of them does.
std::size_t most_removed(const Analysis& analysis) {
  return analysis.few_may_leave() ? 1 : 1000;
}

}  // namespace

template <int Dim>
Epochs<Dim>::Epochs(PatchSet<Dim>& patches, const Analysis& analysis, Communicator ranks,
                    const BalanceOptions& options, int threads)
    : patches_(patches),
      split_steps_(analysis.split_steps),
      most_particles_(split_factor * analysis.patch_particles),
      most_removed_(most_removed(analysis)),
      ranks_(ranks),
      balance_(ranks, options, static_cast<int>(ranks.min(Index{threads}))) {}

template <int Dim>
void Epochs<Dim>::look_at(const Patch<Dim>& patch, Step step) {
  if (patch.removed.size() >= most_removed_) full_[step] = true;
  if (split_steps_ > 0 && (step + 1) % split_steps_ == 0 && is_crowded(patch, most_particles_))
    crowded_[step] = true;
}

template <int Dim>
void Epochs<Dim>::give(Step step, Agreement& own) {
  own.least.rebuild = rebuild_ ? -1 : 0;
  own.least.crowded = crowded_[step].exchange(false) ? -1 : 0;
  own.least.full = full_[step].exchange(false) ? -1 : 0;
  balance_.finish(step);
  if (!balance_.is_due(step)) return;
  const auto load = balance_.load();
  own.least.minus_work = -load.work;
  own.least.minus_particles = -load.particles;
  own.sum.insert(own.sum.end(), {load.work, load.particles});
}

template <int Dim>
bool Epochs<Dim>::take(Step step, const Agreement& all) {
  const Agreement::Least& least = all.least;
  if (least.rebuild < 0) rebuild_ = true;
  bool drains = least.full < 0;
  if (least.crowded < 0 && split_step_ < 0) {
    split_step_ = step + max_lead;
    drains = true;
  }
  if (balance_.is_due(step)) {
    const auto sum = std::span(all.sum).template last<2>();
    if (balance_.is_uneven({-least.minus_work, -least.minus_particles}, {sum[0], sum[1]}))
      remap_ = drains = true;
  }
  return drains;
}

template <int Dim>
Step Epochs<Dim>::drain_step(Step done, Step end) const {
  if (split_step_ > done) end = std::min(end, split_step_);
  const Step every = balance_.forced_every();
  return every > 0 ? std::min(end, (done / every + 1) * every) : end;
}

template <int Dim>
std::optional<std::vector<Index>> Epochs<Dim>::split(Step step) {
  if (step != split_step_) return {};
  split_step_ = -1;
  const PatchRenumbering ids = patches_.split(most_particles_);
  if (ids.empty()) return {};
  balance_.renumber(ids);
  patches_.rebuild();
  return ids.parts();
}

template <int Dim>
bool Epochs<Dim>::rebuild() {
  bool needed = rebuild_;
  for (int p = 0; p < patches_.size(); ++p)  // also where a particle came near in the last step
    needed = needed || patches_[p].needs_surroundings;
  if (!ranks_.any(needed)) return false;
  patches_.rebuild();
  return true;
}

template <int Dim>
void Epochs<Dim>::remap(Step step, Step nsteps, const std::function<void()>& changed) {
  const bool wanted = std::exchange(remap_, false) || balance_.is_forced(step);
  if (!wanted || step >= nsteps) return;
  using Clock = std::chrono::steady_clock;
  const auto begin = Clock::now();
  if (balance_.remap(patches_, step, nsteps - step)) changed();
  balance_.remap_took(std::chrono::duration<double>(Clock::now() - begin).count());
}

template class Epochs<2>;
template class Epochs<3>;

}  // namespace lahar
