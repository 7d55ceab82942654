#include "runtime/output/output_agreement.h"

#include <limits>
#include <utility>

#include "physics/base/error.h"

namespace lahar {

OutputAgreement::OutputAgreement(const Communicator& ranks)
    : ranks_(ranks.duplicate()), memory_(std::make_unique<Memory>()) {
  memory_->parts.resize(static_cast<std::size_t>(ranks.size()));
}

OutputAgreement::~OutputAgreement() {
  if (request_ != MPI_REQUEST_NULL) static_cast<void>(memory_.release());  // MPI may still use it
}

void OutputAgreement::start(std::vector<std::byte> own, bool failed) {
  memory_->parts[static_cast<std::size_t>(ranks_.rank())] = {static_cast<Index>(own.size()),
                                                             failed};
  memory_->own = std::move(own);
  stage_ = Stage::started;
  if (ranks_.several()) return;
  lay_out();
  memory_->all = memory_->own;
  stage_ = Stage::done;
}

bool OutputAgreement::progress() {
  if (stage_ == Stage::done) return false;
  int done = 1;
  if (request_ != MPI_REQUEST_NULL) MPI_Test(&request_, &done, MPI_STATUS_IGNORE);
  if (!done) return false;
  Memory& memory = *memory_;
  if (stage_ == Stage::started) {
    MPI_Iallgather(MPI_IN_PLACE, 0, MPI_DATATYPE_NULL, memory.parts.data(), 2, MPI_INT64_T,
                   ranks_.communicator(), &request_);
    stage_ = Stage::counting;
  } else if (stage_ == Stage::counting) {
    lay_out();
    MPI_Iallgatherv(memory.own.data(), static_cast<int>(memory.own.size()), MPI_BYTE,
                    memory.all.data(), memory.sizes.data(), memory.places.data(), MPI_BYTE,
                    ranks_.communicator(), &request_);
    stage_ = Stage::gathering;
  } else {
    stage_ = Stage::done;
  }
  return stage_ == Stage::done;
}

/// Where the bytes of each rank will be among those of all.
void OutputAgreement::lay_out() {
  Index all = 0;
  memory_->sizes.clear();
  memory_->places.clear();
  for (const Part& part : memory_->parts) {
    memory_->sizes.push_back(static_cast<int>(part.bytes));
    memory_->places.push_back(static_cast<int>(all));
    all += part.bytes;
  }
  if (all > std::numeric_limits<int>::max())
    throw IoError("MPI cannot send what ranks have to know about a file of so many parts");
  memory_->all.resize(static_cast<std::size_t>(all));
}

std::span<const std::byte> OutputAgreement::of(int rank) const {
  const auto r = static_cast<std::size_t>(rank);
  return all().subspan(static_cast<std::size_t>(memory_->places[r]),
                       static_cast<std::size_t>(memory_->sizes[r]));
}

std::optional<int> OutputAgreement::failed_rank() const {
  for (int r = 0; r < ranks_.size(); ++r)
    if (memory_->parts[static_cast<std::size_t>(r)].failed != 0) return r;
  return {};
}

}  // namespace lahar
