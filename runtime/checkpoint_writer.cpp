#include "runtime/checkpoint_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <numeric>
#include <string>
#include <utility>

#include "physics/error.h"
#include "runtime/parallel.h"
#include "runtime/trace/recorder.h"

namespace lahar {

CheckpointWriter::CheckpointWriter(CheckpointOptions options, const Ranks& ranks)
    : options_(std::move(options)), ranks_(ranks.duplicate()) {}

CheckpointWriter::~CheckpointWriter() {
  if (thread_.joinable()) thread_.join();
  // A rank that ends by an error ends alone.
  if (phase_ == Phase::idle && std::uncaught_exceptions() == 0) ranks_.release();
}

void CheckpointWriter::write(const CheckpointHeader& header, const SimulationState& state) {
  finish();
  last_step_ = header.run.step;
  target_ = options_.folder / checkpoint_name(header.run.step);
  std::vector<Slab> slabs = pack_all(state);
  const std::vector<CheckpointPatch> all = lay_out_all(slabs);
  data_ = create(header, all);
  phase_ = Phase::writing;
  const bool copied =
      std::all_of(slabs.begin(), slabs.end(), [](const Slab& slab) { return !slab.bytes.empty(); });
  if (!copied) write_large(state, slabs);
  start([this, copied, slabs = std::move(slabs)] {
    if (failure_) return;
    if (copied)
      for (const Slab& slab : slabs) slab_file_->write(data_ + slab.patch.offset, slab.bytes);
    slab_file_->sync();
    if (!ranks_.several()) complete();
  });
}

/// Checksums of all patches; their bytes too where there is memory for them.
std::vector<CheckpointWriter::Slab> CheckpointWriter::pack_all(const SimulationState& state) const {
  const Index size = std::accumulate(state.sizes.begin(), state.sizes.end(), Index{0});
  const bool copy = static_cast<std::size_t>(size) <= options_.copied_bytes;
  std::vector<Slab> slabs(state.patches.size());
  parallel_for(options_.threads, static_cast<int>(slabs.size()), [&](int k) {
    const auto i = static_cast<std::size_t>(k);
    std::vector<std::byte> bytes = state.bytes(i);
    slabs[i].patch = {.id = state.patches[i],
                      .offset = 0,
                      .bytes = static_cast<Index>(bytes.size()),
                      .checksum = checksum(bytes)};
    if (copy) slabs[i].bytes = std::move(bytes);
  });
  return slabs;
}

/// Places of the patches of all ranks, which this rank's get to know.
std::vector<CheckpointPatch> CheckpointWriter::lay_out_all(std::vector<Slab>& slabs) const {
  std::vector<CheckpointPatch> own;
  for (const Slab& slab : slabs) own.push_back(slab.patch);
  std::vector<CheckpointPatch> all = ranks_.gather_all<CheckpointPatch>(own);
  lay_out(all);
  for (Slab& slab : slabs)
    slab.patch =
        *std::lower_bound(all.begin(), all.end(), slab.patch.id,
                          [](const CheckpointPatch& patch, Index id) { return patch.id < id; });
  return all;
}

/// Rank 0 makes the file; all learn where it is, and where the data begin. A failure there is
/// everybody's.
Index CheckpointWriter::create(const CheckpointHeader& header,
                               const std::vector<CheckpointPatch>& all) {
  std::string news;  // "+offset name" or "-reason"
  if (ranks_.rank() == 0) {
    try {
      make_folder(options_.folder);
      file_.emplace(target_);
      const Index begin = create_checkpoint(file_->temporary(), target_, header, all);
      news = fmt::format("+{} {}", begin, file_->temporary().string());
    } catch (const IoError& error) {
      file_.reset();
      news = std::string("-") + error.what();
    }
  }
  ranks_.broadcast(news);
  if (news.front() == '-') throw IoError(news.substr(1));
  const std::size_t space = news.find(' ');
  failure_ = nullptr;
  try {
    slab_file_ = std::make_unique<SharedFile>(news.substr(space + 1), target_);
  } catch (...) {
    failure_ = std::current_exception();  // told when all are asked
  }
  return std::stoll(news.substr(1, space));
}

/// Hand a state to the system for which there is no copy: it is packed once more.
void CheckpointWriter::write_large(const SimulationState& state, const std::vector<Slab>& slabs) {
  try {
    for (std::size_t i = 0; i < slabs.size() && !failure_; ++i)
      slab_file_->write(data_ + slabs[i].patch.offset, state.bytes(i));
  } catch (...) {
    failure_ = std::current_exception();
  }
}

void CheckpointWriter::start(std::function<void()> work) {
  thread_done_ = false;
  thread_ = std::thread([this, work = std::move(work)] {
    const TraceSpan trace = TraceSpan::beside_steps(TraceKind::checkpoint, last_step_);
    try {
      work();
    } catch (...) {
      failure_ = std::current_exception();
    }
    thread_done_ = true;
    thread_done_.notify_all();
  });
}

bool CheckpointWriter::progress() {
  if (phase_ == Phase::idle) return true;
  if (phase_ == Phase::agreeing) {
    int done = 0;
    MPI_Test(&request_, &done, MPI_STATUS_IGNORE);
    if (done != 0) agreed(failed_ == 0);
    return phase_ == Phase::idle;
  }
  if (!thread_done_) return false;
  thread_.join();
  if (phase_ == Phase::writing && ranks_.several()) {
    failed_ = failure_ ? 1 : 0;
    MPI_Iallreduce(MPI_IN_PLACE, &failed_, 1, MPI_INT, MPI_MAX, ranks_.communicator(), &request_);
    phase_ = Phase::agreeing;
    return false;
  }
  forget();
  return true;
}

/// Everybody's part is on the disk, or somebody's is not.
void CheckpointWriter::agreed(bool all_written) {
  if (!all_written) {
    if (!failure_)
      failure_ = std::make_exception_ptr(IoError(
          fmt::format("cannot write {}: another rank could not write its part", target_.string())));
    forget();
  } else if (ranks_.rank() == 0) {
    phase_ = Phase::completing;
    start([this] { complete(); });
  } else {
    forget();
  }
}

void CheckpointWriter::complete() {
  if (options_.before_complete) options_.before_complete();
  file_->commit();
  prune_checkpoints(options_.folder, options_.kept);
}

/// Nothing is under way any more. Throws what went wrong.
void CheckpointWriter::forget() {
  phase_ = Phase::idle;
  slab_file_.reset();
  file_.reset();  // not committed: removed
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

void CheckpointWriter::finish() {
  const bool alone = !ranks_.several() && !options_.while_waiting;
  const auto wait = [&](auto is_done) {
    while (!is_done()) {
      if (options_.while_waiting) options_.while_waiting();
      if (alone)
        thread_done_.wait(false);
      else
        std::this_thread::sleep_for(std::chrono::microseconds(100));
    }
  };
  std::exception_ptr failure;
  try {
    wait([&] { return progress(); });
  } catch (...) {
    if (!ranks_.several()) throw;
    failure = std::current_exception();
  }
  if (!ranks_.several()) return;
  // Rank 0 may still need others for what comes before a checkpoint, and it alone completes it.
  int any = failure != nullptr;
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Iallreduce(MPI_IN_PLACE, &any, 1, MPI_INT, MPI_MAX, ranks_.communicator(), &request);
  wait([&] {
    int done = 0;
    MPI_Test(&request, &done, MPI_STATUS_IGNORE);
    return done != 0;
  });
  if (failure) std::rethrow_exception(failure);
  if (any) throw IoError("another rank could not complete " + target_.string());
}

}  // namespace lahar
