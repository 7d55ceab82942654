/// \file `lahar trace`: what a recorded run says about where its time went.
#pragma once

#include <string>

namespace lahar {

struct TraceArguments {
  std::string run;
  bool json = false;   ///< JSON on standard output instead of text
  bool check = false;  ///< only whether the trace is sound
  std::string chrome;  ///< file to write for Perfetto; empty = none
  std::string otf2;    ///< folder to write for Vampir; empty = none
  std::string html;    ///< page to write; empty = none
  std::string
      replay;  ///< the network to replay it with: a file, "measured" or "ideal"; empty = none
  bool project = false;        ///< to many cores, with the network of `replay`
  bool bulk = false;           ///< replay with barriers
  bool steady = false;         ///< project tasks of median length
  int ranks = 0, threads = 0;  ///< of the replay; 0 = as recorded
};

/// Returns the exit code.
int trace_command(const TraceArguments& arguments);

}  // namespace lahar
