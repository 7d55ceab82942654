#include "runtime/comm/shared_ring.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <random>
#include <string>

namespace lahar {

namespace {

std::span<std::byte> map(int descriptor, std::size_t bytes) {
  void* const memory =
      mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, /*offset=*/0);
  if (memory == MAP_FAILED) return {};
  return {static_cast<std::byte*>(memory), bytes};
}

std::uint64_t any_token() {
  std::random_device random;
  return std::uint64_t{random()} << 32 | random();
}

}  // namespace

SharedMemory SharedMemory::make(std::size_t bytes) {
  SharedMemory memory;
  const int descriptor = memfd_create("lahar", MFD_CLOEXEC);
  if (descriptor < 0) return memory;
  memory.place_ = {getpid(), descriptor, any_token()};
  // Taken from the system now: later there may be none, which would end the process.
  int error = EINTR;
  while (error == EINTR) error = posix_fallocate(descriptor, 0, static_cast<off_t>(bytes));
  if (error != 0) return memory;
  memory.bytes_ = map(descriptor, bytes);
  if (memory) std::memcpy(memory.bytes_.data(), &memory.place_.token, sizeof(std::uint64_t));
  return memory;
}

SharedMemory SharedMemory::find(const Place& place, std::size_t bytes) {
  SharedMemory memory;
  const std::string path =
      "/proc/" + std::to_string(place.process) + "/fd/" + std::to_string(place.descriptor);
  struct stat status {};
  // What else may be there must not be opened: that may have effects, or wait.
  if (place.descriptor < 0 || stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode) ||
      status.st_size != static_cast<off_t>(bytes))
    return memory;
  const int descriptor = open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (descriptor < 0) return memory;
  memory.bytes_ = map(descriptor, bytes);
  close(descriptor);
  std::uint64_t token = 0;
  if (memory) std::memcpy(&token, memory.bytes_.data(), sizeof token);
  return token == place.token ? std::move(memory) : SharedMemory();
}

SharedMemory::~SharedMemory() {
  hide();
  if (!bytes_.empty()) munmap(bytes_.data(), bytes_.size());
}

void SharedMemory::hide() {
  if (place_.descriptor >= 0) close(static_cast<int>(place_.descriptor));
  place_.descriptor = -1;
}

std::byte* SharedRing::room(std::size_t longest) {
  const std::uint64_t end = after(count_, longest);
  if (end - seen_ > capacity_) seen_ = read().load(std::memory_order_acquire);
  return end - seen_ > capacity_ ? nullptr : at(count_) + line;
}

std::uint64_t SharedRing::end(std::size_t bytes) {
  std::memcpy(at(count_), &bytes, sizeof bytes);
  return count_ = after(count_, bytes);
}

std::span<const std::byte> SharedRing::next() const {
  if (written().load(std::memory_order_acquire) == count_) return {};
  std::size_t bytes = 0;
  std::memcpy(&bytes, at(count_), sizeof bytes);
  return {at(count_) + line, bytes};
}

void SharedRing::taken() {
  count_ = after(count_, next().size());
  read().store(count_, std::memory_order_release);
}

}  // namespace lahar
