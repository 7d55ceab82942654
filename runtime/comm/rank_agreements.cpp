#include "runtime/comm/rank_agreements.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "runtime/trace/record/recorder.h"

namespace lahar {

std::int64_t exchange_time() {
  return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds{1};
}

std::int64_t exchange_due(std::int64_t sent, std::int64_t latency) {
  return latency > 0 ? std::min(sent, exchange_time()) + latency : sent;
}

void RankAgreements::give_limit(Step step, double limit) {
  limit_step_ = step;
  limit_begin_ = ticks();
  limit_given_ = {limit, -static_cast<double>(exchange_time())};
  MPI_Iallreduce(limit_given_.data(), limit_found_.data(), 2, MPI_DOUBLE, MPI_MIN,
                 limits_.communicator(), &limit_requests_[0]);
}

void RankAgreements::give_sums(Step step, double limit, std::span<const Index> own) {
  give_limit(step, limit);  // it has the time, too
  sums_given_.assign(own.begin(), own.end());
  sums_found_.resize(own.size());
  MPI_Iallreduce(sums_given_.data(), sums_found_.data(), static_cast<int>(own.size()), MPI_INT64_T,
                 MPI_SUM, limits_.communicator(), &limit_requests_[1]);
}

void RankAgreements::give(Step step, Agreement&& own) {
  Pending& pending = of(step);
  pending.step = step;
  pending.begin = ticks();
  pending.given = std::move(own);
  pending.given.least.begun = -exchange_time();
  pending.found.sum.resize(pending.given.sum.size());
  MPI_Iallreduce(&pending.given.least, &pending.found.least, least_size, MPI_INT64_T, MPI_MIN,
                 steps_.communicator(), &pending.requests[0]);
  if (!pending.given.sum.empty())
    MPI_Iallreduce(pending.given.sum.data(), pending.found.sum.data(),
                   static_cast<int>(pending.given.sum.size()), MPI_INT64_T, MPI_SUM,
                   steps_.communicator(), &pending.requests[1]);
  pending.found.lowest.resize(pending.given.lowest.size());
  if (!pending.given.lowest.empty())
    MPI_Iallreduce(pending.given.lowest.data(), pending.found.lowest.data(),
                   static_cast<int>(pending.given.lowest.size()), MPI_INT64_T, MPI_MIN,
                   steps_.communicator(), &pending.requests[2]);
}

void RankAgreements::look(std::int64_t latency, std::vector<ExchangeEvent>& events) {
  int done = 0;
  if (limit_step_ >= 0) {
    MPI_Testall(2, limit_requests_.data(), &done, MPI_STATUSES_IGNORE);
    if (done) {
      events.push_back({.kind = ExchangeEvent::Kind::limit,
                        .step = limit_step_,
                        .due = exchange_due(-static_cast<std::int64_t>(limit_found_[1]), latency),
                        .limit = limit_found_[0],
                        .begin = limit_begin_,
                        .found = ticks()});
      limit_step_ = -1;
    }
  }
  for (Pending& pending : pending_) {
    if (pending.step < 0) continue;
    MPI_Testall(3, pending.requests.data(), &done, MPI_STATUSES_IGNORE);
    if (!done) continue;
    events.push_back({.kind = ExchangeEvent::Kind::step,
                      .step = pending.step,
                      .due = exchange_due(-pending.found.least.begun, latency),
                      .begin = pending.begin,
                      .found = ticks()});
    pending.step = -1;
  }
}

}  // namespace lahar
