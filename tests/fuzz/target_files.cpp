// Files of particles, and what else `lahar` reads of programs.
#include <algorithm>
#include <variant>

#include "io/base/text.h"
#include "io/frames/cbgeo_table.h"
#include "io/frames/csv.h"
#include "io/frames/vtkhdf.h"
#include "io/results/compare.h"
#include "io/run/checkpoint.h"
#include "io/scenario/scenario.h"
#include "physics/base/error.h"
#include "runtime/bench/bench_result.h"
#include "runtime/step/simulation.h"
#include "runtime/trace/analyse/network.h"
#include "tests/fuzz/targets.h"

namespace lahar::fuzz {

namespace {

namespace fs = std::filesystem;

/// The input as a file of this name.
fs::path file_of(Bytes input, const std::string& name) {
  fs::path file = work_folder() / name;
  write(file, text_of(input));
  return file;
}

Frame small_frame() {
  const Scenario read = read_scenario_text(example("sand.json"), work_folder());
  ExecutionOptions options;
  options.mode = ExecutionOptions::Mode::serial;
  return Simulation(std::get<Model<2>>(read.model), options).frame();
}

}  // namespace

void run_csv(Bytes input) {
  const Frame frame = parse_csv(text_of(input), "input.csv");
  // As read_particles() does.
  if (frame.coordinates.empty() && frame.size() > 0) throw InputError("there are no coordinates");
  static_cast<void>(csv_text(frame));
  check_shown(printable_lines(compare(frame, frame).text()));
}

std::vector<Seed> csv_seeds() {
  return {{"frame", csv_text(small_frame())}};
}

void run_frame(Bytes input) {
  const Frame read = read_frame(file_of(input, "frame.hdf"));
  static_cast<void>(csv_text(read));
}

std::vector<Seed> frame_seeds() {
  const fs::path file = work_folder() / "seed.hdf";
  write_frame(small_frame(), file);
  return {{"frame", contents(file)}};
}

void run_checkpoint(Bytes input) {
  const CheckpointReader reader(file_of(input, "checkpoint_0000000001.h5"));
  for (std::size_t i = 0; i < reader.patches().size(); ++i) static_cast<void>(reader.patch(i));
}

std::vector<Seed> checkpoint_seeds() {
  const fs::path file = work_folder() / "seed.h5";
  std::vector<CheckpointPatch> patches;
  const std::string state = "some state of a patch";
  const auto bytes = std::as_bytes(std::span(state));
  for (Index id = 0; id < 3; ++id)
    patches.push_back({.id = id,
                       .offset = 0,
                       .bytes = static_cast<Index>(bytes.size()),
                       .checksum = checksum(bytes)});
  lay_out(patches);
  CheckpointHeader header;
  header.scenario = "{}";
  const Index begin = create_checkpoint(file, file, header, patches);
  std::string text = contents(file);
  text.resize(static_cast<std::size_t>(begin));
  for (int k = 0; k < 3; ++k) text += state;
  return {{"checkpoint", text}};
}

void run_cbgeo(Bytes input) {
  const fs::path file = file_of(input, "particles01.h5");
  const Index rows = count_cbgeo_rows(file);
  static_cast<void>(read_cbgeo_rows(file, 0, std::min<Index>(rows, 100000)));
}

std::vector<Seed> cbgeo_seeds() {
  const fs::path file = work_folder() / "seed-table.h5";
  write_cbgeo_table(file, 3, [](Index first, Index n) {
    std::vector<CbgeoParticle> rows(static_cast<std::size_t>(n));
    for (Index k = 0; k < n; ++k) {
      CbgeoParticle& row = rows[static_cast<std::size_t>(k)];
      row.id = first + k;
      row.mass = 1000;
      row.volume = 1;
      row.coord[0] = static_cast<double>(first + k);
      row.nstate_vars = 1;
      row.svars[0] = 0.5;
    }
    return rows;
  });
  return {{"table", contents(file)}};
}

void run_network(Bytes input) {
  check_shown(text_of(read_network(file_of(input, "network.json").string())));
}

void run_bench(Bytes input) {
  const BenchResult result = parse_bench_json(std::string(text_of(input)), "bench.json");
  check_shown(bench_markdown(result));
  check_shown(bench_comparison(result, result, "bench.json"));
  static_cast<void>(bench_json(result));
}

std::vector<Seed> bench_seeds() {
  BenchResult result;
  result.date = "2026-01-02T03:04:05Z";
  result.version = "1.2.3 (commit abc)";
  result.build = "a compiler, flags";
  result.machine.cpu = "a processor";
  result.machine.rates = {{1, {{1e10, 1.5e10}}, {{1.2e10}}, {{1e11}}}};
  BenchVariant variant{.name = "lattice", .particles = 4096, .cells = 512, .steps = 7};
  variant.ns.values = {20, 10, 40};
  variant.cpu_ns.values = {19, 9, 39};
  variant.goal = 30;
  variant.stages = {{"P2G", 4.5}, {"G2P", 5.5}};
  result.cases = {
      {"h8-4k", "A block", {variant}, {{"deformed / lattice", "", {{1.1, 1.2}}, 1.13, 1.15}}}};
  return {{"result", bench_json(result)}};
}

}  // namespace lahar::fuzz
