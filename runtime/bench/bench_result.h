/// \file What `lahar bench` has measured: plain values, written as JSON and Markdown.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

/// A quantity, once per repeat.
struct BenchSamples {
  std::vector<double> values = {};
  double median() const;  ///< of an even number the mean of the middle two; 0 if there are none
  double min() const;
  double max() const;
};

/// What the machine can do on so many threads, each with memory of its own.
struct BenchRates {
  int threads = 1;
  BenchSamples triad = {};   ///< [B/s] a = b + s c, 32 bytes per element (a is read before written)
  BenchSamples update = {};  ///< [B/s] a = s a + b, 24 bytes per element
  BenchSamples multiply = {};  ///< [flop/s] a = a b + c in registers, two operations each
  /// [B/s] the fastest pass over memory of either kind: what times are held against.
  double bandwidth() const;
};

struct BenchMachine {
  std::string cpu, caches, kernel;
  std::string governor;    ///< of the clock frequency
  std::string huge_pages;  ///< transparent huge pages: always, madvise or never
  int cores = 0;           ///< that this process may use
  double memory = 0;       ///< [B]
  double load = 0;         ///< mean number of running processes in the minute before
  std::vector<BenchRates> rates = {};
};

struct BenchProtocol {
  int repeats = 5;
  double sample_seconds = 0.6;  ///< [s] a sample takes at least
  Index steps = 0;              ///< per sample; 0 = as many as sample_seconds asks for
  int threads = 0;              ///< at most, where several are used
};

struct BenchStage {
  std::string name;
  double ns = 0;  ///< [ns] per particle-step of one thread, sum over its tasks
};

/// One way of running one model.
struct BenchVariant {
  std::string name;
  int threads = 1, copies = 1;                ///< copies: independent processes started together
  Index particles = 0, cells = 0, steps = 0;  ///< per copy; steps of a sample
  int patches = 0;
  BenchSamples ns = {};        ///< [ns] per particle-step of all copies together
  BenchSamples cpu_ns = {};    ///< [ns] of processor time per particle-step
  double goal = 0;             ///< [ns] at most; 0 = none
  double bytes = 0;            ///< [B] per particle-step, modelled (bench_traffic.h)
  double bound = 0;            ///< [ns] of these bytes at the bandwidth; 0 = not known
  double per_cell = 0;         ///< particles of an occupied cell at the start: mean,
  double per_cell_spread = 0;  ///< and standard deviation
  double crossings = -1;       ///< changes of cell per particle-step, counted; -1 = not counted
  std::vector<BenchStage> stages = {};
};

/// Any other number: a ratio, bytes per particle, seconds.
struct BenchFigure {
  std::string name, unit = {};
  BenchSamples samples = {};
  double of_medians = 0;             ///< ratios: that of the medians; 0 = not a ratio
  double at_most = 0, at_least = 0;  ///< goals; 0 = none
};

struct BenchCase {
  std::string name, title;
  std::vector<BenchVariant> variants = {};
  std::vector<BenchFigure> figures = {};
};

struct BenchResult {
  std::string date, version, build;  ///< UTC; version and commit; compiler and flags
  BenchMachine machine;
  BenchProtocol protocol;
  std::vector<BenchCase> cases;
};

std::string bench_json(const BenchResult& result);
/// What bench_json() wrote. Throws InputError naming `file` where it is something else.
BenchResult parse_bench_json(const std::string& text, const std::string& file);

/// Report in Markdown whose tables are aligned for a terminal.
std::string bench_markdown(const BenchResult& result);
/// Ratios of medians, `present` over `earlier`, and what else differs between the two.
std::string bench_comparison(const BenchResult& present, const BenchResult& earlier,
                             const std::string& earlier_name);

}  // namespace lahar
