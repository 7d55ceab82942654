#include "runtime/exchange/rank_exchange.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <exception>
#include <utility>

#include "graph/back_off.h"
#include "physics/base/error.h"
#include "runtime/patches/particle_message.h"
#include "runtime/trace/record/recorder.h"

namespace lahar {

/// What precedes every message: one line, so that sums lie on lines of their own.
template <int Dim>
struct RankExchange<Dim>::Header {
  std::int64_t step;
  std::int64_t sent;         ///< [ns]
  std::int64_t failed_step;  ///< that the sender knows of
  std::int64_t payload;      ///< [bytes] of particles, which may follow on their own
  std::int64_t particles;
  std::uint64_t posted;      ///< ticks of the sender, for traces; set when the message has come
  std::int32_t number;       ///< Send::number
  std::int32_t contributes;  ///< sums follow, others are zero
  std::int64_t lines;        ///< in the stream, this one included
};

template <int Dim>
struct RankExchange<Dim>::Receive {
  int phase, elsewhere;
  std::size_t peer;
  int number;
  bool of_particles;
  Step expected = 0;
  std::array<Header, 2> header{};                   ///< by parity of the step, as what follows
  std::array<std::vector<std::byte>, 2> particles;  ///< sums lie in the RemotePatch
};

namespace {

constexpr std::size_t line = MessageStreams::line;
constexpr int doubles_per_line = line / sizeof(double);
static_assert(sum_stride == doubles_per_line);

/// Particles that go along in the stream [bytes]; more are sent on their own.
constexpr std::size_t most_particles_along = 16384;

}  // namespace

template <int Dim>
RankExchange<Dim>::RankExchange(const ExchangeGroups& groups, PatchSet<Dim>& patches,
                                ExchangePlan plan, ExchangeCalls calls, InjectedLatency latency,
                                bool share_memory)
    : ranks_(groups.patches),
      patches_(&patches),
      messages_(std::move(plan.messages)),
      rounds_(plan.rounds),
      loop_(plan.loop),
      calls_(std::move(calls)),
      has_cores_(groups.have_cores),
      latency_(static_cast<std::int64_t>(latency.seconds * 1e9)),
      agreements_(std::make_unique<RankAgreements>(groups.steps, groups.limits)) {
  static_assert(sizeof(Header) == line);
  int hops = 0;
  while ((1 << hops) < ranks_.size()) ++hops;
  agreement_latency_ = latency_ * hops;
  find_messages();
  const int phases = static_cast<int>(messages_.size()) / plan.rounds;  // of a round
  for (Receive& receive : receives_) receive.expected = plan.first + receive.phase / phases;
  make_streams(groups, share_memory);
}

template <int Dim>
RankExchange<Dim>::~RankExchange() {
  // Others may never receive what was sent, and the process is about to end.
  if (std::uncaught_exceptions() == 0) return;
  streams_->abandon();
  static_cast<void>(agreements_.release());
}

/// Both sides count the messages of a step from one rank to the other, phase by phase, patches in
/// ascending order: this gives messages the same numbers.
template <int Dim>
void RankExchange<Dim>::find_messages() {
  for (int p = 0; p < patches_->size(); ++p)
    for (const RemoteNeighbour& to : patches_->sends(p)) peers_.push_back(to.rank);
  std::sort(peers_.begin(), peers_.end());
  peers_.erase(std::unique(peers_.begin(), peers_.end()), peers_.end());
  const auto peer_of = [&](int rank) {
    return static_cast<std::size_t>(std::lower_bound(peers_.begin(), peers_.end(), rank) -
                                    peers_.begin());
  };
  std::vector<int> sent(peers_.size(), 0);
  receive_number_.resize(peers_.size());
  sends_.resize(messages_.size());
  receive_of_.resize(messages_.size());
  for (std::size_t f = 0; f < messages_.size(); ++f) {
    receive_of_[f].assign(patches_->elsewhere().size(), -1);
    if (messages_[f].kind == RankMessage::Kind::none) continue;
    sends_[f].resize(static_cast<std::size_t>(patches_->size()));
    for (int p = 0; p < patches_->size(); ++p)
      for (const RemoteNeighbour& to : patches_->sends(p)) {
        const std::size_t peer = peer_of(to.rank);
        sends_[f][static_cast<std::size_t>(p)].push_back({peer, sent[peer]++, &to});
      }
    for (std::size_t e = 0; e < patches_->elsewhere().size(); ++e) {
      const std::size_t peer = peer_of(patches_->elsewhere()[e].rank);
      auto& numbers = receive_number_[peer];
      receive_of_[f][e] = static_cast<int>(receives_.size());
      receives_.push_back({.phase = static_cast<int>(f),
                           .elsewhere = static_cast<int>(e),
                           .peer = peer,
                           .number = static_cast<int>(numbers.size()),
                           .of_particles = messages_[f].kind == RankMessage::Kind::particles,
                           .particles = {}});
      numbers.push_back(receive_of_[f][e]);
    }
  }
}

/// Lines of the message after a phase that has sums of so many nodes.
template <int Dim>
std::size_t RankExchange<Dim>::lines_of_sums(std::size_t phase, std::size_t nodes) const {
  return 1 + messages_[phase].sum_arrays.size() * nodes;
}

template <int Dim>
void RankExchange<Dim>::make_streams(const ExchangeGroups& groups, bool share_memory) {
  std::vector<MessageStreams::Peer> peers;
  const auto machine = [&](int rank) { return groups.machines[static_cast<std::size_t>(rank)]; };
  for (const int rank : peers_)
    peers.push_back({.rank = rank,
                     .longest = line + most_particles_along,
                     .shares_memory = share_memory && machine(rank) == machine(ranks_.rank())});
  for (std::size_t f = 0; f < sends_.size(); ++f)
    for (const auto& of_patch : sends_[f])
      for (const Send& send : of_patch) {
        const bool sums = messages_[f].kind == RankMessage::Kind::sums;
        const std::size_t bytes = (sums ? lines_of_sums(f, send.to->nodes.size()) : 1) * line;
        peers[send.peer].longest = std::max(peers[send.peer].longest, bytes);
        peers[send.peer].of_a_step += bytes;
      }
  for (const Receive& receive : receives_) {
    if (receive.of_particles) continue;
    RemotePatch<Dim>& from = patches_->elsewhere()[static_cast<std::size_t>(receive.elsewhere)];
    const auto& message = messages_[static_cast<std::size_t>(receive.phase)];
    for (NodeArray& sums : from.sums[static_cast<std::size_t>(message.number)])
      sums.assign(lines_of_sums(static_cast<std::size_t>(receive.phase), from.nodes.size()) *
                      doubles_per_line,
                  0.0);
  }
  streams_ = std::make_unique<MessageStreams>(ranks_, peers);
}

// --- sending -------------------------------------------------------------------------------------

template <int Dim>
void RankExchange<Dim>::send(int phase, int patch, Step step) {
  const auto f = static_cast<std::size_t>(phase);
  if (messages_[f].kind == RankMessage::Kind::none) return;
  for (const Send& send : sends_[f][static_cast<std::size_t>(patch)]) {
    if (messages_[f].kind == RankMessage::Kind::sums)
      send_sums(send, phase, patch, step);
    else
      send_particles(send, phase, patch, step);
  }
}

template <int Dim>
void RankExchange<Dim>::send_sums(const Send& send, int phase, int patch, Step step) {
  const std::uint64_t begin = ticks();
  const Patch<Dim>& from = (*patches_)[patch];
  const bool any = from.contributes[static_cast<std::size_t>(step % 2)] != 0;
  const auto f = static_cast<std::size_t>(phase);
  const std::size_t lines = any ? lines_of_sums(f, send.to->nodes.size()) : 1;
  {
    const auto record = streams_->record(send.peer, lines * line);
    const Header header{.step = step,
                        .sent = exchange_time(),
                        .failed_step = calls_.failed_step(),
                        .payload = 0,
                        .particles = 0,
                        .posted = 0,
                        .number = send.number,
                        .contributes = any,
                        .lines = static_cast<std::int64_t>(lines)};
    std::byte* to = record.data();
    std::memcpy(to, &header, line);
    if (any) {
      const std::span<const Local> nodes = send.to->nodes;
      for (const std::size_t array : messages_[f].sum_arrays) {
        const auto& copies = from.sums[array];
        const double* sums = copies[static_cast<std::size_t>(step) % copies.size()].data();
        const auto of_node = [&](std::size_t k) {
          return sums + static_cast<std::ptrdiff_t>(nodes[k]) * sum_stride;
        };
        for (std::size_t k = 0; k < nodes.size(); ++k) {  // a line each, from anywhere in the cache
          __builtin_prefetch(of_node(std::min(k + 12, nodes.size() - 1)));
          std::memcpy(to += line, of_node(k), line);
        }
      }
    }
  }
  record(TraceKind::send, step, phase, from.topology.patch, send.to->rank, lines * line, begin);
}

template <int Dim>
void RankExchange<Dim>::send_particles(const Send& send, int phase, int patch, Step step) {
  const std::uint64_t begin = ticks();
  const Patch<Dim>& from = (*patches_)[patch];
  const Index count = leaving_particles(from, *send.to);
  const std::size_t payload =
      static_cast<std::size_t>(count) * bytes_per_particle(from.particles.layout());
  const bool along = payload <= most_particles_along;
  const std::size_t bytes = line + (along ? MessageStreams::lines(payload) : 0);
  {
    const auto record = streams_->record(send.peer, bytes);
    const Header header{.step = step,
                        .sent = exchange_time(),
                        .failed_step = calls_.failed_step(),
                        .payload = static_cast<std::int64_t>(payload),
                        .particles = count,
                        .posted = 0,
                        .number = send.number,
                        .contributes = 0,
                        .lines = static_cast<std::int64_t>(bytes / line)};
    std::memcpy(record.data(), &header, line);
    if (along) write_particles(from, *send.to, record.data() + line);
  }
  if (!along) {
    std::vector<std::byte> particles(payload);
    write_particles(from, *send.to, particles.data());
    const std::scoped_lock lock(mpi_);
    streams_->send_long(send.peer, 1 + send.number, std::move(particles));
  }
  record(TraceKind::send, step, phase, from.topology.patch, send.to->rank, line + payload, begin);
}

template <int Dim>
void RankExchange<Dim>::post(bool all) {
  streams_->post_shared();
  if (!all || !streams_->has_unposted_for_mpi()) return;
  const std::scoped_lock lock(mpi_);
  streams_->post();
}

template <int Dim>
void RankExchange<Dim>::send_rest() {
  // Some may have to wait until others have been taken, by a rank that may need something else of
  // this one meanwhile.
  while (streams_->has_unposted()) {
    {
      const std::scoped_lock lock(mpi_);
      streams_->post();
      if (calls_.others) calls_.others();
    }
    if (streams_->has_unposted()) back_off();
  }
}

template <int Dim>
void RankExchange<Dim>::give_dt(Step step) {
  const double limit = calls_.give_limit ? calls_.give_limit() : 0;
  if (calls_.give_sums) {
    const std::span<const Index> sums = calls_.give_sums(step);
    const std::scoped_lock lock(mpi_);
    return agreements_->give_sums(step, limit, sums);
  }
  const std::scoped_lock lock(mpi_);
  agreements_->give_limit(step, limit);
}

template <int Dim>
void RankExchange<Dim>::give_step(Step step) {
  Agreement own = calls_.give(step);
  const std::scoped_lock lock(mpi_);
  agreements_->give(step, std::move(own));
}

// --- receiving -----------------------------------------------------------------------------------

template <int Dim>
bool RankExchange<Dim>::progress(Executor& executor) {
  std::vector<ExchangeEvent> events;
  streams_->post_shared();
  {
    const std::unique_lock lock(mpi_, std::try_to_lock);
    if (!lock.owns_lock()) return false;
    streams_->post();
    agreements_->look(agreement_latency_, events);
    look_at_messages(events);
    look_at_long_messages(events);
    if (calls_.others) calls_.others();
    if (latency_ > 0) {
      delayed_.insert(delayed_.end(), events.begin(), events.end());
      events.clear();
      const std::int64_t time = exchange_time();
      std::erase_if(delayed_, [&](const ExchangeEvent& event) {
        if (event.due > time) return false;
        events.push_back(event);
        return true;
      });
    }
  }
  for (const ExchangeEvent& event : events) deliver(event, executor);
  return !events.empty();
}

template <int Dim>
void RankExchange<Dim>::look_at_messages(std::vector<ExchangeEvent>& events) {
  streams_->receive(
      [&](std::size_t peer, std::uint64_t posted, std::span<const std::byte> records) {
        for (std::size_t at = 0; at < records.size();) {
          Header header;
          std::memcpy(&header, &records[at], line);
          header.posted = posted;
          take_message(peer, &records[at], header, events);
          at += static_cast<std::size_t>(header.lines) * line;
        }
      });
}

/// What the message is written over has been used, or the sender would not have got here.
template <int Dim>
void RankExchange<Dim>::take_message(std::size_t peer, const std::byte* record,
                                     const Header& header, std::vector<ExchangeEvent>& events) {
  const int r = receive_number_[peer].at(static_cast<std::size_t>(header.number));
  Receive& receive = receives_[static_cast<std::size_t>(r)];
  const Step step = receive.expected;
  receive.expected += rounds_;
  if (header.step != step)
    throw RankError("rank " + std::to_string(peers_[peer]) + " sent step " +
                    std::to_string(header.step) + " where " + std::to_string(step) +
                    " was expected");
  const auto parity = static_cast<std::size_t>(step % 2);
  receive.header[parity] = header;
  const ExchangeEvent event{.kind = ExchangeEvent::Kind::message,
                            .step = step,
                            .due = exchange_due(header.sent, latency_),
                            .receive = r,
                            .found = ticks()};
  if (!receive.of_particles) {
    auto& from = patches_->elsewhere()[static_cast<std::size_t>(receive.elsewhere)];
    const auto& message = messages_[static_cast<std::size_t>(receive.phase)];
    std::memcpy(from.sums[static_cast<std::size_t>(message.number)][parity].data(), record,
                static_cast<std::size_t>(header.lines) * line);
    // The first message of a step tells what all of them do: own patches may be reading when others
    // come.
    const char contributes = header.contributes != 0 ? 1 : 0;
    if (from.contributes[parity] != contributes) from.contributes[parity] = contributes;
    events.push_back(event);
    return;
  }
  auto& particles = receive.particles[parity];
  particles.resize(static_cast<std::size_t>(header.payload));
  if (particles.size() <= most_particles_along) {
    std::copy_n(record + line, particles.size(), particles.data());
    events.push_back(event);
  } else {
    long_messages_.emplace_back(r, streams_->receive_long(peer, 1 + receive.number, particles));
  }
}

template <int Dim>
void RankExchange<Dim>::look_at_long_messages(std::vector<ExchangeEvent>& events) {
  std::erase_if(long_messages_, [&](auto& message) {
    int done = 0;
    MPI_Test(&message.second, &done, MPI_STATUS_IGNORE);
    if (!done) return false;
    const Receive& receive = receives_[static_cast<std::size_t>(message.first)];
    const Step step = receive.expected - rounds_;
    events.push_back(
        {.kind = ExchangeEvent::Kind::message,
         .step = step,
         .due = exchange_due(receive.header[static_cast<std::size_t>(step % 2)].sent, latency_),
         .receive = message.first,
         .found = ticks()});
    return true;
  });
}

template <int Dim>
TraceRecorder* RankExchange<Dim>::recorder(Step step) const {
  if (loop_ < 0) return nullptr;
  return loop_ > 0 ? TraceRecorder::of_present() : TraceRecorder::active(step);
}

template <int Dim>
TraceRecord RankExchange<Dim>::placed(TraceRecord record, const TraceRecorder& recorder,
                                      Step step) const {
  record.loop = loop_;
  record.step = loop_ > 0 ? recorder.present() : step;
  if (loop_ > 0) record.round = static_cast<std::int32_t>(step);
  return record;
}

/// A message is sent or has come.
template <int Dim>
void RankExchange<Dim>::record(TraceKind kind, Step step, int phase, Index patch, int peer,
                               std::size_t bytes, std::uint64_t begin, std::uint64_t sent) const {
  TraceRecorder* const recorder = this->recorder(step);
  if (!recorder) return;
  const int phases = static_cast<int>(messages_.size()) / static_cast<int>(rounds_);
  const TraceRecord record{
      .begin = begin,
      .end = ticks(),
      .patch = static_cast<std::int32_t>(patch),
      .kind = kind,
      .phase = static_cast<std::uint8_t>(phase % phases),
      .detail = {
          .message = {.bytes = static_cast<std::int64_t>(bytes), .peer = peer, .sent = sent}}};
  recorder->add(placed(record, *recorder, step));
}

template <int Dim>
void RankExchange<Dim>::record(const ExchangeEvent& event) const {
  if (event.kind != ExchangeEvent::Kind::message) {
    TraceRecorder* const recorder = this->recorder(event.step);
    // Loops of solvers do nothing where ranks agree that a step of the graph is done.
    if (!recorder || (loop_ > 0 && event.kind == ExchangeEvent::Kind::step)) return;
    const auto which =
        event.kind == ExchangeEvent::Kind::step ? TraceAgreement::step : TraceAgreement::time_step;
    recorder->add(placed({.begin = event.begin,
                          .end = ticks(),
                          .kind = TraceKind::agreement,
                          .phase = static_cast<std::uint8_t>(which)},
                         *recorder, event.step));
    return;
  }
  const Receive& receive = receives_[static_cast<std::size_t>(event.receive)];
  const auto& from = patches_->elsewhere()[static_cast<std::size_t>(receive.elsewhere)];
  const Header& header = receive.header[static_cast<std::size_t>(event.step % 2)];
  const std::size_t bytes = receive.of_particles ? line + static_cast<std::size_t>(header.payload)
                                                 : static_cast<std::size_t>(header.lines) * line;
  record(TraceKind::arrival, event.step, receive.phase, from.patch, from.rank, bytes, event.found,
         header.posted);
}

template <int Dim>
void RankExchange<Dim>::deliver(const ExchangeEvent& event, Executor& executor) {
  record(event);
  switch (event.kind) {
    case ExchangeEvent::Kind::message: {
      const Receive& receive = receives_[static_cast<std::size_t>(event.receive)];
      executor.arrived(receive.phase, patches_->size() + receive.elsewhere);
      break;
    }
    case ExchangeEvent::Kind::limit:
      if (calls_.take_sums) calls_.take_sums(event.step, agreements_->sums());
      if (calls_.take_limit) calls_.take_limit(event.step, event.limit);
      executor.dt_agreed(event.step);
      break;
    case ExchangeEvent::Kind::step:
      calls_.take(event.step, agreements_->found(event.step));
      executor.step_agreed(event.step);
  }
}

template <int Dim>
void RankExchange<Dim>::unpack(int phase, int elsewhere, Step step) {
  const int r = receive_of_[static_cast<std::size_t>(phase)][static_cast<std::size_t>(elsewhere)];
  const Receive& receive = receives_[static_cast<std::size_t>(r)];
  RemotePatch<Dim>& from = patches_->elsewhere()[static_cast<std::size_t>(elsewhere)];
  const auto parity = static_cast<std::size_t>(step % 2);
  const Header& header = receive.header[parity];
  calls_.failure_elsewhere(header.failed_step);
  if (!receive.of_particles) return;
  clear(from);
  read_particles(receive.particles[parity].data(), header.particles, from);
}

template class RankExchange<2>;
template class RankExchange<3>;

}  // namespace lahar
