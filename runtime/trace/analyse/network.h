/// \file The network that a replay assumes.
#pragma once

#include <optional>
#include <string>

namespace lahar {

/// What a message costs. What is not given is as measured in the trace, or where that has a single
/// rank, as `assumed()`.
struct Network {
  std::optional<double> latency;    ///< [s] from posting a message until it is there
  std::optional<double> bandwidth;  ///< [bytes/s] of each message; messages do not share it
  std::optional<double> overhead;   ///< [s] of sender and of receiver per message, beside packing
  bool packing = true;              ///< packing and unpacking take the time that they took

  /// Everything takes no time: what is left are dependencies.
  static Network ideal();
  /// Round numbers of present interconnects: 2 us, 10 GB/s, 0.5 us.
  static Network assumed() { return {.latency = 2e-6, .bandwidth = 1e10, .overhead = 0.5e-6}; }

  /// [s] of a reduction over `ranks`, or of a barrier: a tree of messages.
  double reduction(double ranks) const;
};

/// ceil(log2 n) for n >= 1: the height of a tree over n ranks.
int tree_height(double n);

/// The network that a file describes: a JSON object with any of "latency" and "overhead" (seconds,
/// or a text such as "2us"), "bandwidth" (bytes per second, or "10GB/s", "100Gbit/s"), or {"ideal":
/// true}. Instead of a file, "ideal" or "measured" can be said. Throws InputError.
Network read_network(const std::string& path);

/// "latency 2 us, bandwidth 10 GB/s, overhead 500 ns".
std::string text_of(const Network& network);

/// "2.5 us", for any time [s].
std::string short_time(double seconds);

}  // namespace lahar
