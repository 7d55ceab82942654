#include "runtime/step/lost_particles.h"

#include <fmt/format.h>

#include <algorithm>

#include "graph/executor.h"
#include "runtime/exchange/failure.h"
#include "runtime/step/watchdog.h"

namespace lahar {

template <int Dim>
void LostParticles<Dim>::resume(Index removed, Step step) {
  count_ = removed;
  if (removed > analysis_.most_lost) end_ = step;
}

template <int Dim>
void LostParticles<Dim>::add(std::span<const RemovedParticle> removed) {
  if (removed.empty()) return;
  const Index most = analysis_.most_lost, before = count_;
  count_ += static_cast<Index>(removed.size());
  last_ = describe_particle<Dim>(removed.back());
  if (!analysis_.few_may_leave()) return;
  if (before == 0)
    warn_(
        fmt::format("{} left the mesh in step {} and was removed. The run ends when more than {} "
                    "{} left it (analysis.lost_share). Enlarge the mesh to keep them.",
                    describe_particle<Dim>(removed.front()), removed.front().step, most,
                    most == 1 ? "has" : "have"));
  if (end_ < 0 && count_ > most)
    end_ = removed[static_cast<std::size_t>(most - before)].step + max_lead;
}

template <int Dim>
Step LostParticles<Dim>::drain_step(Step done, Step end) const {
  return end_ > done ? std::min(end, end_) : end;
}

template <int Dim>
void LostParticles<Dim>::throw_if_too_many(Step done, Step nsteps, double time) const {
  if (end_ < 0 || (done < end_ && done < nsteps)) return;
  throw WholeStepError(fmt::format(
      "step {} (t = {:.6g} s): more particles have left the mesh than may, {} and not {} "
      "(analysis.lost_share){}. Enlarge the mesh, constrain its boundary nodes, or let all such "
      "particles be removed with \"locate_particles\": false in \"analysis\".",
      done, time, count_, analysis_.most_lost, last_.empty() ? "" : "; the last one was " + last_));
}

template class LostParticles<2>;
template class LostParticles<3>;

}  // namespace lahar
