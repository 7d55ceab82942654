/// \file `lahar bench`: what this build of Lahar does on this machine, in numbers to cite.
#pragma once

#include <string>
#include <vector>

namespace lahar {

struct BenchArguments {
  std::vector<std::string> cases;  ///< names; empty = the default ones
  bool list = false;               ///< print the cases and what they need, measure nothing
  bool large = false;              ///< also those that take gigabytes and minutes
  bool quick = false;              ///< short samples: a look, not a measurement
  int repeats = 0;                 ///< 0 = 5, quick 3
  long long steps = 0;             ///< of a sample; 0 = by time
  int threads = 0;                 ///< at most; 0 = all cores this process may use
  std::string json, markdown;      ///< files to write; empty = none
  std::string compare;             ///< earlier result to hold the new one against; empty = none
  std::string from;                ///< report this result instead of measuring; empty = measure
};

/// Must be called before the process starts any thread.
int bench_command(const BenchArguments& arguments);

}  // namespace lahar
