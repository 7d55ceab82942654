#include "runtime/comm/message_streams.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <utility>

#include "physics/particles/patch.h"
#include "runtime/comm/shared_ring.h"
#include "runtime/trace/record/recorder.h"

#ifdef __SANITIZE_THREAD__
extern "C" void __tsan_release(void*);
extern "C" void __tsan_acquire(void*);
#endif

namespace lahar {

namespace {

/// The thread sanitizer sees one process, and not that another rank answers after it was asked. It
/// is told that all that is received comes after all that was sent before. That is more than is
/// true: who relies on the rest is not found.
#ifdef __SANITIZE_THREAD__
char other_ranks;
void is_sent() {
  __tsan_release(&other_ranks);
}
void is_received() {
  __tsan_acquire(&other_ranks);
}
#else
void is_sent() {}
void is_received() {}
#endif

constexpr int stream_tag = 0;
/// The least room of a message [bytes]: the records of some dozens of empty patches.
constexpr std::size_t least_capacity = 32768;
/// Receives of a stream that are posted ahead.
constexpr std::size_t ahead = 4;
/// The size of a ring [bytes]: what does not fit waits elsewhere, and is copied once more.
constexpr std::size_t least_ring = 131072, most_ring = 2097152;

/// What a rank tells another of the stream to it.
struct Offer {
  std::size_t capacity = 0;  ///< of messages
  std::size_t ring = 0;      ///< capacity; 0 = none
  SharedMemory::Place place;
};

}  // namespace

struct MessageStreams::Bundle {
  NodeArray own;                ///< empty if data is in a ring
  std::byte* data;              ///< begins with a line for ticks() when it is posted
  std::size_t size;             ///< [bytes]
  std::uint64_t end = 0;        ///< in the ring; 0 = records may follow
  std::atomic<int> writers{0};  ///< records that are being written
  MPI_Request request = MPI_REQUEST_NULL;

  bool in_ring() const { return own.empty(); }
};

struct MessageStreams::Outgoing {
  struct Long {
    std::vector<std::byte> bytes;
    MPI_Request request = MPI_REQUEST_NULL;
  };
  std::size_t capacity = 0;
  SharedMemory memory;
  std::optional<SharedRing> ring;
  std::mutex mutex;                             ///< of waiting, free and ring
  std::deque<std::unique_ptr<Bundle>> waiting;  ///< to be posted; the last one takes records
  std::vector<std::unique_ptr<Bundle>> free;    ///< with memory of their own
  std::deque<std::unique_ptr<Bundle>> posted;
  std::deque<Long> posted_long;
};

struct MessageStreams::Incoming {
  SharedMemory memory;
  std::optional<SharedRing> ring;
  std::array<NodeArray, ahead> data;
  std::array<MPI_Request, ahead> request;  ///< persistent; null if there is a ring
  std::size_t next = 0;
};

MessageStreams::MessageStreams(const Communicator& ranks, const std::vector<Peer>& peers)
    : ranks_(ranks), came_(peers.size()), status_(peers.size()) {
  for (const Peer& peer : peers) {
    peers_.push_back(peer.rank);
    Outgoing& to = *outgoing_.emplace_back(std::make_unique<Outgoing>());
    to.capacity = std::max(least_capacity, line + lines(peer.longest));
    incoming_.push_back(std::make_unique<Incoming>());
    incoming_.back()->request.fill(MPI_REQUEST_NULL);
  }
  const std::vector<std::size_t> capacity = share_memory(peers);
  for (std::size_t i = 0; i < peers.size(); ++i) {
    Incoming& from = *incoming_[i];
    for (std::size_t k = 0; k < ahead && !from.ring; ++k) {
      from.data[k].resize(capacity[i] / sizeof(double));
      MPI_Recv_init(from.data[k].data(), static_cast<int>(capacity[i]), MPI_BYTE, peers_[i],
                    stream_tag, ranks_.communicator(), &from.request[k]);
      MPI_Start(&from.request[k]);
      has_messages_ = true;
    }
    next_.push_back(from.request[0]);
  }
}

/// Rings to and from the peers on this machine. Returns the longest message from each peer [bytes].
std::vector<std::size_t> MessageStreams::share_memory(const std::vector<Peer>& peers) {
  const auto n = static_cast<std::size_t>(ranks_.size());
  std::vector<std::vector<Offer>> offers(n);
  for (std::size_t i = 0; i < peers.size(); ++i) {
    Outgoing& to = *outgoing_[i];
    auto& offered = offers[static_cast<std::size_t>(peers_[i])];
    Offer& offer = offered.emplace_back(Offer{.capacity = to.capacity, .ring = 0, .place = {}});
    if (!peers[i].shares_memory) continue;
    const std::size_t ring =
        std::max(std::clamp(lines(peers[i].of_a_step), least_ring, most_ring), 2 * to.capacity);
    to.memory = SharedMemory::make(SharedRing::size(ring, to.capacity));
    if (!to.memory) continue;
    to.ring.emplace(to.memory.bytes(), ring);
    offer.ring = ring;
    offer.place = to.memory.place();
  }
  offers = ranks_.exchange(offers);
  std::vector<std::vector<char>> found(n);
  std::vector<std::size_t> capacity;
  for (std::size_t i = 0; i < peers.size(); ++i) {
    const Offer& offer = offers[static_cast<std::size_t>(peers_[i])].at(0);
    capacity.push_back(offer.capacity);
    Incoming& from = *incoming_[i];
    if (offer.ring > 0) {
      from.memory = SharedMemory::find(offer.place, SharedRing::size(offer.ring, offer.capacity));
      if (from.memory) from.ring.emplace(from.memory.bytes(), offer.ring);
    }
    found[static_cast<std::size_t>(peers_[i])] = {from.ring ? char{1} : char{0}};
  }
  found = ranks_.exchange(found);
  for (std::size_t i = 0; i < peers.size(); ++i) {
    outgoing_[i]->memory.hide();
    if (found[static_cast<std::size_t>(peers_[i])].at(0) != 0) continue;
    outgoing_[i]->ring.reset();
    outgoing_[i]->memory = {};
  }
  return capacity;
}

MessageStreams::~MessageStreams() {
  for (const auto& from : incoming_)
    for (MPI_Request& request : from->request) {
      if (request == MPI_REQUEST_NULL) continue;
      MPI_Cancel(&request);
      MPI_Wait(&request, MPI_STATUS_IGNORE);
      MPI_Request_free(&request);
    }
  for (const auto& to : outgoing_) {
    for (const auto& bundle : to->posted) MPI_Wait(&bundle->request, MPI_STATUS_IGNORE);
    for (auto& message : to->posted_long) MPI_Wait(&message.request, MPI_STATUS_IGNORE);
  }
}

void MessageStreams::abandon() {
  static_cast<void>(new auto(std::move(outgoing_)));
  outgoing_.clear();
}

MessageStreams::Record MessageStreams::record(std::size_t peer, std::size_t bytes) {
  Outgoing& to = *outgoing_[peer];
  const std::scoped_lock lock(to.mutex);
  if (to.waiting.empty() || to.waiting.back()->size + bytes > to.capacity) {
    to.waiting.push_back(new_bundle(to));
    unposted(to).fetch_add(1, std::memory_order_release);
  }
  Bundle& bundle = *to.waiting.back();
  bundle.writers.fetch_add(1, std::memory_order_relaxed);
  std::byte* const data = bundle.data + bundle.size;
  bundle.size += bytes;
  return {bundle, data};
}

/// In the ring, unless what comes before is not, or there is no room.
std::unique_ptr<MessageStreams::Bundle> MessageStreams::new_bundle(Outgoing& to) {
  std::byte* room = nullptr;
  if (to.ring && (to.waiting.empty() || to.waiting.back()->in_ring())) {
    if (!to.waiting.empty()) seal(to, *to.waiting.back());
    room = to.ring->room(to.capacity);
  }
  std::unique_ptr<Bundle> bundle;
  if (room || to.free.empty()) {
    bundle = std::make_unique<Bundle>();
    if (!room) bundle->own.resize(to.capacity / sizeof(double));
  } else {
    bundle = std::move(to.free.back());
    to.free.pop_back();
  }
  bundle->data = room ? room : reinterpret_cast<std::byte*>(bundle->own.data());
  bundle->size = line;
  bundle->end = 0;
  return bundle;
}

/// No records follow in a message that is in the ring.
void MessageStreams::seal(Outgoing& to, Bundle& bundle) {
  if (bundle.end == 0) bundle.end = to.ring->end(bundle.size);
}

MessageStreams::Record::~Record() {
  bundle_->writers.fetch_sub(1, std::memory_order_release);
}

int MessageStreams::sharing() const {
  return static_cast<int>(std::count_if(outgoing_.begin(), outgoing_.end(),
                                        [](const auto& to) { return to->ring.has_value(); }));
}

std::atomic<int>& MessageStreams::unposted(const Outgoing& to) {
  return to.ring ? shared_unposted_ : unposted_;
}

void MessageStreams::post_shared() {
  if (shared_unposted_.load(std::memory_order_acquire) == 0) return;
  for (const auto& to : outgoing_) {
    if (!to->ring) continue;
    const std::scoped_lock lock(to->mutex);
    while (auto bundle = next_to_post(*to)) {
      to->ring->publish(bundle->end);
      if (!bundle->in_ring()) to->free.push_back(std::move(bundle));
    }
  }
}

void MessageStreams::post() {
  post_shared();
  for (std::size_t i = 0; i < peers_.size(); ++i) {
    Outgoing& to = *outgoing_[i];
    const auto next = [&] {
      const std::scoped_lock lock(to.mutex);
      return next_to_post(to);
    };
    for (auto bundle = to.ring ? nullptr : next(); bundle; bundle = next()) {
      MPI_Isend(bundle->data, static_cast<int>(bundle->size), MPI_BYTE, peers_[i], stream_tag,
                ranks_.communicator(), &bundle->request);
      to.posted.push_back(std::move(bundle));
    }
    reclaim(to);
  }
}

/// The first message that waits, if all of its records are written and there is room for it.
std::unique_ptr<MessageStreams::Bundle> MessageStreams::next_to_post(Outgoing& to) {
  if (to.waiting.empty() || to.waiting.front()->writers.load(std::memory_order_acquire) > 0)
    return nullptr;
  Bundle& first = *to.waiting.front();
  if (to.ring && !first.in_ring()) {
    std::byte* const room = to.ring->room(first.size);
    if (!room) return nullptr;
    std::memcpy(room, first.data, first.size);
    first.data = room;
  }
  if (to.ring) seal(to, first);
  const std::uint64_t tick = ticks();
  std::memcpy(first.data, &tick, sizeof tick);
  is_sent();
  auto bundle = std::move(to.waiting.front());
  to.waiting.pop_front();
  unposted(to).fetch_sub(1, std::memory_order_release);
  return bundle;
}

/// Buffers of messages that have been sent.
void MessageStreams::reclaim(Outgoing& to) {
  const auto sent = [](MPI_Request& request) {
    int done = 0;
    MPI_Test(&request, &done, MPI_STATUS_IGNORE);
    return done != 0;
  };
  while (!to.posted.empty() && sent(to.posted.front()->request)) {
    const std::scoped_lock lock(to.mutex);
    to.free.push_back(std::move(to.posted.front()));
    to.posted.pop_front();
  }
  while (!to.posted_long.empty() && sent(to.posted_long.front().request))
    to.posted_long.pop_front();
}

void MessageStreams::send_long(std::size_t peer, int tag, std::vector<std::byte> bytes) {
  auto& message = outgoing_[peer]->posted_long.emplace_back();
  message.bytes = std::move(bytes);
  MPI_Isend(message.bytes.data(), static_cast<int>(message.bytes.size()), MPI_BYTE, peers_[peer],
            tag, ranks_.communicator(), &message.request);
}

MPI_Request MessageStreams::receive_long(std::size_t peer, int tag, std::span<std::byte> to) {
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Irecv(to.data(), static_cast<int>(to.size()), MPI_BYTE, peers_[peer], tag,
            ranks_.communicator(), &request);
  return request;
}

std::span<const std::byte> MessageStreams::next_in_ring(std::size_t peer) const {
  const Incoming& from = *incoming_[peer];
  const auto message = from.ring ? from.ring->next() : std::span<const std::byte>();
  if (!message.empty()) is_received();
  return message;
}

void MessageStreams::taken_from_ring(std::size_t peer) {
  incoming_[peer]->ring->taken();
}

int MessageStreams::look() {
  if (!has_messages_) return 0;
  int count = 0;
  MPI_Testsome(static_cast<int>(next_.size()), next_.data(), &count, came_.data(), status_.data());
  if (count > 0) is_received();
  return std::max(count, 0);
}

std::uint64_t MessageStreams::posted(std::span<const std::byte> message) {
  std::uint64_t tick = 0;
  std::memcpy(&tick, message.data(), sizeof tick);
  return tick;
}

std::span<const std::byte> MessageStreams::bytes_of(std::size_t peer, std::size_t k) const {
  const Incoming& from = *incoming_[peer];
  int bytes = 0;
  MPI_Get_count(&status_[k], MPI_BYTE, &bytes);
  return {reinterpret_cast<const std::byte*>(from.data[from.next].data()),
          static_cast<std::size_t>(bytes)};
}

/// Messages of a stream come in the order in which they were sent.
void MessageStreams::expect_next(std::size_t peer) {
  Incoming& from = *incoming_[peer];
  MPI_Start(&from.request[from.next]);
  from.next = (from.next + 1) % ahead;
  next_[peer] = from.request[from.next];
}

}  // namespace lahar
