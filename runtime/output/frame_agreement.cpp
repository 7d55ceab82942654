#include "runtime/output/frame_agreement.h"

#include <limits>
#include <type_traits>

namespace lahar {

namespace {

constexpr int nobody = std::numeric_limits<int>::max();

static_assert(std::is_trivially_copyable_v<FrameLayout>);

}  // namespace

FrameAgreement::FrameAgreement(const Communicator& ranks)
    : ranks_(ranks.duplicate()), memory_(std::make_unique<Memory>()) {
  memory_->all.resize(static_cast<std::size_t>(ranks.size()));
}

FrameAgreement::~FrameAgreement() {
  if (request_ != MPI_REQUEST_NULL) static_cast<void>(memory_.release());  // MPI may still use it
}

void FrameAgreement::release() {
  ranks_.release();
}

bool FrameAgreement::done() {
  if (request_ == MPI_REQUEST_NULL) return true;
  int done = 0;
  MPI_Test(&request_, &done, MPI_STATUS_IGNORE);
  return done != 0;
}

void FrameAgreement::start_counting(Index particles, bool failed) {
  memory_->own = {particles, failed};
  if (several())
    MPI_Iallgather(&memory_->own, 2, MPI_INT64_T, memory_->all.data(), 2, MPI_INT64_T,
                   ranks_.communicator(), &request_);
  else
    memory_->all[0] = memory_->own;
  memory_->first_failed = nobody;
}

Index FrameAgreement::before() const {
  Index sum = 0;
  for (int r = 0; r < rank(); ++r) sum += memory_->all[static_cast<std::size_t>(r)].particles;
  return sum;
}

Index FrameAgreement::total() const {
  Index sum = 0;
  for (const Count& count : memory_->all) sum += count.particles;
  return sum;
}

void FrameAgreement::start_telling(const FrameLayout& layout) {
  memory_->layout = layout;
  if (several())
    MPI_Ibcast(&memory_->layout, sizeof(FrameLayout), MPI_BYTE, 0, ranks_.communicator(),
               &request_);
}

void FrameAgreement::start_reporting(bool failed) {
  for (Count& count : memory_->all) count.failed = 0;
  memory_->failed = failed ? rank() : nobody;
  if (several())
    MPI_Iallreduce(&memory_->failed, &memory_->first_failed, 1, MPI_INT, MPI_MIN,
                   ranks_.communicator(), &request_);
  else
    memory_->first_failed = memory_->failed;
}

std::optional<int> FrameAgreement::failed_rank() const {
  if (memory_->first_failed != nobody) return memory_->first_failed;
  for (int r = 0; r < ranks_.size(); ++r)
    if (memory_->all[static_cast<std::size_t>(r)].failed != 0) return r;
  return {};
}

}  // namespace lahar
