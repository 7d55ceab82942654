/// \file Particles of a run over time, as few as a page can hold, and what pictures of its frames
/// have in common.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "runtime/picture/frame_picture.h"
#include "runtime/report/run_results.h"

namespace lahar {

/// A frame of a run, over all stages.
struct ReportFrame {
  const RunPart* part;
  FrameFile file;
};
std::vector<ReportFrame> frames_of(const RunResults& run);

/// `count` of them at equal distances, the first and the last included.
std::vector<ReportFrame> spread(const std::vector<ReportFrame>& frames, std::size_t count);

/// Those nearest to these times [s] of all stages, each once and in their order.
std::vector<ReportFrame> nearest(const std::vector<ReportFrame>& frames,
                                 const std::vector<double>& times);

/// Fields that a report shows unless it is told: those of these that the frames have.
std::vector<std::string> usual_fields(const FrameHeader& header);

struct SampledFrame {
  Index step = 0;
  double time = 0;  ///< [s] of all stages
  std::string stage;
  std::vector<float> places;                   ///< [m] three per particle
  std::vector<std::vector<float>> values;      ///< of each field
  std::vector<std::optional<BodyPose>> poses;  ///< of each rigid body that is there
};

struct RunSamples {
  int dim = 3;
  Index particles = 0, shown = 0;  ///< most in a frame
  double edge = 0;                 ///< [m] median edge of particles
  Bounds bounds;
  std::vector<FrameField> fields;  ///< without values
  std::vector<ColourScale> scales;
  std::vector<SampledFrame> frames;
  std::vector<BodyShape> bodies;  ///< with no more triangles than the view needs
};

struct SampleBudget {
  std::size_t points = 30000, frames = 40;
  std::size_t triangles = 20000;  ///< of the surfaces of all rigid bodies, about
  double bytes = 4e9;             ///< that are read of frames, about
};

/// The same particles in all frames: which, follows from their ids alone.
RunSamples sample(const RunResults& run, const std::vector<std::string>& fields,
                  const SampleBudget& budget);

/// JSON for page/particles.js. Places are 16 bit numbers within `bounds`, values 8 bit numbers
/// within the scale, 255 where they are not finite. Points of bodies are seen from their centres.
std::string json_of(const RunSamples& samples, const Bounds& bounds,
                    const std::vector<ColourScale>& scales);

}  // namespace lahar
