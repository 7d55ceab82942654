#include "runtime/message_streams.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "physics/patch.h"
#include "runtime/trace/recorder.h"

namespace lahar {

namespace {

constexpr int stream_tag = 0;
/// Of a message, at least [bytes]: the records of some dozens of empty patches.
constexpr std::size_t least_capacity = 32768;
/// Receives of a stream that are posted ahead.
constexpr std::size_t ahead = 4;

}  // namespace

struct MessageStreams::Bundle {
  explicit Bundle(std::size_t capacity) : data(capacity / sizeof(double)) {}
  NodeArray data;               ///< begins with a line for ticks() when it is posted
  std::size_t size = line;      ///< [bytes]
  std::atomic<int> writers{0};  ///< records that are being written
  MPI_Request request = MPI_REQUEST_NULL;
};

struct MessageStreams::Outgoing {
  struct Long {
    std::vector<std::byte> bytes;
    MPI_Request request = MPI_REQUEST_NULL;
  };
  std::size_t capacity = 0;
  std::mutex mutex;                             ///< of waiting and free
  std::deque<std::unique_ptr<Bundle>> waiting;  ///< to be posted; the last one takes records
  std::vector<std::unique_ptr<Bundle>> free;
  std::deque<std::unique_ptr<Bundle>> posted;
  std::deque<Long> posted_long;
};

struct MessageStreams::Incoming {
  std::array<NodeArray, ahead> data;
  std::array<MPI_Request, ahead> request;  ///< persistent
  std::size_t next = 0;
};

MessageStreams::MessageStreams(const Ranks& ranks, std::vector<int> peers,
                               const std::vector<std::size_t>& longest)
    : ranks_(ranks), peers_(std::move(peers)), came_(peers_.size()), status_(peers_.size()) {
  std::vector<std::vector<std::size_t>> capacity(static_cast<std::size_t>(ranks_.size()));
  for (std::size_t i = 0; i < peers_.size(); ++i) {
    outgoing_.push_back(std::make_unique<Outgoing>());
    outgoing_[i]->capacity = std::max(least_capacity, line + lines(longest[i]));
    capacity[static_cast<std::size_t>(peers_[i])] = {outgoing_[i]->capacity};
  }
  capacity = ranks_.exchange(capacity);
  for (const int peer : peers_) {
    const std::size_t bytes = capacity[static_cast<std::size_t>(peer)].at(0);
    Incoming& from = *incoming_.emplace_back(std::make_unique<Incoming>());
    for (std::size_t k = 0; k < ahead; ++k) {
      from.data[k].resize(bytes / sizeof(double));
      MPI_Recv_init(from.data[k].data(), static_cast<int>(bytes), MPI_BYTE, peer, stream_tag,
                    ranks_.communicator(), &from.request[k]);
      MPI_Start(&from.request[k]);
    }
    next_.push_back(from.request[0]);
  }
}

MessageStreams::~MessageStreams() {
  for (const auto& from : incoming_)
    for (MPI_Request& request : from->request) {
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
    if (to.free.empty()) to.free.push_back(std::make_unique<Bundle>(to.capacity));
    to.waiting.push_back(std::move(to.free.back()));
    to.free.pop_back();
    unposted_.fetch_add(1, std::memory_order_release);
  }
  Bundle& bundle = *to.waiting.back();
  bundle.writers.fetch_add(1, std::memory_order_relaxed);
  std::byte* const data = reinterpret_cast<std::byte*>(bundle.data.data()) + bundle.size;
  bundle.size += bytes;
  return {bundle, data};
}

MessageStreams::Record::~Record() {
  bundle_->writers.fetch_sub(1, std::memory_order_release);
}

void MessageStreams::post() {
  for (std::size_t i = 0; i < peers_.size(); ++i) {
    Outgoing& to = *outgoing_[i];
    const auto next = [&]() -> std::unique_ptr<Bundle> {
      const std::scoped_lock lock(to.mutex);
      if (to.waiting.empty() || to.waiting.front()->writers.load(std::memory_order_acquire) > 0)
        return nullptr;
      auto bundle = std::move(to.waiting.front());
      to.waiting.pop_front();
      return bundle;
    };
    while (auto bundle = next()) {
      const std::uint64_t tick = ticks();
      std::memcpy(bundle->data.data(), &tick, sizeof tick);
      MPI_Isend(bundle->data.data(), static_cast<int>(bundle->size), MPI_BYTE, peers_[i],
                stream_tag, ranks_.communicator(), &bundle->request);
      unposted_.fetch_sub(1, std::memory_order_release);
      to.posted.push_back(std::move(bundle));
    }
    reclaim(to);
  }
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
    to.posted.front()->size = line;
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

int MessageStreams::look() {
  if (next_.empty()) return 0;
  int count = 0;
  MPI_Testsome(static_cast<int>(next_.size()), next_.data(), &count, came_.data(), status_.data());
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
