/// \file What the patches of a rank send to others and get from them while steps are taken, and
/// what all ranks agree on. Nothing here waits: messages are looked for by the tasks of the graph.
///
/// A patch has a message for each rank that has neighbours of it, after every phase whose successor
/// takes something from neighbours: its sums at the nodes that it shares with patches there, or the
/// particles that left for them. At the other side the message fires the task of that patch and
/// phase in the graph of the receiver. Messages travel together (MessageStreams) where nothing of
/// them would wait: those of MPI are posted before a task that takes long, and when messages are
/// looked for; those through shared memory after each task.
#pragma once

#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "graph/executor.h"
#include "runtime/comm/communicator.h"
#include "runtime/comm/message_streams.h"
#include "runtime/comm/rank_agreements.h"
#include "runtime/exchange/timestep_stage.h"
#include "runtime/patches/patch_set.h"
#include "runtime/trace/record/recorder.h"

namespace lahar {

/// Where an Exchange gets and leaves what is not its own; called from any thread.
struct ExchangeCalls {
  std::function<Agreement(Step)> give;               ///< what this rank knows of a finished step
  std::function<void(Step, const Agreement&)> take;  ///< steps in order
  /// What sets dt is a limit, or sums, or both. The limit of the time step, of this rank [s], and
  /// the least of all ranks:
  std::function<double()> give_limit = {};
  std::function<void(Step, double)> take_limit = {};
  /// Sums of this rank, and those of all ranks:
  std::function<std::span<const Index>(Step)> give_sums = {};
  std::function<void(Step, std::span<const Index>)> take_sums = {};
  std::function<Step()> failed_step;  ///< the first that this rank knows to have failed
  std::function<void(Step)> failure_elsewhere;
  std::function<void()> others = {};  ///< other work for MPI, whenever messages are looked for
};

/// Delays for studies of what latency does to a run; 0 = none.
struct InjectedLatency {
  double seconds = 0;  ///< of a message; an agreement takes this times ceil(log2 ranks)
};

/// What an exchange is told about the graph that it serves.
struct ExchangePlan {
  std::vector<RankMessage> messages;  ///< by phase of a step of the graph
  Step first = 0;                     ///< round that is taken next
  int rounds = 1;                     ///< in a step of the graph, whose messages count rounds
  int loop = 0;  ///< whose messages they are, in traces (TraceRecord::loop); -1 = not recorded
};

/// Groups of the same ranks for the messages of a run: of patches, of steps that are done, of time
/// steps. Collective to make and to release; there is none with one rank.
class ExchangeGroups {
 public:
  ExchangeGroups(const Communicator& ranks, int threads)
      : patches(ranks.duplicate()),
        steps(ranks.duplicate()),
        limits(ranks.duplicate()),
        machines(ranks.machines()),
        have_cores(ranks.have_cores(threads)) {}
  ExchangeGroups(const ExchangeGroups&) = delete;
  ExchangeGroups& operator=(const ExchangeGroups&) = delete;
  ~ExchangeGroups() {
    if (std::uncaught_exceptions() > 0) return;  // others may never come here
    patches.release();
    steps.release();
    limits.release();
  }
  Communicator patches, steps, limits;
  std::vector<int> machines;  ///< by rank
  bool have_cores;            ///< for as many threads per rank
};

template <int Dim>
class RankExchange final : public Remote {
 public:
  /// For the patches as they are linked now. All ranks make theirs anew when patches have changed,
  /// after all messages for the one before have come. Exchanges that exist together have groups of
  /// their own. `share_memory`: messages between ranks of a machine do not go through MPI, except
  /// for many particles at once.
  RankExchange(const ExchangeGroups& groups, PatchSet<Dim>& patches, ExchangePlan plan,
               ExchangeCalls calls, InjectedLatency latency, bool share_memory);
  ~RankExchange() override;

  /// Whether a phase of an own patch sends anything.
  bool sends(int phase, int patch) const {
    const auto& of_phase = sends_[static_cast<std::size_t>(phase)];
    return !of_phase.empty() && !of_phase[static_cast<std::size_t>(patch)].empty();
  }
  /// A phase of an own patch is done. Here and below, a step is a round where steps of the graph
  /// have several (ExchangePlan).
  void send(int phase, int patch, Step step);
  /// The body of the task that a message fired.
  void unpack(int phase, int elsewhere, Step step);

  bool progress(Executor& executor) override;
  void post(bool all) override;
  void give_dt(Step step) override;
  void give_step(Step step) override;
  bool has_cores() const override { return has_cores_; }
  void wait_for_all() override {
    send_rest();
    ranks_.wait_for_all();
  }

  /// After a step, while others may still wait for its last messages.
  void send_rest();

  /// To be held by whoever calls MPI while steps are taken.
  std::unique_lock<std::mutex> lock_mpi() { return std::unique_lock(mpi_); }

 private:
  struct Header;
  /// One message of a step from an own patch to another rank.
  struct Send {
    std::size_t peer;  ///< whose stream
    int number;        ///< of this message in the stream, as the receiver counts
    const RemoteNeighbour* to;
  };
  /// One message of a step from a patch elsewhere.
  struct Receive;

  void find_messages();
  std::size_t lines_of_sums(std::size_t phase, std::size_t nodes) const;
  void make_streams(const ExchangeGroups& groups, bool share_memory);
  void send_sums(const Send& send, int phase, int patch, Step step);
  void send_particles(const Send& send, int phase, int patch, Step step);
  void look_at_messages(std::vector<ExchangeEvent>& events);
  void take_message(std::size_t peer, const std::byte* record, const Header& header,
                    std::vector<ExchangeEvent>& events);
  void look_at_long_messages(std::vector<ExchangeEvent>& events);
  void deliver(const ExchangeEvent& event, Executor& executor);
  void record(const ExchangeEvent& event) const;
  void record(TraceKind kind, Step step, int phase, Index patch, int peer, std::size_t bytes,
              std::uint64_t begin, std::uint64_t sent = 0) const;
  TraceRecorder* recorder(Step step) const;
  /// With the step that it belongs to and, in loops of solvers, the round.
  TraceRecord placed(TraceRecord record, const TraceRecorder& recorder, Step step) const;

  Communicator ranks_;
  PatchSet<Dim>* patches_;
  std::vector<RankMessage> messages_;
  const Step rounds_;  ///< in a step of the graph
  const int loop_;
  ExchangeCalls calls_;
  bool has_cores_;
  std::int64_t latency_;            ///< [ns] of a message
  std::int64_t agreement_latency_;  ///< [ns]

  std::vector<int> peers_;                             ///< ranks to exchange with, ascending
  std::vector<std::vector<std::vector<Send>>> sends_;  ///< by phase and own patch
  std::vector<Receive> receives_;
  std::vector<std::vector<int>> receive_of_;                ///< by phase and patch elsewhere
  std::vector<std::vector<int>> receive_number_;            ///< by peer and number in its stream
  std::vector<std::pair<int, MPI_Request>> long_messages_;  ///< that are being received
  std::vector<ExchangeEvent> delayed_;  ///< have come, but for the latency injected
  std::unique_ptr<MessageStreams> streams_;
  std::unique_ptr<RankAgreements> agreements_;
  std::mutex mpi_;  ///< one thread at a time is inside MPI
};

extern template class RankExchange<2>;
extern template class RankExchange<3>;

}  // namespace lahar
