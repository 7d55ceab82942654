#include "runtime/step/run_frames.h"

#include <span>
#include <utility>

#include "runtime/step/snapshot.h"

namespace lahar {

template <int Dim>
void RunFrames<Dim>::measure(const Communicator& ranks, std::size_t more) {
  bytes_ = static_cast<std::size_t>(ranks.max(static_cast<Index>(bytes_of(particles()) + more)));
}

template <int Dim>
Index RunFrames<Dim>::particles() const {
  if (!model_.output.frame_particles) return patches_.particles();
  Index n = 0;
  for (int i = 0; i < patches_.size(); ++i) n += particles_of(patches_[i], model_);
  return n;
}

template <int Dim>
std::size_t RunFrames<Dim>::bytes_of(Index particles) const {
  return frame_bytes(patches_.layout(), model_, particles);
}

template <int Dim>
void RunFrames<Dim>::make_room() {
  for (auto& pieces : pieces_) pieces.assign(static_cast<std::size_t>(patches_.size()), {});
}

template <int Dim>
void RunFrames<Dim>::copy(int patch, Step step) {
  const auto i = static_cast<std::size_t>(patch);
  pieces_[step][i] = snapshot(patches_[patch], model_, spare_->take(i));
}

template <int Dim>
FramePieces RunFrames<Dim>::take(Step step) {
  for (Frame& piece : pieces_[step]) log_.make_dense(piece.id);
  FramePieces frame{header(step + 1), std::move(pieces_[step]), spare_};
  pieces_[step].assign(frame.pieces.size(), {});
  return frame;
}

template <int Dim>
FrameSource RunFrames<Dim>::present(Step at, int threads) const {
  std::vector<const Patch<Dim>*> all;
  for (int i = 0; i < patches_.size(); ++i) all.push_back(&patches_[i]);
  FrameSource frame = lahar::frame_source(all, header(at), model_);
  if (!log_.empty())
    frame.piece = [this, piece = std::move(frame.piece)](std::size_t i) {
      Frame one = piece(i);
      log_.make_dense(one.id);
      return one;
    };
  frame.threads = threads;
  return frame;
}

template <int Dim>
Frame RunFrames<Dim>::present_of(const Communicator& ranks, Step at) const {
  Frame frame = join(present(at, 1));
  if (!ranks.several()) return frame;
  const auto gather = [&](auto& values) {
    values = ranks.gather_all(std::span(std::as_const(values)));
  };
  gather(frame.id);
  gather(frame.material);
  gather(frame.coordinates);
  for (FrameColumn& column : frame.columns) gather(column.values);
  sort_by_id(frame);
  return frame;
}

template <int Dim>
FrameHeader RunFrames<Dim>::header(Step at) const {
  FrameHeader header = frame_header<Dim>(patches_.layout(), model_);
  header.step = at;
  header.time = time_.time_at(at);
  return header;
}

template class RunFrames<2>;
template class RunFrames<3>;

}  // namespace lahar
