// A ring of messages that one writes and another reads at the same time.
#include "runtime/comm/shared_ring.h"

#include <doctest/doctest.h>

#include <cstring>
#include <optional>
#include <thread>
#include <vector>

using namespace lahar;

namespace {

constexpr std::size_t line = SharedRing::line;

struct Memory {
  explicit Memory(std::size_t capacity, std::size_t longest)
      : lines(SharedRing::size(capacity, longest) / line) {}
  std::span<std::byte> bytes() { return std::as_writable_bytes(std::span(lines)); }

 private:
  struct alignas(line) Line {
    std::byte bytes[line] = {};
  };
  std::vector<Line> lines;
};

std::size_t size_of(int number) {
  return line * static_cast<std::size_t>(1 + number * 7 % 5);
}

}  // namespace

TEST_CASE("messages come whole and in order through a ring that is full most of the time") {
  constexpr int n = 20000;
  for (const std::size_t capacity : {6 * line, 7 * line, 20 * line}) {
    CAPTURE(capacity);
    Memory memory(capacity, 5 * line);
    std::thread writer([&] {
      SharedRing ring(memory.bytes(), capacity);
      for (int number = 0; number < n;) {
        std::byte* const room = ring.room(5 * line);
        if (!room) {
          std::this_thread::yield();
          continue;
        }
        std::memset(room, number % 251, size_of(number));
        ring.publish(ring.end(size_of(number)));
        ++number;
      }
    });
    SharedRing ring(memory.bytes(), capacity);
    int wrong = 0;
    for (int number = 0; number < n;) {
      const auto message = ring.next();
      if (message.empty()) {
        std::this_thread::yield();
        continue;
      }
      if (message.size() != size_of(number)) ++wrong;
      for (const std::byte byte : message)
        if (byte != static_cast<std::byte>(number % 251)) ++wrong;
      ring.taken();
      ++number;
    }
    writer.join();
    CHECK(wrong == 0);
    CHECK(ring.next().empty());
  }
}

TEST_CASE("a ring has no room until enough of it has been read") {
  constexpr std::size_t capacity = 8 * line;
  Memory memory(capacity, 4 * line);
  SharedRing writer(memory.bytes(), capacity), reader(memory.bytes(), capacity);
  std::vector<std::uint64_t> ends;
  while (writer.room(3 * line)) ends.push_back(writer.end(3 * line));
  CHECK(ends.size() == 2);
  CHECK(reader.next().empty());  // they are not published
  writer.publish(ends[0]);
  CHECK(reader.next().size() == 3 * line);
  reader.taken();
  CHECK(reader.next().empty());
  CHECK(writer.room(3 * line));
  writer.publish(ends[1]);
  CHECK(reader.next().size() == 3 * line);
}

TEST_CASE("shared memory is found where it was made, and nothing else is taken for it") {
  constexpr std::size_t bytes = 10000;
  SharedMemory made = SharedMemory::make(bytes);
  REQUIRE(made);
  const SharedMemory found = SharedMemory::find(made.place(), bytes);
  REQUIRE(found);
  made.bytes()[5000] = std::byte{42};
  CHECK(found.bytes()[5000] == std::byte{42});

  CHECK_FALSE(SharedMemory::find(made.place(), bytes + 1));
  SharedMemory::Place other = made.place();
  ++other.token;
  CHECK_FALSE(SharedMemory::find(other, bytes));
  const SharedMemory::Place place = made.place();
  made.hide();
  CHECK_FALSE(SharedMemory::find(place, bytes));
  CHECK(found.bytes()[5000] == std::byte{42});
}
