#include "runtime/output/output_relay.h"

#include <algorithm>
#include <cstring>
#include <exception>
#include <utility>

namespace lahar {

namespace {

constexpr int tag = 1;

}  // namespace

int OutputRelay::writer_of(int rank, int ranks, int writers) {
  if (writers < 1 || writers >= ranks) return rank;
  // Group w is [w * ranks / writers, (w + 1) * ranks / writers): the last that does not begin
  // later.
  const Index w = ((Index{rank} + 1) * writers - 1) / ranks;
  return static_cast<int>(w * ranks / writers);
}

OutputRelay::OutputRelay(const Communicator& ranks, int writers)
    : ranks_(ranks),
      writer_(writer_of(ranks.rank(), ranks.size(), writers)),
      others_(0),
      memory_(std::make_unique<std::vector<std::byte>>()) {
  for (int r = 0; r < ranks.size(); ++r)
    if (r != ranks.rank() && writer_of(r, ranks.size(), writers) == ranks.rank()) ++others_;
}

OutputRelay::~OutputRelay() {
  if (request_ != MPI_REQUEST_NULL) static_cast<void>(memory_.release());  // MPI may still use it
}

// --- calls of MPI -----------------------------------------------------------------------------

void OutputRelay::progress() {
  if (!writes()) send();
  if (others_ > 0) receive();
}

void OutputRelay::send() {
  if (request_ != MPI_REQUEST_NULL) {
    int done = 0;
    MPI_Test(&request_, &done, MPI_STATUS_IGNORE);
    if (!done) return;
  }
  const std::scoped_lock lock(mutex_);
  if (blocks_.empty()) return;
  const Block block = std::move(blocks_.front());
  blocks_.pop_front();
  memory_->resize(sizeof(Index) + block.bytes.size());
  std::memcpy(memory_->data(), &block.place, sizeof(Index));
  std::copy(block.bytes.begin(), block.bytes.end(), memory_->begin() + sizeof(Index));
  MPI_Isend(memory_->data(), static_cast<int>(memory_->size()), MPI_BYTE, writer_, tag,
            ranks_.communicator(), &request_);
}

void OutputRelay::receive() {
  int done = 0;
  if (request_ != MPI_REQUEST_NULL) {
    MPI_Test(&request_, &done, MPI_STATUS_IGNORE);
    if (!done) return;
    Block block;
    std::memcpy(&block.place, memory_->data(), sizeof(Index));
    block.bytes.assign(memory_->begin() + sizeof(Index), memory_->end());
    const std::scoped_lock lock(mutex_);
    blocks_.push_back(std::move(block));
  }
  {
    const std::scoped_lock lock(mutex_);
    if (blocks_.size() >= slots) return;
  }
  MPI_Message message{};
  MPI_Status status{};
  MPI_Improbe(MPI_ANY_SOURCE, tag, ranks_.communicator(), &done, &message, &status);
  if (!done) return;
  int bytes = 0;
  MPI_Get_count(&status, MPI_BYTE, &bytes);
  memory_->resize(static_cast<std::size_t>(bytes));
  MPI_Imrecv(memory_->data(), bytes, MPI_BYTE, &message, &request_);
}

// --- the bytes ----------------------------------------------------------------------------------

void OutputRelay::push(Block block, const Wait& wait) {
  std::unique_lock lock(mutex_);
  while (blocks_.size() >= slots) {
    lock.unlock();
    wait();
    lock.lock();
  }
  blocks_.push_back(std::move(block));
}

void OutputRelay::give(Index place, std::span<const std::byte> bytes, const Wait& wait) {
  while (!bytes.empty()) {
    const auto some = bytes.first(std::min(bytes.size(), most_bytes));
    push({place, {some.begin(), some.end()}}, wait);
    place += static_cast<Index>(some.size());
    bytes = bytes.subspan(some.size());
  }
}

void OutputRelay::end(const ByteSink& write, const Wait& wait) {
  if (writes()) return take_all(write, wait);
  push({}, wait);
  while (true) {  // a file is through when nothing of it waits here any more
    {
      const std::scoped_lock lock(mutex_);
      if (blocks_.empty()) return;
    }
    wait();
  }
}

std::optional<OutputRelay::Block> OutputRelay::next() {
  const std::scoped_lock lock(mutex_);
  if (blocks_.empty()) return {};
  Block block = std::move(blocks_.front());
  blocks_.pop_front();
  return block;
}

void OutputRelay::take_all(const ByteSink& write, const Wait& wait) {
  std::exception_ptr failure;
  for (int left = others_; left > 0;) {
    const std::optional<Block> block = next();
    if (!block) {
      wait();
    } else if (block->place < 0) {
      --left;
    } else if (!failure) {
      try {
        write(block->place, block->bytes);
      } catch (...) {  // nobody can be told before all have given what they have
        failure = std::current_exception();
      }
    }
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace lahar
