#include "runtime/output/output_relay.h"

#include <algorithm>
#include <utility>

#include "runtime/output/output_agreement.h"

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
      memory_(std::make_unique<Block>()) {
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

bool OutputRelay::request_is_done() {
  int done = 1;
  if (request_ != MPI_REQUEST_NULL) MPI_Test(&request_, &done, MPI_STATUS_IGNORE);
  return done != 0;
}

void OutputRelay::send() {
  if (!request_is_done()) return;
  const std::scoped_lock lock(mutex_);
  if (blocks_.empty()) return;
  *memory_ = std::move(blocks_.front());
  blocks_.pop_front();
  MPI_Isend(memory_->data(), static_cast<int>(memory_->size()), MPI_BYTE, writer_, tag,
            ranks_.communicator(), &request_);
}

void OutputRelay::receive() {
  if (!request_is_done()) return;
  const std::scoped_lock lock(mutex_);
  if (!memory_->empty()) blocks_.push_back(std::exchange(*memory_, {}));
  if (blocks_.size() >= slots) return;
  int found = 0, bytes = 0;
  MPI_Message message{};
  MPI_Status status{};
  MPI_Improbe(MPI_ANY_SOURCE, tag, ranks_.communicator(), &found, &message, &status);
  if (!found) return;
  MPI_Get_count(&status, MPI_BYTE, &bytes);
  memory_->resize(static_cast<std::size_t>(bytes));
  MPI_Imrecv(memory_->data(), bytes, MPI_BYTE, &message, &request_);
}

// --- the bytes ----------------------------------------------------------------------------------

void OutputRelay::push(Index place, std::span<const std::byte> bytes, const Wait& wait) {
  Block block = bytes_of(std::span<const Index>(&place, 1));
  block.insert(block.end(), bytes.begin(), bytes.end());
  std::unique_lock lock(mutex_);
  while (blocks_.size() >= slots) {
    lock.unlock();
    wait();
    lock.lock();
  }
  blocks_.push_back(std::move(block));
}

/// Empty if there is none.
OutputRelay::Block OutputRelay::next() {
  const std::scoped_lock lock(mutex_);
  if (blocks_.empty()) return {};
  Block block = std::move(blocks_.front());
  blocks_.pop_front();
  return block;
}

void OutputRelay::give(Index place, std::span<const std::byte> bytes, const Wait& wait) {
  while (!bytes.empty()) {
    const auto some = bytes.first(std::min(bytes.size(), most_bytes));
    push(place, some, wait);
    place += static_cast<Index>(some.size());
    bytes = bytes.subspan(some.size());
  }
}

void OutputRelay::end(const ByteSink& write, const Wait& wait) {
  if (writes()) return take_all(write, wait);
  push(-1, {}, wait);
  const auto is_sent = [this] {
    const std::scoped_lock lock(mutex_);
    return blocks_.empty();
  };
  while (!is_sent()) wait();
}

void OutputRelay::take_all(const ByteSink& write, const Wait& wait) {
  for (int left = others_; left > 0;) {
    const Block block = next();
    if (block.empty()) {
      wait();
      continue;
    }
    const std::span<const std::byte> bytes(block);
    const Index place = values_of<Index>(bytes.first(sizeof(Index))).front();
    if (place < 0)
      --left;
    else
      write(place, bytes.subspan(sizeof(Index)));
  }
}

}  // namespace lahar
