// States of checkpoints. Their checksums are right: who changes a file can change these as well.
#include <algorithm>
#include <array>
#include <cstring>
#include <nlohmann/json.hpp>

#include "io/run/checkpoint_header.h"
#include "io/scenario/scenario.h"
#include "io/scenario/scenario_difference.h"
#include "physics/base/error.h"
#include "runtime/step/simulation.h"
#include "tests/fuzz/accepted.h"
#include "tests/fuzz/sections.h"
#include "tests/fuzz/targets.h"

namespace lahar::fuzz {

namespace {

using Kind = TraceSection::Kind;

/// Scenarios of the corpus that the state may be one of, by the first section.
constexpr std::array names{"sand.json", "contact.json", "soil.json", "water.json"};

template <int Dim>
Model<Dim> without_output(Model<Dim> model) {
  model.analysis.patch_particles = 8;
  model.output = {};
  return model;
}

ExecutionOptions serial() {
  ExecutionOptions options;
  options.mode = ExecutionOptions::Mode::serial;
  options.memory = {256e6, "a fuzzed input may take"};
  return options;
}

/// A state after some steps: name, header, and the id and state of each patch.
std::string state_of(const char* name) {
  const Scenario read = read_scenario_text(example(name), work_folder());
  return std::visit(
      [&]<int Dim>(const Model<Dim>& model) {
        Simulation simulation(without_output(model), serial());
        simulation.advance(3);
        const SimulationState state = simulation.state();
        CheckpointHeader header;
        header.run = state.run;
        header.scenario = read.full;
        SectionedFile file{{Kind::head, nlohmann::json(name).dump()},
                           {Kind::graph, header_text(header)}};
        for (std::size_t i = 0; i < state.patches.size(); ++i) {
          std::string bytes(sizeof(Index), '\0');
          std::memcpy(bytes.data(), &state.patches[i], sizeof(Index));
          const std::vector<std::byte> packed = state.bytes(i);
          bytes.append(reinterpret_cast<const char*>(packed.data()), packed.size());
          file.push_back({Kind::records, bytes});
        }
        return join_sections({file});
      },
      read.model);
}

/// The patches of an input, as a reader of checkpoints gives them: ids ascend.
SimulationState state_in(const CheckpointHeader& header, const SectionedFile& file) {
  SimulationState state{.run = header.run, .patches = {}, .sizes = {}, .bytes = {}};
  std::vector<std::vector<std::byte>> all;
  for (const Section& section : file) {
    Index id = 0;
    if (section.kind != Kind::records || section.bytes.size() < sizeof id) continue;
    std::memcpy(&id, section.bytes.data(), sizeof id);
    if (id < 0 || (!state.patches.empty() && id <= state.patches.back()))
      throw IoError("ids of patches do not ascend");
    state.patches.push_back(id);
    const auto* begin = reinterpret_cast<const std::byte*>(section.bytes.data());
    all.emplace_back(begin + sizeof id, begin + section.bytes.size());
    state.sizes.push_back(static_cast<Index>(all.back().size()));
  }
  state.bytes = [all = std::move(all)](std::size_t i) { return all[i]; };
  return state;
}

}  // namespace

void run_restart(Bytes input) {
  const std::vector<SectionedFile> files = split_sections(text_of(input));
  if (files.empty() || files.front().size() < 2) throw IoError("there is no state");
  const SectionedFile& file = files.front();
  const auto name = std::find_if(names.begin(), names.end(), [&](const char* one) {
    return nlohmann::json(one).dump() == file[0].bytes;
  });
  if (name == names.end()) throw IoError("there is no such scenario");
  const CheckpointHeader header = read_header(file[1].bytes);
  const Scenario read = read_scenario_text(example(*name), work_folder());
  static_cast<void>(differences(header.scenario, read.full));
  std::visit(
      [&]<int Dim>(const Model<Dim>& model) {
        Simulation simulation(without_output(model), serial(), {}, state_in(header, file));
        if (!simulation.finished()) simulation.advance(2);
        static_cast<void>(simulation.frame());
        static_cast<void>(simulation.history());
      },
      read.model);
}

std::vector<Seed> restart_seeds() {
  std::vector<Seed> seeds;
  for (const char* name : names) seeds.push_back({name, state_of(name)});
  return seeds;
}

}  // namespace lahar::fuzz
