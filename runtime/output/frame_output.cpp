#include "runtime/output/frame_output.h"

#include <memory>
#include <numeric>
#include <string>

#include "io/frames/frame_layout.h"
#include "io/frames/frame_slabs.h"
#include "io/run/run_folder.h"
#include "runtime/base/parallel.h"
#include "runtime/output/node_job.h"

namespace lahar {

namespace {

/// Particles that a thread copies at a time, if the frame is not a copy. This part stays in a
/// second-level cache (with four times as many a frame takes twice as long), and each column of it
/// is still long enough for a system call.
constexpr Index particles_per_write = 1 << 13;
/// The same for particles that are sent to a rank that writes: fewer messages count for more there.
constexpr Index particles_per_relay = 1 << 15;

}  // namespace

/// A frame that is a copy, or (`source`) one whose particles are copied some at a time.
class FrameOutput::Job : public OutputJob {
 public:
  Job(FrameOutput& output, FramePieces frame, const FrameSource* source = nullptr)
      : OutputJob({.target = output.folder_ / frame_name(frame.header.step, ".hdf"),
                   .step = frame.header.step,
                   .kind = TraceKind::frame,
                   .prepare_now = true,  // it takes no time
                   .write_now = source != nullptr}),
        output_(output),
        frame_(std::move(frame)),
        source_(source) {}

  Bytes prepare() override {
    const Index size = source_ != nullptr ? source_->size() : frame_.size();
    return bytes_of(std::span<const Index>(&size, 1));
  }
  void hear_parts(std::span<const std::byte> parts, int rank) override {
    const std::vector<Index> sizes = values_of<Index>(parts);
    first_ = std::accumulate(sizes.begin(), sizes.begin() + rank, Index{0});
    total_ = std::accumulate(sizes.begin(), sizes.end(), Index{0});
  }
  Bytes create(const AtomicFile& file) override {
    layout_ = lay_out_frame(frame_.header, total_, file.temporary(), file.target());
    return bytes_of(std::span<const FrameLayout>(&layout_, 1));
  }
  void hear_layout(std::span<const std::byte> layout) override {
    layout_ = values_of<FrameLayout>(layout).front();
  }
  void write(const ByteSink& sink, bool parallel) override {
    if (source_ != nullptr) return write_source(sink, parallel);
    write_slab(layout_, first_, frame_.pieces, sink);
    frame_.release();
  }
  void name(AtomicFile& file) override {
    output_.name(file, frame_.header.time, output_.index_.particles, "particles.hdf.series");
  }

 private:
  void write_source(const ByteSink& sink, bool parallel) const;

  FrameOutput& output_;
  FramePieces frame_;
  const FrameSource* source_;  ///< good until it is written
  Index first_ = 0, total_ = 0;
  FrameLayout layout_;
};

void FrameOutput::Job::write_source(const ByteSink& sink, bool parallel) const {
  struct Part {
    std::size_t begin, end;
    Index first;
  };
  const std::vector<Index>& sizes = source_->sizes;
  const Index most = parallel ? particles_per_write : particles_per_relay;
  std::vector<Part> parts;
  Index first = first_;
  for (std::size_t begin = 0, end = 0; begin < sizes.size(); begin = end) {
    Index n = 0;
    while (end < sizes.size() && (end == begin || n + sizes[end] <= most)) n += sizes[end++];
    parts.push_back({begin, end, first});
    first += n;
  }
  parallel_for(parallel ? source_->threads : 1, static_cast<int>(parts.size()), [&](int i) {
    const TraceSpan trace = TraceSpan::beside_steps(TraceKind::frame, frame_.header.step);
    const Part& part = parts[static_cast<std::size_t>(i)];
    std::vector<Frame> pieces;
    for (std::size_t k = part.begin; k < part.end; ++k) pieces.push_back(source_->piece(k));
    write_slab(layout_, part.first, pieces, sink);
  });
}

FrameOutput::FrameOutput(std::filesystem::path folder, const Communicator& ranks,
                         KeptFrames earlier, int writers)
    : folder_(std::move(folder)),
      index_(std::move(earlier)),
      writer_(ranks, {.slots = slots, .writers = writers}) {}

void FrameOutput::add(FramePieces frame) {
  writer_.write(std::make_unique<Job>(*this, std::move(frame)));
}

void FrameOutput::add_nodes(FramePieces nodes) {
  const double time = nodes.header.time;
  writer_.write(std::make_unique<NodeJob>(
      folder_ / node_frame_name(nodes.header.step), std::move(nodes),
      [this, time](AtomicFile& file) { name(file, time, index_.nodes, "nodes.hdf.series"); }));
}

void FrameOutput::write(const FrameSource& frame) {
  writer_.write(std::make_unique<Job>(*this, FramePieces{frame.header, {}}, &frame));
}

void FrameOutput::name(AtomicFile& file, double time, std::vector<TimedFile>& index,
                       const char* series) {
  file.commit(check_);
  const std::string name = file.target().filename().string();
  // A frame of the same step replaces the earlier one, in the index too.
  std::erase_if(index, [&](const TimedFile& earlier) { return earlier.name == name; });
  index.push_back({time, name});
  write_series(index, folder_ / series);
}

}  // namespace lahar
