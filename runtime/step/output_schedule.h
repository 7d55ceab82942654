/// \file After which steps there are frames and rows of history.csv.
#pragma once

#include <string>

#include "runtime/step/time_control.h"

namespace lahar {

class OutputSchedule {
 public:
  /// `time` must outlive it.
  OutputSchedule(const OutputPlan& plan, Step first_step, const TimeControl& time)
      : plan_(plan), first_step_(first_step), time_(time) {}

  /// Rows come about a hundred times in the run where the scenario does not say: with steps of
  /// `dt`, or as they came `before` (0 = not known).
  void begin(double dt, Index before = 0);
  Index history_steps() const { return history_steps_; }  ///< 0 = rows come by time

  bool history_due(Step step) const;
  bool gauges_due(Step step) const;
  bool plans_frames() const { return plan_.frame_steps > 0 || plan_.frame_dt > 0; }
  /// dt of `step` is known.
  bool frame_due(Step step) const {
    return plans_frames() && frame_planned(step) && frames_by(step) <= plan_.max_frames;
  }
  /// The first frame is planned that is one too many.
  bool frames_end(Step step) const {
    return plans_frames() && frame_planned(step) && frames_by(step) == plan_.max_frames + 1;
  }
  std::string no_more_frames(Step step) const;
  /// How many steps are done when the next frame comes, as far as that is known after `step`.
  Step next_frame(Step step) const;

 private:
  bool reaches(Step step, double interval) const;
  bool frame_planned(Step step) const;
  Index frames_by(Step step) const;
  Step next_frame_by_time(Step step) const;

  OutputPlan plan_;
  Step first_step_;
  const TimeControl& time_;
  Index history_steps_ = 1;
};

}  // namespace lahar
