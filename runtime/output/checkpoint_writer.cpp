#include "runtime/output/checkpoint_writer.h"

#include <algorithm>
#include <memory>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "runtime/base/parallel.h"

namespace lahar {

namespace {

class CheckpointJob : public OutputJob {
 public:
  /// `copied`: the job has a copy of the state once it is prepared.
  CheckpointJob(const CheckpointOptions& options, const CheckpointHeader& header,
                SimulationState state, bool copied)
      : OutputJob({.target = options.folder / checkpoint_name(header.run.step),
                   .step = header.run.step,
                   .kind = TraceKind::checkpoint,
                   .prepare_now = !state.copied,
                   .write_now = !copied}),
        options_(options),
        header_(header),
        state_(std::move(state)),
        copied_(copied),
        own_(state_.patches.size()),
        bytes_(own_.size()) {}

  /// Checksums of all patches; their bytes too where they are copied.
  Bytes prepare() override {
    const auto pack = [this](int k) {
      const auto i = static_cast<std::size_t>(k);
      std::vector<std::byte> bytes = state_.bytes(i);
      own_[i] = {.id = state_.patches[i],
                 .offset = 0,
                 .bytes = static_cast<Index>(bytes.size()),
                 .checksum = checksum(bytes)};
      if (copied_) bytes_[i] = std::move(bytes);
    };
    // By the thread: the other cores compute.
    parallel_for(state_.copied ? 1 : options_.threads, static_cast<int>(own_.size()), pack);
    return bytes_of(std::span<const CheckpointPatch>(own_));
  }
  void hear_parts(std::span<const std::byte> parts, int) override {
    all_ = values_of<CheckpointPatch>(parts);
    lay_out(all_);
    for (CheckpointPatch& patch : own_)
      patch = *std::lower_bound(all_.begin(), all_.end(), patch.id,
                                [](const CheckpointPatch& a, Index id) { return a.id < id; });
  }
  Bytes create(const AtomicFile& file) override {
    make_folder_in_place(options_.folder);
    begin_ = create_checkpoint(file.temporary(), file.target(), header_, all_);
    return bytes_of(std::span<const Index>(&begin_, 1));
  }
  void hear_layout(std::span<const std::byte> layout) override {
    begin_ = values_of<Index>(layout).front();
  }
  /// Patches without a copy are packed a second time.
  void write(const ByteSink& sink, bool) override {
    for (std::size_t i = 0; i < own_.size(); ++i)
      if (copied_)
        sink(begin_ + own_[i].offset, bytes_[i]);
      else
        sink(begin_ + own_[i].offset, state_.bytes(i));
  }
  void name(AtomicFile& file) override {
    if (options_.before_complete) options_.before_complete();
    file.commit(options_.before_naming);
    prune_checkpoints(options_.folder, options_.kept);
  }

 private:
  const CheckpointOptions& options_;
  CheckpointHeader header_;
  SimulationState state_;
  bool copied_;
  std::vector<CheckpointPatch> own_, all_;     ///< patches of this rank; of all, ascending ids
  std::vector<std::vector<std::byte>> bytes_;  ///< of own_, if copied
  Index begin_ = 0;                            ///< of the patches' states in the file
};

}  // namespace

CheckpointWriter::CheckpointWriter(CheckpointOptions options, const Communicator& ranks)
    : options_(std::move(options)), writer_(ranks, {.forgets_failures = true}) {
  writer_.while_waiting(options_.while_waiting);
}

void CheckpointWriter::write(const CheckpointHeader& header, SimulationState state) {
  const Index size = std::accumulate(state.sizes.begin(), state.sizes.end(), Index{0});
  const bool copied = state.copied || static_cast<std::size_t>(size) <= options_.staging_bytes;
  writer_.write(std::make_unique<CheckpointJob>(options_, header, std::move(state), copied));
  last_step_ = header.run.step;
}

bool CheckpointWriter::progress() {
  const bool idle = writer_.progress();
  const std::exception_ptr failure = writer_.failure();
  if (failure && failure != thrown_) std::rethrow_exception(thrown_ = failure);
  return idle;
}

}  // namespace lahar
