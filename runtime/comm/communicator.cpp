#include "runtime/comm/communicator.h"

#include <sched.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <chrono>
#include <climits>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <numeric>
#include <thread>

#include "graph/back_off.h"
#include "physics/base/error.h"
#include "runtime/base/exit_codes.h"
#include "runtime/base/launcher.h"

namespace lahar {

namespace {

/// For MpiSession::leave(), when nothing is known of what others do.
MPI_Comm farewell = MPI_COMM_NULL;
std::atomic<Index> last_step{0};

bool running() {
  int begun = 0, ended = 0;
  MPI_Initialized(&begun);
  MPI_Finalized(&ended);
  return begun != 0 && ended == 0;
}

/// What MPI cannot do ends all ranks.
void end_by_mpi(MPI_Comm*, int* code, ...) {
  std::array<char, MPI_MAX_ERROR_STRING + 1> text{};
  int length = 0, rank = 0;
  MPI_Error_string(*code, text.data(), &length);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  std::fprintf(stderr,
               "lahar: error: MPI fails on rank %d: %s. The last step that all ranks finished is "
               "%lld. If there are checkpoints, `--restart latest` goes on.\n",
               rank, text.data(), static_cast<long long>(last_step.load()));
  std::fflush(nullptr);
  MPI_Abort(MPI_COMM_WORLD, exit_rank);
}

int count_of(std::size_t n) {
  if (n > INT_MAX) throw RankError("a message of more than 2 GiB");
  return static_cast<int>(n);
}

}  // namespace

MpiSession::MpiSession(int& argc, char**& argv) {
  if (!is_launched()) return;
  // Messages of Open MPI to a rank on the same machine are copied by the receiver through a system
  // call each, unless they are short: let all but the longest count as that. The user's wish first.
  for (const char* name : {"OMPI_MCA_btl_vader_eager_limit", "OMPI_MCA_btl_sm_eager_limit"})
    setenv(name, "40960", /*overwrite=*/0);
  int provided = MPI_THREAD_SINGLE;
  MPI_Init_thread(&argc, &argv, MPI_THREAD_SERIALIZED, &provided);
  if (provided < MPI_THREAD_SERIALIZED) {
    MPI_Finalize();
    throw RankError(
        "this MPI library gives no thread level of MPI_THREAD_SERIALIZED or more, which is needed "
        "for several ranks. Use a build of MPI with thread support (Debian's Open MPI has it).");
  }
  // Communicators that are made from it have the same.
  MPI_Errhandler handler = MPI_ERRHANDLER_NULL;
  MPI_Comm_create_errhandler(end_by_mpi, &handler);
  MPI_Comm_set_errhandler(MPI_COMM_WORLD, handler);
  MPI_Errhandler_free(&handler);
  MPI_Comm_dup(MPI_COMM_WORLD, &farewell);
}

MpiSession::~MpiSession() {
  if (running()) MPI_Finalize();
}

void MpiSession::steps_done(Index step) {
  last_step.store(step, std::memory_order_relaxed);
}

void MpiSession::leave(int code, const std::string& message) {
  const Communicator ranks = Communicator::world();
  if (!ranks.several()) {
    std::fputs(message.c_str(), stderr);
    return;
  }
  using Clock = std::chrono::steady_clock;
  const std::size_t own = std::hash<std::string>{}(message);
  std::vector<std::size_t> all(static_cast<std::size_t>(ranks.size()));
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Iallgather(&own, 1, MPI_UINT64_T, all.data(), 1, MPI_UINT64_T, farewell, &request);
  int done = 0;
  for (const auto begin = Clock::now(); !done && Clock::now() - begin < std::chrono::seconds(2);) {
    MPI_Test(&request, &done, MPI_STATUS_IGNORE);
    if (!done) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  const auto first = std::find(all.begin(), all.end(), own) - all.begin();
  if (!done) {
    std::fputs(("lahar: rank " + std::to_string(ranks.rank()) +
                " failed and ends the others; the last step that all finished is " +
                std::to_string(last_step.load()) + ".\n" + message)
                   .c_str(),
               stderr);
    std::fflush(nullptr);
    MPI_Abort(MPI_COMM_WORLD, code);
  } else if (first == ranks.rank()) {
    std::fputs(message.c_str(), stderr);
  }
}

Communicator Communicator::world() {
  Communicator ranks;
  if (!running()) return ranks;
  MPI_Comm_rank(MPI_COMM_WORLD, &ranks.rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &ranks.size_);
  if (ranks.size_ > 1) {
    ranks.communicator_ = MPI_COMM_WORLD;
    ranks.poll_ = std::make_shared<std::function<void()>>();
  }
  return ranks;
}

Communicator Communicator::duplicate() const {
  Communicator copy = *this;
  if (several()) MPI_Comm_dup(communicator_, &copy.communicator_);
  return copy;
}

void Communicator::release() {
  if (several() && running()) MPI_Comm_free(&communicator_);
  communicator_ = MPI_COMM_NULL;
}

Communicator Communicator::first(int n) const {
  Communicator group;
  if (!several()) return group;
  MPI_Comm_split(communicator_, rank_ < n ? 0 : MPI_UNDEFINED, rank_, &group.communicator_);
  if (group.communicator_ != MPI_COMM_NULL) group.become_group(*this);
  return group;
}

/// With the communicator that it has been given, some of the processes of `whole`.
void Communicator::become_group(const Communicator& whole) {
  MPI_Comm_size(communicator_, &size_);
  MPI_Comm_rank(communicator_, &rank_);
  poll_ = whole.poll_;
  if (!several()) MPI_Comm_free(&communicator_);
}

void Communicator::while_waiting(std::function<void()> poll) const {
  if (several()) *poll_ = std::move(poll);
}

/// Blocking calls of MPI poll, and take the core from the rank that they wait for where there are
/// more ranks than cores.
void Communicator::wait_for(std::span<MPI_Request> requests) const {
  constexpr int patience = 100;
  for (int looks = 0;; ++looks) {
    int done = 0;
    MPI_Testall(static_cast<int>(requests.size()), requests.data(), &done, MPI_STATUSES_IGNORE);
    if (done != 0) return;
    if (*poll_) (*poll_)();
    if (looks >= patience) back_off();
  }
}

Communicator Communicator::on_machine() const {
  Communicator machine;
  if (!several()) return machine;
  MPI_Comm_split_type(communicator_, MPI_COMM_TYPE_SHARED, rank_, MPI_INFO_NULL,
                      &machine.communicator_);
  machine.become_group(*this);
  return machine;
}

std::vector<int> Communicator::machines() const {
  Communicator machine = on_machine();
  const auto least = static_cast<int>(machine.min(Index{rank_}));
  machine.release();
  return gather_all(std::span<const int>(&least, 1));
}

bool Communicator::have_cores(int threads) const {
  if (!several()) return true;
  std::array<std::uint64_t, sizeof(cpu_set_t) / sizeof(std::uint64_t)> cores{};
  static_assert(sizeof cores == sizeof(cpu_set_t));
  cpu_set_t own;
  CPU_ZERO(&own);
  sched_getaffinity(0, sizeof own, &own);
  std::memcpy(cores.data(), &own, sizeof own);
  Communicator machine = on_machine();
  machine.reduce_all(std::span<std::uint64_t>(cores), MPI_UINT64_T, MPI_BOR);
  int n_cores = 0;
  for (const std::uint64_t some : cores) n_cores += std::popcount(some);
  const bool enough = machine.sum(Index{threads}) <= n_cores;
  machine.release();
  return !any(!enough);
}

template <class T>
void Communicator::reduce_all(std::span<T> values, MPI_Datatype type, MPI_Op op) const {
  if (!several()) return;
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Iallreduce(MPI_IN_PLACE, values.data(), count_of(values.size()), type, op, communicator_,
                 &request);
  wait_for(request);
}

template <class T>
T Communicator::reduce(T value, MPI_Datatype type, MPI_Op op) const {
  reduce_all(std::span<T>(&value, 1), type, op);
  return value;
}

void Communicator::wait_for_all() const {
  if (!several()) return;
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Ibarrier(communicator_, &request);
  wait_for(request);
}

double Communicator::min(double value) const {
  return reduce(value, MPI_DOUBLE, MPI_MIN);
}
double Communicator::max(double value) const {
  return reduce(value, MPI_DOUBLE, MPI_MAX);
}
Index Communicator::min(Index value) const {
  return reduce(value, MPI_INT64_T, MPI_MIN);
}
Index Communicator::max(Index value) const {
  return reduce(value, MPI_INT64_T, MPI_MAX);
}
Index Communicator::sum(Index value) const {
  return reduce(value, MPI_INT64_T, MPI_SUM);
}

void Communicator::sum(std::span<Index> values) const {
  reduce_all(values, MPI_INT64_T, MPI_SUM);
}

void Communicator::min(std::span<Index> values) const {
  reduce_all(values, MPI_INT64_T, MPI_MIN);
}

void Communicator::broadcast(std::string& text, int root) const {
  if (!several()) return;
  auto size = static_cast<Index>(text.size());
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Ibcast(&size, 1, MPI_INT64_T, root, communicator_, &request);
  wait_for(request);
  text.resize(static_cast<std::size_t>(size));
  MPI_Ibcast(text.data(), count_of(text.size()), MPI_CHAR, root, communicator_, &request);
  wait_for(request);
}

std::vector<std::byte> Communicator::gather_bytes(std::span<const std::byte> bytes) const {
  if (!several()) return {bytes.begin(), bytes.end()};
  const int own = count_of(bytes.size());
  std::vector<int> counts(static_cast<std::size_t>(size_)), first(counts.size());
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Iallgather(&own, 1, MPI_INT, counts.data(), 1, MPI_INT, communicator_, &request);
  wait_for(request);
  count_of(std::accumulate(counts.begin(), counts.end(), std::size_t{0}));
  std::exclusive_scan(counts.begin(), counts.end(), first.begin(), 0);
  std::vector<std::byte> all(static_cast<std::size_t>(first.back() + counts.back()));
  MPI_Iallgatherv(bytes.data(), own, MPI_BYTE, all.data(), counts.data(), first.data(), MPI_BYTE,
                  communicator_, &request);
  wait_for(request);
  return all;
}

std::vector<std::vector<std::byte>> Communicator::exchange_bytes(
    const std::vector<std::span<const std::byte>>& to) const {
  std::vector<std::vector<std::byte>> from(to.size());
  const auto self = static_cast<std::size_t>(rank_);
  from[self].assign(to[self].begin(), to[self].end());
  if (!several()) return from;
  std::vector<Index> sends, receives(to.size());
  for (const auto& part : to) sends.push_back(static_cast<Index>(part.size()));
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Ialltoall(sends.data(), 1, MPI_INT64_T, receives.data(), 1, MPI_INT64_T, communicator_,
                &request);
  wait_for(request);
  // In pieces: the counts of one call may not be large enough.
  constexpr std::size_t piece = std::size_t{1} << 30;
  constexpr int tag = 1;
  std::vector<MPI_Request> requests;
  for (std::size_t r = 0; r < to.size(); ++r) {
    if (r == self) continue;
    from[r].resize(static_cast<std::size_t>(receives[r]));
    for (std::size_t at = 0; at < from[r].size(); at += piece)
      MPI_Irecv(from[r].data() + at, count_of(std::min(piece, from[r].size() - at)), MPI_BYTE,
                static_cast<int>(r), tag, communicator_, &requests.emplace_back());
  }
  for (std::size_t k = 1; k < to.size(); ++k) {  // not all to the same rank at a time
    const std::size_t r = (self + k) % to.size();
    for (std::size_t at = 0; at < to[r].size(); at += piece)
      MPI_Isend(to[r].data() + at, count_of(std::min(piece, to[r].size() - at)), MPI_BYTE,
                static_cast<int>(r), tag, communicator_, &requests.emplace_back());
  }
  wait_for(requests);
  return from;
}

}  // namespace lahar
