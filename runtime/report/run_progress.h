/// \file How far a run is, from the files in its folder.
#pragma once

#include <filesystem>
#include <string>

namespace lahar {

struct RunProgress {
  std::string stage;    ///< its folder, of a scenario with stages
  std::string status;   ///< running, finished, failed, stopped; "lost" where no process is left
  std::string message;  ///< why it ended
  std::string started;
  double step = 0, steps = 0;           ///< last and planned; 0 = until end_time
  double time = 0, end_time = 0;        ///< [s]; 0 = until steps are taken
  double particles = 0, max_speed = 0;  ///< [m/s]
  double wall_seconds = 0;              ///< of a run that has ended

  /// 0 to 1.
  double share() const;
};

/// Of a run, or of the stage that began last. Throws InputError where there is no run, IoError.
RunProgress read_progress(const std::filesystem::path& run);

}  // namespace lahar
