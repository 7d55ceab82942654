#include "runtime/rank_exchange.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <exception>
#include <map>

#include "physics/error.h"
#include "runtime/trace/recorder.h"

namespace lahar {

namespace {

/// What precedes every message: one line, so that sums lie on lines of their own.
struct Header {
  std::int64_t step;
  std::int64_t sent;         ///< [ns]
  std::int64_t failed_step;  ///< that the sender knows of
  std::int64_t contributes;  ///< sums follow, others are zero
  std::int64_t particles;
  std::int64_t payload;  ///< [bytes] of particles
  std::uint64_t tick = ticks();  ///< of the sender's clock, for traces
  std::int64_t unused = 0;
};
constexpr std::size_t line = 64;
constexpr int doubles_per_line = line / sizeof(double);
static_assert(sizeof(Header) == line && sum_stride == doubles_per_line);

/// Particles that fit into the message that is always expected; more follow in one of their own.
constexpr std::size_t particle_capacity = 4096;

std::int64_t now() {
  return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds{1};
}

/// When something that was sent has come. Clocks of other machines may be ahead.
std::int64_t due(std::int64_t sent, std::int64_t latency) {
  return latency > 0 ? std::min(sent, now()) + latency : sent;
}

template <class T>
void put(std::byte*& to, const T& value) {
  std::memcpy(to, &value, sizeof value);
  to += sizeof value;
}
template <class T>
T get(const std::byte*& from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  from += sizeof value;
  return value;
}

Header get_header(const std::byte* from) {
  return get<Header>(from);
}

/// Of a particle on its way: the patch that it goes to, its cell, id, loads, material, columns.
template <int Dim>
std::size_t record_bytes(const ColumnLayout<Dim>& layout) {
  return (5 + static_cast<std::size_t>(layout.rows())) * sizeof(double);
}

}  // namespace

/// One message from an own patch to another rank, in two buffers that take turns. A buffer is free
/// again when its turn comes: by then the receiver has used what it held.
template <int Dim>
struct RankExchange<Dim>::Send {
  int rank = -1, tag = 0;
  const RemoteNeighbour* to = nullptr;
  std::array<NodeArray, 2> sums;
  std::array<std::vector<std::byte>, 2> particles;
  std::array<MPI_Request, 2> full{MPI_REQUEST_NULL, MPI_REQUEST_NULL};    ///< persistent
  std::array<MPI_Request, 2> header{MPI_REQUEST_NULL, MPI_REQUEST_NULL};  ///< persistent
  std::array<MPI_Request*, 2> active{};
  std::array<MPI_Request, 2> single{MPI_REQUEST_NULL, MPI_REQUEST_NULL};  ///< particles
  std::array<MPI_Request, 2> overflow{MPI_REQUEST_NULL, MPI_REQUEST_NULL};

  void finish(std::size_t parity) {
    if (active[parity]) MPI_Wait(active[parity], MPI_STATUS_IGNORE);
    active[parity] = nullptr;
    MPI_Wait(&single[parity], MPI_STATUS_IGNORE);
    MPI_Wait(&overflow[parity], MPI_STATUS_IGNORE);
  }
};

template <int Dim>
struct RankExchange<Dim>::Receive {
  int phase, elsewhere, rank, tag;
  bool of_particles;
  Step expected = 0;
  std::array<std::vector<std::byte>, 2> particles, overflow;
  std::array<MPI_Request, 2> request{MPI_REQUEST_NULL, MPI_REQUEST_NULL};  ///< persistent
};

/// Something that has become known, not before `due`.
template <int Dim>
struct RankExchange<Dim>::Event {
  enum class Kind { message, limit, step } kind;
  Step step;
  std::int64_t due;  ///< [ns]
  int phase = 0, elsewhere = 0;
  double limit = 0;
  std::uint64_t begin = 0;  ///< agreements: ticks when this rank gave its part
  std::uint64_t found = ticks();
};

/// A record of a message, which is sent or has come.
template <class Patch>
static TraceRecord record_of(TraceKind kind, Step step, int phase, const Patch& patch, int peer,
                      std::int64_t bytes) {
  return {.begin = ticks(),
          .step = step,
          .patch = static_cast<std::int32_t>(patch),
          .kind = kind,
          .phase = static_cast<std::uint8_t>(phase),
          .detail = {.message = {.bytes = bytes, .peer = peer, .sent = 0}}};
}

static void record_now(TraceRecorder& recorder, TraceRecord record) {
  record.end = ticks();
  recorder.add(record);
}

/// Reductions on their way: one of the time step's limit, and of as many steps as patches may be
/// ahead.
template <int Dim>
class RankExchange<Dim>::Agreements {
 public:
  void give_limit(const Ranks& ranks, Step step, double limit) {
    limit_step_ = step;
    limit_begin_ = ticks();
    limit_given_ = {limit, -static_cast<double>(now())};
    MPI_Iallreduce(limit_given_.data(), limit_found_.data(), 2, MPI_DOUBLE, MPI_MIN,
                   ranks.communicator(), &limit_request_);
  }

  void give(const Ranks& ranks, Step step, Agreement&& own) {
    Pending& pending = of(step);
    pending.step = step;
    pending.begin = ticks();
    pending.given = std::move(own);
    pending.given.least.begun = -now();
    pending.found.sum.resize(pending.given.sum.size());
    MPI_Iallreduce(&pending.given.least, &pending.found.least, least_size, MPI_INT64_T, MPI_MIN,
                   ranks.communicator(), &pending.requests[0]);
    if (!pending.given.sum.empty())
      MPI_Iallreduce(pending.given.sum.data(), pending.found.sum.data(),
                     static_cast<int>(pending.given.sum.size()), MPI_INT64_T, MPI_SUM,
                     ranks.communicator(), &pending.requests[1]);
  }

  void look(std::int64_t latency, std::vector<Event>& events) {
    int done = 0;
    if (limit_step_ >= 0) {
      MPI_Test(&limit_request_, &done, MPI_STATUS_IGNORE);
      if (done) {
        events.push_back({.kind = Event::Kind::limit,
                          .step = limit_step_,
                          .due = due(-static_cast<std::int64_t>(limit_found_[1]), latency),
                          .limit = limit_found_[0],
                          .begin = limit_begin_});
        limit_step_ = -1;
      }
    }
    for (Pending& pending : pending_) {
      if (pending.step < 0) continue;
      MPI_Testall(2, pending.requests.data(), &done, MPI_STATUSES_IGNORE);
      if (!done) continue;
      events.push_back({.kind = Event::Kind::step,
                        .step = pending.step,
                        .due = due(-pending.found.least.begun, latency),
                        .begin = pending.begin});
      pending.step = -1;
    }
  }

  const Agreement& found(Step step) { return of(step).found; }

 private:
  static constexpr int least_size = sizeof(Agreement::Least) / sizeof(Index);
  struct Pending {
    Step step = -1;  ///< -1 = none
    std::uint64_t begin = 0;
    Agreement given, found;
    std::array<MPI_Request, 2> requests{MPI_REQUEST_NULL, MPI_REQUEST_NULL};
  };
  Pending& of(Step step) { return pending_[static_cast<std::size_t>(step % max_lead)]; }

  Step limit_step_ = -1;
  std::uint64_t limit_begin_ = 0;
  std::array<double, 2> limit_given_{}, limit_found_{};
  MPI_Request limit_request_ = MPI_REQUEST_NULL;
  std::array<Pending, max_lead> pending_;
};

template <int Dim>
RankExchange<Dim>::RankExchange(const ExchangeGroups& groups, PatchSet<Dim>& patches,
                                std::vector<RankMessage> messages, Step first, ExchangeCalls calls,
                                InjectedLatency latency)
    : ranks_(groups.patches),
      agreement_ranks_(groups.steps),
      limit_ranks_(groups.limits),
      patches_(&patches),
      messages_(std::move(messages)),
      calls_(std::move(calls)),
      latency_(static_cast<std::int64_t>(latency.seconds * 1e9)),
      agreements_(std::make_unique<Agreements>()) {
  int hops = 0;
  while ((1 << hops) < ranks_.size()) ++hops;
  agreement_latency_ = latency_ * hops;
  const auto phases = static_cast<int>(messages_.size());
  sends_.resize(messages_.size());
  receive_of_.assign(messages_.size(), std::vector<int>(patches.elsewhere().size(), -1));
  for (int f = 0; f < phases; ++f) {
    if (messages_[static_cast<std::size_t>(f)].kind == RankMessage::Kind::none) continue;
    make_sends(f);
    make_receives(f);
  }
  for (std::size_t r = 0; r < receives_.size(); ++r) {
    receives_[r].expected = first;
    requests_.push_back(receives_[r].request[static_cast<std::size_t>(first % 2)]);
    MPI_Start(&requests_.back());
  }
  requests_.resize(2 * receives_.size(), MPI_REQUEST_NULL);
  completed_.resize(requests_.size());
}

template <int Dim>
RankExchange<Dim>::~RankExchange() {
  // Receives for a step that is not taken any more.
  for (std::size_t r = 0; r < receives_.size(); ++r) {
    MPI_Cancel(&requests_[r]);
    MPI_Wait(&requests_[r], MPI_STATUS_IGNORE);
    for (MPI_Request& request : receives_[r].request) MPI_Request_free(&request);
  }
  if (std::uncaught_exceptions() > 0) {
    // Others may never receive what was sent. The process is about to end: MPI keeps the buffers.
    static_cast<void>(new auto(std::move(sends_)));
    static_cast<void>(agreements_.release());
    return;
  }
  // Sends have all been received.
  for (auto& of_phase : sends_)
    for (auto& of_patch : of_phase)
      for (Send& send : of_patch)
        for (std::size_t parity = 0; parity < 2; ++parity) {
          send.finish(parity);
          for (MPI_Request* request : {&send.full[parity], &send.header[parity]})
            if (*request != MPI_REQUEST_NULL) MPI_Request_free(request);
        }
}

/// Both sides count the patches that one rank sends to the other, in ascending order: this gives
/// their messages the same tags.
template <int Dim>
void RankExchange<Dim>::make_sends(int phase) {
  auto& sends = sends_[static_cast<std::size_t>(phase)];
  sends.resize(static_cast<std::size_t>(patches_->size()));
  std::map<int, int> count;
  for (int p = 0; p < patches_->size(); ++p)
    for (const RemoteNeighbour& to : patches_->sends(p)) {
      const int place = count[to.rank]++;
      make_send(phase, p, to, 2 * (place * static_cast<int>(messages_.size()) + phase));
    }
}

template <int Dim>
void RankExchange<Dim>::make_send(int phase, int patch, const RemoteNeighbour& to, int tag) {
  Send& send =
      sends_[static_cast<std::size_t>(phase)][static_cast<std::size_t>(patch)].emplace_back();
  send.rank = to.rank;
  send.tag = tag;
  send.to = &to;
  if (messages_[static_cast<std::size_t>(phase)].kind == RankMessage::Kind::particles) return;
  const std::size_t size = (to.nodes.size() + 1) * doubles_per_line;
  for (std::size_t parity = 0; parity < 2; ++parity) {
    send.sums[parity].assign(size, 0.0);
    MPI_Send_init(send.sums[parity].data(), static_cast<int>(size), MPI_DOUBLE, to.rank, tag,
                  ranks_.communicator(), &send.full[parity]);
    MPI_Send_init(send.sums[parity].data(), doubles_per_line, MPI_DOUBLE, to.rank, tag,
                  ranks_.communicator(), &send.header[parity]);
  }
}

template <int Dim>
void RankExchange<Dim>::make_receives(int phase) {
  const RankMessage& message = messages_[static_cast<std::size_t>(phase)];
  std::map<int, int> count;
  for (std::size_t e = 0; e < patches_->elsewhere().size(); ++e) {
    RemotePatch<Dim>& from = patches_->elsewhere()[e];
    const int place = count[from.rank]++;
    receive_of_[static_cast<std::size_t>(phase)][e] = static_cast<int>(receives_.size());
    Receive& receive = receives_.emplace_back();
    receive.phase = phase;
    receive.elsewhere = static_cast<int>(e);
    receive.rank = from.rank;
    receive.tag = 2 * (place * static_cast<int>(messages_.size()) + phase);
    receive.of_particles = message.kind == RankMessage::Kind::particles;
    const std::size_t size = receive.of_particles ? line + particle_capacity
                                                  : (static_cast<std::size_t>(from.mirrored) + 1) *
                                                        doubles_per_line * sizeof(double);
    for (std::size_t parity = 0; parity < 2; ++parity) {
      void* buffer = nullptr;
      if (receive.of_particles) {
        receive.particles[parity].resize(size);
        buffer = receive.particles[parity].data();
      } else {
        NodeArray& sums = from.sums[static_cast<std::size_t>(message.number)][parity];
        sums.assign(size / sizeof(double), 0.0);
        buffer = sums.data();
      }
      MPI_Recv_init(buffer, static_cast<int>(size), MPI_BYTE, from.rank, receive.tag,
                    ranks_.communicator(), &receive.request[parity]);
    }
  }
}

// --- sending
// --------------------------------------------------------------------------------------

template <int Dim>
void RankExchange<Dim>::send(int phase, int patch, Step step) {
  const auto f = static_cast<std::size_t>(phase);
  if (messages_[f].kind == RankMessage::Kind::none) return;
  for (Send& send : sends_[f][static_cast<std::size_t>(patch)]) {
    if (messages_[f].kind == RankMessage::Kind::sums)
      pack_sums(send, patch, step);
    else
      pack_particles(send, patch, step);
  }
}

template <int Dim>
void RankExchange<Dim>::pack_sums(Send& send, int patch, Step step) {
  const auto parity = static_cast<std::size_t>(step % 2);
  const Patch<Dim>& from = (*patches_)[patch];
  const int phase = send.tag / 2 % static_cast<int>(messages_.size());
  const RankMessage& message = messages_[static_cast<std::size_t>(phase)];
  TraceRecorder* const recorder = TraceRecorder::active(step);
  TraceRecord record =
      record_of(TraceKind::send, step, phase, from.topology.patch, send.rank, line);
  {
    const std::scoped_lock lock(mpi_);
    send.finish(parity);
  }
  const bool any = from.contributes[parity] != 0;
  double* to = send.sums[parity].data();
  const Header header{.step = step,
                      .sent = now(),
                      .failed_step = calls_.failed_step(),
                      .contributes = any,
                      .particles = 0,
                      .payload = 0};
  std::memcpy(to, &header, sizeof header);
  if (any) {
    const auto& copies = from.sums[message.sum_array];
    const double* sums = copies[static_cast<std::size_t>(step) % copies.size()].data();
    for (const Local node : send.to->nodes)
      std::memcpy(to += doubles_per_line, sums + static_cast<std::ptrdiff_t>(node) * sum_stride,
                  line);
  }
  {
    const std::scoped_lock lock(mpi_);
    send.active[parity] = any ? &send.full[parity] : &send.header[parity];
    MPI_Start(send.active[parity]);
  }
  if (any) record.detail.message.bytes = static_cast<std::int64_t>(send.sums[parity].size() * 8);
  if (recorder) record_now(*recorder, record);
}

template <int Dim>
void RankExchange<Dim>::pack_particles(Send& send, int patch, Step step) {
  const auto parity = static_cast<std::size_t>(step % 2);
  const Patch<Dim>& from = (*patches_)[patch];
  TraceRecorder* const recorder = TraceRecorder::active(step);
  TraceRecord record =
      record_of(TraceKind::send, step, send.tag / 2 % static_cast<int>(messages_.size()),
                from.topology.patch, send.rank, 0);
  {
    const std::scoped_lock lock(mpi_);
    send.finish(parity);
  }
  Index count = 0;
  for (const Local k : send.to->neighbours)
    count += from.outbox[static_cast<std::size_t>(k)].particles.size();
  const auto& layout = from.particles.layout();
  const std::size_t payload = static_cast<std::size_t>(count) * record_bytes(layout);
  auto& buffer = send.particles[parity];
  buffer.resize(line + payload);
  std::byte* to = buffer.data();
  put(to, Header{.step = step,
                 .sent = now(),
                 .failed_step = calls_.failed_step(),
                 .contributes = 0,
                 .particles = count,
                 .payload = static_cast<std::int64_t>(payload)});
  std::vector<double> rows(static_cast<std::size_t>(layout.rows()));
  for (const Local k : send.to->neighbours) {
    const auto& out = from.outbox[static_cast<std::size_t>(k)];
    for (Local i = 0; i < out.particles.size(); ++i) {
      const auto at = static_cast<std::size_t>(i);
      put(to, from.topology.neighbours[static_cast<std::size_t>(k)]);
      put(to, out.cell[at]);
      put(to, out.particles.id[at]);
      put(to, out.particles.loads.empty() ? std::uint64_t{0} : out.particles.loads[at]);
      put(to, static_cast<std::uint64_t>(out.particles.material[at]));
      out.particles.get(i, rows.data());
      std::memcpy(to, rows.data(), rows.size() * sizeof(double));
      to += rows.size() * sizeof(double);
    }
  }
  const bool fits = payload <= particle_capacity;
  {
    const std::scoped_lock lock(mpi_);
    MPI_Isend(buffer.data(), static_cast<int>(fits ? buffer.size() : line), MPI_BYTE, send.rank,
              send.tag, ranks_.communicator(), &send.single[parity]);
    if (!fits)
      MPI_Isend(buffer.data() + line, static_cast<int>(payload), MPI_BYTE, send.rank, send.tag + 1,
                ranks_.communicator(), &send.overflow[parity]);
  }
  record.detail.message.bytes = static_cast<std::int64_t>(buffer.size());
  if (recorder) record_now(*recorder, record);
}

template <int Dim>
void RankExchange<Dim>::give_dt(Step step) {
  const double limit = calls_.give_limit();
  const std::scoped_lock lock(mpi_);
  agreements_->give_limit(limit_ranks_, step, limit);
}

template <int Dim>
void RankExchange<Dim>::give_step(Step step) {
  Agreement own = calls_.give(step);
  const std::scoped_lock lock(mpi_);
  agreements_->give(agreement_ranks_, step, std::move(own));
}

// --- receiving ----------------------------------------------------------------------------------

template <int Dim>
bool RankExchange<Dim>::progress(Executor& executor) {
  std::vector<Event> events;
  {
    const std::unique_lock lock(mpi_, std::try_to_lock);
    if (!lock.owns_lock()) return false;
    look_at_messages(events);
    agreements_->look(agreement_latency_, events);
    if (calls_.others) calls_.others();
    if (latency_ > 0) {
      delayed_.insert(delayed_.end(), events.begin(), events.end());
      events.clear();
      const std::int64_t time = now();
      std::erase_if(delayed_, [&](const Event& event) {
        if (event.due > time) return false;
        events.push_back(event);
        return true;
      });
    }
  }
  for (const Event& event : events) deliver(event, executor);
  return !events.empty();
}

template <int Dim>
void RankExchange<Dim>::look_at_messages(std::vector<Event>& events) {
  const auto n = receives_.size();
  if (n == 0) return;
  int count = 0;
  MPI_Testsome(static_cast<int>(overflows_ > 0 ? 2 * n : n), requests_.data(), &count,
               completed_.data(), MPI_STATUSES_IGNORE);
  for (int k = 0; k < count; ++k) {
    const auto r = static_cast<std::size_t>(completed_[static_cast<std::size_t>(k)]);
    if (r < n) {
      message_came(r, events);
    } else {
      --overflows_;
      const Receive& receive = receives_[r - n];
      const auto parity = static_cast<std::size_t>((receive.expected - 1) % 2);
      const std::byte* from = receive.particles[parity].data();
      events.push_back({.kind = Event::Kind::message,
                        .step = receive.expected - 1,
                        .due = due(get<Header>(from).sent, latency_),
                        .phase = receive.phase,
                        .elsewhere = receive.elsewhere});
    }
  }
}

/// The receive for the step after can be posted at once: what its buffer held has been used, or the
/// sender would not have got here.
template <int Dim>
void RankExchange<Dim>::message_came(std::size_t r, std::vector<Event>& events) {
  Receive& receive = receives_[r];
  const Step step = receive.expected++;
  const auto parity = static_cast<std::size_t>(step % 2);
  const auto number =
      static_cast<std::size_t>(messages_[static_cast<std::size_t>(receive.phase)].number);
  const auto& from = patches_->elsewhere()[static_cast<std::size_t>(receive.elsewhere)];
  const auto* bytes = receive.of_particles
                          ? receive.particles[parity].data()
                          : reinterpret_cast<const std::byte*>(from.sums[number][parity].data());
  const auto header = get<Header>(bytes);
  if (header.step != step)
    throw RankError("rank " + std::to_string(receive.rank) + " sent step " +
                    std::to_string(header.step) + " where " + std::to_string(step) +
                    " was expected");
  requests_[r] = receive.request[1 - parity];
  MPI_Start(&requests_[r]);
  const auto payload = static_cast<std::size_t>(header.payload);
  if (receive.of_particles && payload > particle_capacity) {
    receive.overflow[parity].resize(payload);
    MPI_Irecv(receive.overflow[parity].data(), static_cast<int>(payload), MPI_BYTE, receive.rank,
              receive.tag + 1, ranks_.communicator(), &requests_[receives_.size() + r]);
    ++overflows_;
    return;
  }
  events.push_back({.kind = Event::Kind::message,
                    .step = step,
                    .due = due(header.sent, latency_),
                    .phase = receive.phase,
                    .elsewhere = receive.elsewhere});
}

template <int Dim>
void RankExchange<Dim>::record(const Event& event) const {
  TraceRecorder* const recorder = TraceRecorder::active(event.step);
  if (!recorder) return;
  if (event.kind != Event::Kind::message) {
    const auto which =
        event.kind == Event::Kind::step ? TraceAgreement::step : TraceAgreement::time_step;
    recorder->add({.begin = event.begin,
                   .end = ticks(),
                   .step = event.step,
                   .kind = TraceKind::agreement,
                   .phase = static_cast<std::uint8_t>(which)});
    return;
  }
  const auto f = static_cast<std::size_t>(event.phase);
  const auto& from = patches_->elsewhere()[static_cast<std::size_t>(event.elsewhere)];
  const Receive& receive = receives_[static_cast<std::size_t>(
      receive_of_[f][static_cast<std::size_t>(event.elsewhere)])];
  const auto parity = static_cast<std::size_t>(event.step % 2);
  const auto number = static_cast<std::size_t>(messages_[f].number);
  const auto header = get_header(receive.of_particles
                                     ? receive.particles[parity].data()
                                     : reinterpret_cast<const std::byte*>(
                                           from.sums[number][parity].data()));
  const std::size_t sums =
      header.contributes ? (static_cast<std::size_t>(from.mirrored) + 1) * line : line;
  recorder->add({.begin = event.found,
                 .end = ticks(),
                 .step = event.step,
                 .patch = static_cast<std::int32_t>(from.patch),
                 .kind = TraceKind::arrival,
                 .phase = static_cast<std::uint8_t>(event.phase),
                 .detail = {.message = {.bytes = static_cast<std::int64_t>(
                                            receive.of_particles
                                                ? line + static_cast<std::size_t>(header.payload)
                                                : sums),
                                        .peer = from.rank,
                                        .sent = header.tick}}});
}

template <int Dim>
void RankExchange<Dim>::deliver(const Event& event, Executor& executor) {
  record(event);
  switch (event.kind) {
    case Event::Kind::message:
      executor.arrived(event.phase, patches_->size() + event.elsewhere);
      break;
    case Event::Kind::limit:
      calls_.take_limit(event.step, event.limit);
      executor.dt_agreed(event.step);
      break;
    case Event::Kind::step:
      calls_.take(event.step, agreements_->found(event.step));
      executor.step_agreed(event.step);
  }
}

template <int Dim>
void clear(RemotePatch<Dim>& from) {
  for (auto& out : from.outbox) {
    if (out.cell.empty()) continue;
    out.particles.clear();
    out.cell.clear();
    *out.filled = 0;
  }
}

template <int Dim>
void RankExchange<Dim>::unpack(int phase, int elsewhere, Step step) {
  const auto f = static_cast<std::size_t>(phase);
  const int r = receive_of_[f][static_cast<std::size_t>(elsewhere)];
  const Receive& receive = receives_[static_cast<std::size_t>(r)];
  RemotePatch<Dim>& from = patches_->elsewhere()[static_cast<std::size_t>(elsewhere)];
  const auto parity = static_cast<std::size_t>(step % 2);
  if (!receive.of_particles) {
    const auto number = static_cast<std::size_t>(messages_[f].number);
    const auto* bytes = reinterpret_cast<const std::byte*>(from.sums[number][parity].data());
    const auto header = get<Header>(bytes);
    from.contributes[parity] = header.contributes != 0;
    calls_.failure_elsewhere(header.failed_step);
    return;
  }
  const std::byte* bytes = receive.particles[parity].data();
  const auto header = get<Header>(bytes);
  calls_.failure_elsewhere(header.failed_step);
  if (static_cast<std::size_t>(header.payload) > particle_capacity)
    bytes = receive.overflow[parity].data();
  clear(from);
  std::vector<double> rows;
  for (std::int64_t i = 0; i < header.particles; ++i) {
    const auto target = get<Index>(bytes);
    const auto at = std::lower_bound(from.outbox_patch.begin(), from.outbox_patch.end(), target) -
                    from.outbox_patch.begin();
    auto& out = from.outbox[static_cast<std::size_t>(at)];
    out.cell.push_back(get<Index>(bytes));
    const auto id = get<Index>(bytes);
    const auto loads = get<std::uint64_t>(bytes);
    const auto material = static_cast<std::uint16_t>(get<std::uint64_t>(bytes));
    rows.resize(static_cast<std::size_t>(out.particles.layout().rows()));
    std::memcpy(rows.data(), bytes, rows.size() * sizeof(double));
    bytes += rows.size() * sizeof(double);
    out.particles.append(rows.data(), id, material, loads);
    *out.filled = 1;
  }
}

template void clear<2>(RemotePatch<2>&);
template void clear<3>(RemotePatch<3>&);
template class RankExchange<2>;
template class RankExchange<3>;

}  // namespace lahar
