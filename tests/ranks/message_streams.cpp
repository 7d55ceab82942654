// Records that several threads send to all other ranks arrive whole, once, in the order in which
// each thread sent them, however they share messages.
#include "runtime/comm/message_streams.h"

#include <doctest/doctest.h>

#include <cstdint>
#include <cstring>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

using namespace lahar;

namespace {

/// What a record begins with; all bytes after it are `number`'s.
struct Mark {
  std::int64_t bytes, thread, number;
};

/// As different as sums of empty, of thin and of large patches; some longer than a message is as a
/// rule.
std::size_t size_of(std::int64_t number) {
  const std::int64_t lines =
      number % 100 == 99 ? 1000 : 1 + number * number * 7 % 97 * (number % 3);
  return MessageStreams::line * static_cast<std::size_t>(lines);
}

std::byte fill_of(std::int64_t number) {
  return static_cast<std::byte>(number % 251);
}

std::vector<int> others(const Communicator& ranks) {
  std::vector<int> peers;
  for (int r = 0; r < ranks.size(); ++r)
    if (r != ranks.rank()) peers.push_back(r);
  return peers;
}

std::vector<MessageStreams::Peer> streams_to(const std::vector<int>& ranks, std::size_t longest,
                                             bool shares_memory) {
  std::vector<MessageStreams::Peer> peers;
  for (const int rank : ranks)
    peers.push_back({.rank = rank, .longest = longest, .shares_memory = shares_memory});
  return peers;
}

constexpr std::int64_t n_records = 400;
constexpr int n_threads = 3;

/// Takes records apart, and counts what is not as it was sent.
struct Receiver {
  std::map<std::pair<std::size_t, std::int64_t>, std::int64_t> next;  ///< by peer and thread
  std::int64_t came = 0, wrong = 0;

  void take(std::size_t peer, std::span<const std::byte> records) {
    for (std::size_t at = 0; at < records.size();) {
      Mark mark;
      std::memcpy(&mark, &records[at], sizeof mark);
      const auto bytes = static_cast<std::size_t>(mark.bytes);
      if (mark.number != next[{peer, mark.thread}]++ || bytes != size_of(mark.number)) ++wrong;
      for (std::size_t b = sizeof mark; b < bytes; ++b)
        if (records[at + b] != fill_of(mark.number)) ++wrong;
      at += bytes;
      ++came;
    }
  }
};

/// `late`: nobody takes anything before the last record is written.
void send_by_several_threads(const Communicator& ranks, bool shares_memory, bool late) {
  CAPTURE(shares_memory);
  CAPTURE(late);
  Communicator group = ranks.duplicate();
  const std::vector<int> peers = others(ranks);
  Receiver receiver;
  {
    MessageStreams streams(group, streams_to(peers, size_of(99), shares_memory));
    CHECK(streams.sharing() == (shares_memory ? ranks.size() - 1 : 0));
    std::mutex mpi;
    std::vector<std::thread> threads;
    for (int t = 0; t < n_threads; ++t)
      threads.emplace_back([&, t] {
        for (std::int64_t number = 0; number < n_records; ++number) {
          for (std::size_t peer = 0; peer < peers.size(); ++peer) {
            const std::size_t bytes = size_of(number);
            const auto record = streams.record(peer, bytes);
            const Mark mark{static_cast<std::int64_t>(bytes), t, number};
            std::memset(record.data(), static_cast<int>(fill_of(number)), bytes);
            std::memcpy(record.data(), &mark, sizeof mark);
          }
          if (number % 5 != t) continue;
          const std::scoped_lock lock(mpi);
          streams.post();
        }
      });
    const auto expected = static_cast<std::int64_t>(peers.size()) * n_threads * n_records;
    const auto look = [&] {
      const std::scoped_lock lock(mpi);
      streams.post();
      streams.receive([&](std::size_t peer, std::uint64_t posted, std::span<const std::byte> list) {
        if (posted == 0) ++receiver.wrong;
        receiver.take(peer, list);
      });
    };
    if (late)
      for (std::thread& thread : threads) thread.join();
    while (receiver.came < expected) {
      look();
      std::this_thread::yield();  // to those who wait for the lock
    }
    for (std::thread& thread : threads)
      if (thread.joinable()) thread.join();
    while (streams.has_unposted()) look();  // others may still wait for the last records
    ranks.wait_for_all();                   // nobody ends while others still receive
  }
  CHECK(receiver.wrong == 0);
  CHECK(receiver.next.size() == peers.size() * n_threads);
  group.release();
}

}  // namespace

TEST_CASE("records of several threads arrive whole and in order") {
  const Communicator ranks = Communicator::world();
  if (!ranks.several()) return;
  send_by_several_threads(ranks, /*shares_memory=*/true, /*late=*/false);
  send_by_several_threads(ranks, /*shares_memory=*/true, /*late=*/true);
  send_by_several_threads(ranks, /*shares_memory=*/false, /*late=*/false);
}

TEST_CASE("what is longer than a message comes on its own") {
  const Communicator ranks = Communicator::world();
  if (!ranks.several()) return;
  Communicator group = ranks.duplicate();
  const std::vector<int> peers = others(ranks);
  {
    MessageStreams streams(group, streams_to(peers, 0, /*shares_memory=*/true));
    const auto value = [](int from, int to, int k) {
      return static_cast<std::byte>((7 * from + 3 * to + k) % 256);
    };
    constexpr std::size_t bytes = 300'001;
    std::vector<std::vector<std::byte>> come(peers.size(), std::vector<std::byte>(bytes));
    std::vector<MPI_Request> requests;
    for (std::size_t p = 0; p < peers.size(); ++p)
      requests.push_back(streams.receive_long(p, 5, come[p]));
    for (std::size_t p = 0; p < peers.size(); ++p) {
      std::vector<std::byte> message(bytes);
      for (std::size_t k = 0; k < bytes; ++k)
        message[k] = value(ranks.rank(), peers[p], static_cast<int>(k));
      streams.send_long(p, 5, std::move(message));
    }
    MPI_Waitall(static_cast<int>(requests.size()), requests.data(), MPI_STATUSES_IGNORE);
    std::size_t wrong = 0;
    for (std::size_t p = 0; p < peers.size(); ++p)
      for (std::size_t k = 0; k < bytes; ++k)
        wrong += come[p][k] != value(peers[p], ranks.rank(), static_cast<int>(k));
    CHECK(wrong == 0);
    ranks.wait_for_all();
  }
  group.release();
}
