/// \file Messages from one process to another of the same machine, through memory that both see:
/// nobody calls the system or MPI.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

namespace lahar {

/// Memory that processes of a machine share. It is gone when the last of them is, however they end.
class SharedMemory {
 public:
  /// Where other processes of the machine find it.
  struct Place {
    std::int64_t process = 0, descriptor = -1;
    std::uint64_t token = 0;  ///< tells that it is this memory, and not another with the same place
  };

  SharedMemory() = default;  ///< none
  /// Zeros, but for the token, in the first 8 bytes. None if the system has no more, or does not
  /// let processes share it.
  static SharedMemory make(std::size_t bytes);
  /// What make() of another process gave. None if it is not to be found.
  static SharedMemory find(const Place& place, std::size_t bytes);
  SharedMemory(SharedMemory&& other) noexcept { swap(other); }
  SharedMemory& operator=(SharedMemory&& other) noexcept {
    swap(other);
    return *this;
  }
  ~SharedMemory();

  explicit operator bool() const { return !bytes_.empty(); }
  std::span<std::byte> bytes() const { return bytes_; }
  const Place& place() const { return place_; }
  /// All who need it have found it.
  void hide();

 private:
  void swap(SharedMemory& other) noexcept {
    std::swap(bytes_, other.bytes_);
    std::swap(place_, other.place_);
  }
  std::span<std::byte> bytes_;
  Place place_;  ///< descriptor -1 = not to be found any more
};

/// A ring of messages in memory, all zeros but for the token, of one writer and one reader, each of
/// which has an object of this class over it. Messages are written where they will be read and come
/// in the order in which they were begun. The writer never waits: it finds no room while the reader
/// has not taken enough. Messages are not split at the end of the ring, behind which there is room
/// for a whole one.
class SharedRing {
 public:
  static constexpr std::size_t line = 64;

  /// [bytes] for a ring of this capacity for messages of at most `longest` bytes, which is less.
  /// All of them are multiples of a line.
  static std::size_t size(std::size_t capacity, std::size_t longest) {
    return first + capacity + line + longest;
  }
  SharedRing(std::span<std::byte> memory, std::size_t capacity)
      : memory_(memory.data()), capacity_(capacity) {}

  // --- the writer

  /// Room for the next message, of at most so many bytes; null = none now. One at a time.
  std::byte* room(std::size_t longest);
  /// The message for which there is room() has this size: another one may be begun. Returns what
  /// is to be given to publish(), when all of it is written.
  std::uint64_t end(std::size_t bytes);
  /// The reader may see messages up to this end.
  void publish(std::uint64_t end) { written().store(end, std::memory_order_release); }

  // --- the reader

  /// The next message, of at least one byte; empty = none has come.
  std::span<const std::byte> next() const;
  /// The memory of next() may be written over.
  void taken();

 private:
  using Count = std::atomic_ref<std::uint64_t>;
  static_assert(Count::is_always_lock_free);
  /// After the token of SharedMemory, and the two counts on lines of their own.
  static constexpr std::size_t first = 3 * line;

  Count count(std::size_t at) const {
    return Count(*reinterpret_cast<std::uint64_t*>(memory_ + at));
  }
  Count written() const { return count(line); }
  Count read() const { return count(2 * line); }
  std::byte* at(std::uint64_t count) const { return memory_ + first + count % capacity_; }
  /// Where the message after one at `begin` begins: a message that reaches the end of the ring is
  /// the last of its round.
  std::uint64_t after(std::uint64_t begin, std::size_t bytes) const {
    return std::min(begin + line + bytes, (begin / capacity_ + 1) * capacity_);
  }

  std::byte* memory_;
  std::size_t capacity_;
  std::uint64_t count_ = 0;  ///< bytes before the message that is begun or read next
  std::uint64_t seen_ = 0;   ///< by the writer, of read()
};

}  // namespace lahar
