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
  if (!ranks_.several()) return start_gathering();
  counting_ = true;
  MPI_Iallgather(MPI_IN_PLACE, 0, MPI_DATATYPE_NULL, memory_->parts.data(), 2, MPI_INT64_T,
                 ranks_.communicator(), &request_);
}

bool OutputAgreement::done() {
  if (!request_is_done()) return false;
  if (!std::exchange(counting_, false)) return true;
  start_gathering();
  return request_is_done();
}

bool OutputAgreement::request_is_done() {
  int done = 1;
  if (request_ != MPI_REQUEST_NULL) MPI_Test(&request_, &done, MPI_STATUS_IGNORE);
  return done != 0;
}

void OutputAgreement::start_gathering() {
  Index all = 0;
  memory_->sizes.clear();
  memory_->places.clear();
  for (const Part& part : memory_->parts) {
    memory_->sizes.push_back(static_cast<int>(part.bytes));
    memory_->places.push_back(static_cast<int>(all));
    all += part.bytes;
  }
  if (ranks_.several() && all > std::numeric_limits<int>::max())
    throw IoError("MPI cannot send what ranks have to know about a file of so many parts");
  memory_->all.resize(static_cast<std::size_t>(all));
  if (!ranks_.several())
    memory_->all = memory_->own;
  else if (all > 0)
    MPI_Iallgatherv(memory_->own.data(), static_cast<int>(memory_->own.size()), MPI_BYTE,
                    memory_->all.data(), memory_->sizes.data(), memory_->places.data(), MPI_BYTE,
                    ranks_.communicator(), &request_);
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
