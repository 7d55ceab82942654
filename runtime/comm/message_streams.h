/// \file What a rank sends to others, in one stream of messages for each of them. Many records
/// share a message: the tasks of small and empty patches take less time than one takes to post, to
/// find and to receive. Messages to ranks of the same machine are written where these read them
/// (SharedRing), others are sent by MPI.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "runtime/comm/communicator.h"

namespace lahar {

class MessageStreams {
  struct Bundle;

 public:
  /// Records take whole lines of this many bytes, and begin at one.
  static constexpr std::size_t line = 64;
  static constexpr std::size_t lines(std::size_t bytes) { return (bytes + line - 1) / line * line; }

  /// A rank to exchange with, and what will be sent to it.
  struct Peer {
    int rank;
    std::size_t longest = 0;     ///< record [bytes], or less
    std::size_t of_a_step = 0;   ///< about as much is on its way at a time [bytes]
    bool shares_memory = false;  ///< is on this machine
  };

  /// A stream to and from each of `peers`, who must name each other. Collective.
  MessageStreams(const Communicator& ranks, const std::vector<Peer>& peers);
  MessageStreams(const MessageStreams&) = delete;
  MessageStreams& operator=(const MessageStreams&) = delete;
  /// Everything that was sent must have been received by then.
  ~MessageStreams();

  /// Room in the next message to a peer, to be written until this object ends. Not before that,
  /// and only after a call of post() or post_shared(), the message is on its way.
  class Record {
   public:
    Record(Bundle& bundle, std::byte* data) : bundle_(&bundle), data_(data) {}
    Record(const Record&) = delete;
    Record& operator=(const Record&) = delete;
    ~Record();
    std::byte* data() const { return data_; }

   private:
    Bundle* bundle_;
    std::byte* data_;
  };
  /// Any thread; `bytes` are whole lines. Records to a peer arrive in the order of these calls.
  Record record(std::size_t peer, std::size_t bytes);

  /// Whether post() may have something to do, and whether post_shared() cannot do it. Any thread.
  bool has_unposted() const {
    return shared_unposted_.load(std::memory_order_acquire) > 0 || has_unposted_for_mpi();
  }
  bool has_unposted_for_mpi() const { return unposted_.load(std::memory_order_acquire) > 0; }
  /// Peers to which there is shared memory.
  int sharing() const;

  /// Send messages whose records are written through shared memory, which takes no time. Any
  /// thread.
  void post_shared();
  /// Send all whose records are written. One thread at a time, as the rest from here on.
  void post();

  /// What is too long for a record, on its own: receiver and sender give the same tag, above 0.
  void send_long(std::size_t peer, int tag, std::vector<std::byte> bytes);
  MPI_Request receive_long(std::size_t peer, int tag, std::span<std::byte> to);

  /// Call take(peer, posted, records) for each message that has come, as long as there are any;
  /// `posted` are ticks() of the sender.
  template <class Take>
  void receive(Take&& take) {
    for (std::size_t peer = 0; peer < peers_.size(); ++peer)
      for (auto message = next_in_ring(peer); !message.empty(); message = next_in_ring(peer)) {
        take(peer, posted(message), message.subspan(line));
        taken_from_ring(peer);
      }
    while (const int count = look())
      for (int k = 0; k < count; ++k) {
        const auto peer = static_cast<std::size_t>(came_[static_cast<std::size_t>(k)]);
        const std::span<const std::byte> message = bytes_of(peer, static_cast<std::size_t>(k));
        take(peer, posted(message), message.subspan(line));
        expect_next(peer);
      }
  }

  /// Forget what has not been sent: others may never receive it. MPI and readers of shared memory
  /// keep the buffers.
  void abandon();

 private:
  struct Outgoing;
  struct Incoming;
  std::vector<std::size_t> share_memory(const std::vector<Peer>& peers);
  std::atomic<int>& unposted(const Outgoing& to);
  static std::unique_ptr<Bundle> new_bundle(Outgoing& to);
  static void seal(Outgoing& to, Bundle& bundle);
  std::unique_ptr<Bundle> next_to_post(Outgoing& to);
  std::span<const std::byte> next_in_ring(std::size_t peer) const;
  void taken_from_ring(std::size_t peer);
  int look();
  std::span<const std::byte> bytes_of(std::size_t peer, std::size_t k) const;
  static std::uint64_t posted(std::span<const std::byte> message);
  void expect_next(std::size_t peer);
  void reclaim(Outgoing& to);

  Communicator ranks_;
  std::vector<int> peers_;
  std::atomic<int> unposted_{0};         ///< messages that have records and are not posted: by MPI
  std::atomic<int> shared_unposted_{0};  ///< others
  std::vector<std::unique_ptr<Outgoing>> outgoing_;
  std::vector<std::unique_ptr<Incoming>> incoming_;
  std::vector<MPI_Request> next_;  ///< by peer: the receive of the message that comes next
  bool has_messages_ = false;      ///< of MPI: not all peers share memory
  std::vector<int> came_;
  std::vector<MPI_Status> status_;
};

}  // namespace lahar
