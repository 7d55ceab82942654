// `lahar bench`: its cases are what they say, its results survive being written and read.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <csignal>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "physics/base/error.h"
#include "runtime/bench/bench_cases.h"
#include "runtime/bench/bench_machine.h"
#include "runtime/bench/bench_measure.h"
#include "runtime/bench/bench_result.h"
#include "runtime/bench/bench_solves.h"
#include "runtime/bench/bench_traffic.h"
#include "runtime/bench/bench_worker.h"
#include "tests/within.h"

using namespace lahar;

namespace {

BenchResult some_result() {
  BenchResult result;
  result.date = "2026-01-02T03:04:05Z";
  result.version = "1.2.3 (commit abc)";
  result.build = "a compiler, \"flags\"";
  result.machine = {.cpu = "a processor",
                    .caches = "L1 1K",
                    .kernel = "Linux",
                    .governor = "slow",
                    .huge_pages = "never",
                    .cores = 2,
                    .memory = 3e9,
                    .load = 0.25};
  result.machine.rates = {{1, {{1e10, 1.5e10}}, {{1.2e10}}, {{1e11}}}};
  BenchVariant a{.name = "lattice", .particles = 4096, .cells = 512, .steps = 7};
  a.ns.values = {20, 10, 40};
  a.cpu_ns.values = {19, 9, 39};
  a.goal = 30;
  a.bytes = 264;
  a.bound = 17.6;
  a.stages = {{"P2G", 4.5}, {"G2P", 5.5}};
  a.crossings = 0.01;
  result.cases = {
      {"h8-4k", "A block", {a}, {{"deformed / lattice", "", {{1.1, 1.2}}, 1.13, 1.15}}}};
  return result;
}

std::string refusal(const std::string& text) {
  try {
    parse_bench_json(text, "old.json");
  } catch (const InputError& error) {
    CHECK(error.problems().at(0).file == "old.json");
    CHECK(error.problems().at(0).hint == "lahar bench --json FILE writes one");
    return error.problems().at(0).message;
  }
  return "accepted";
}

std::vector<std::string> messages(const std::function<void()>& task) {
  std::vector<std::string> all;
  try {
    task();
  } catch (const InputError& error) {
    for (const Problem& problem : error.problems())
      all.push_back(problem.message + "; " + problem.hint);
  }
  return all;
}

/// Particles of each cell that has any.
template <int Dim>
std::map<Index, int> occupation(const Model<Dim>& model) {
  std::map<Index, int> count;
  for (const Index cell : model.particles.cell) ++count[cell];
  return count;
}

/// Cells that particles change per particle and step, over `steps`.
template <int Dim>
double crossings(const Model<Dim>& model, Index steps) {
  Simulation simulation(model, {.mode = ExecutionOptions::Mode::serial});
  std::vector<Index> before = model.particles.cell;
  double count = 0;
  for (Index step = 0; step < steps; ++step) {
    simulation.advance(1);
    const Frame frame = simulation.frame();
    for (std::size_t p = 0; p < before.size(); ++p) {
      const Index cell =
          model.mesh->locate(Eigen::Map<const Vec<Dim>>(&frame.coordinates[p * Dim])).cell;
      count += cell != before[p];
      before[p] = cell;
    }
  }
  return count / static_cast<double>(model.particles.size() * steps);
}

template <int Dim>
void check_volume_is_preserved() {
  constexpr double edge = 10, h = 1e-5;
  std::mt19937_64 random(3);
  std::uniform_real_distribution<> coordinate(-edge / 2, edge / 2);
  for (int trial = 0; trial < 200; ++trial) {
    Vec<Dim> x;
    for (int d = 0; d < Dim; ++d) x[d] = coordinate(random);
    Eigen::Matrix<double, Dim, Dim> F;
    for (int d = 0; d < Dim; ++d) {
      const Vec<Dim> step = h * Vec<Dim>::Unit(d);
      F.col(d) = (deformed<Dim>(x + step, edge) - deformed<Dim>(x - step, edge)) / (2 * h);
    }
    CHECK(F.determinant() == test::within(2e-5, 1));
    CHECK(deformed<Dim>(x, edge).template lpNorm<Eigen::Infinity>() <= edge / 2 * (1 + 1e-12));
  }
}

}  // namespace

TEST_CASE("the deformation of the benchmark preserves volume and the block's outline") {
  check_volume_is_preserved<2>();
  check_volume_is_preserved<3>();
}

TEST_CASE(
    "blocks of the benchmark have functions of elements and FLIP, whatever the defaults are") {
  const auto check = [](const Analysis& analysis) {
    CHECK(analysis.scheme == Scheme::usl);
    CHECK(analysis.functions == ShapeFunctions::element);
    CHECK_FALSE(analysis.transfer.takes());
    CHECK(analysis.affine == Affine::none);
  };
  const BlockSize size{6};
  check(lattice_block<2>(size).analysis);
  check(deformed_block<3>(size).analysis);
  check(soil_block(size, SoilState::yielding).analysis);
  check(sliding_block(8, true).analysis);
}

TEST_CASE_TEMPLATE("soil that runs out in the benchmark is computed with what users get", D,
                   std::integral_constant<int, 2>, std::integral_constant<int, 3>) {
  constexpr int Dim = D::value;
  const Model<Dim> model = collapse<Dim>();
  CHECK(model.particles.x.size() == static_cast<std::size_t>(collapse_particles<Dim>));
  CHECK(model.analysis.scheme == Scheme::musl);
  CHECK(model.analysis.functions == ShapeFunctions::quadratic_spline);
  for (const BenchPlan& plan : choose_plans(bench_plans(1), {"collapse"}, false, 1))
    for (const BenchJob& job : plan.jobs) CHECK(job.steps == job.life);
}

TEST_CASE_TEMPLATE("a deformed block is irregular and about 1 % of it changes cells in a step", D,
                   std::integral_constant<int, 2>, std::integral_constant<int, 3>) {
  constexpr int Dim = D::value;
  const BlockSize size{12};
  const Model<Dim> lattice = lattice_block<Dim>(size), irregular = deformed_block<Dim>(size);
  CHECK(lattice.particles.size() == size.particles(Dim));
  CHECK(irregular.particles.size() == lattice.particles.size());
  CHECK(irregular.particles.volume == lattice.particles.volume);

  const int regular = Dim == 2 ? 16 : 8;
  int different = 0;
  const auto cells = occupation(irregular);
  for (const auto& [cell, n] : cells) different += n != regular;
  CHECK(different > static_cast<int>(cells.size()) / 2);
  for (const auto& [cell, n] : occupation(lattice)) CHECK(n == regular);

  CHECK(crossings(lattice, 20) == 0);
  const double counted = crossings(irregular, 20);
  CHECK(counted > 0.7 * crossings_per_step);
  CHECK(counted < 1.3 * crossings_per_step);
}

namespace {

template <int Dim>
double bytes_of_step(Scheme scheme, bool cartesian,
                     ShapeFunctions functions = ShapeFunctions::element,
                     Affine affine = Affine::none) {
  Analysis analysis;
  analysis.scheme = scheme;
  analysis.functions = functions;
  analysis.affine = affine;
  return bytes_per_particle_step<Dim>(analysis, cartesian);
}

}  // namespace

TEST_CASE("the bytes of a step are those of the columns that each phase touches") {
  // 3D: x v u 3 each, stress 6, volume and mass 1 each; 2D: 2 each, stress 4.
  CHECK(bytes_of_step<3>(Scheme::usl, true) == 8 * (17 + 16));
  CHECK(bytes_of_step<3>(Scheme::usf, true) == 8 * (10 + 7 + 10 + 9));
  CHECK(bytes_of_step<3>(Scheme::musl, true) == 8 * (13 + 9 + 17 + 10));
  CHECK(bytes_of_step<2>(Scheme::usl, true) == 8 * (12 + 11));
  CHECK(bytes_of_step<2>(Scheme::usf, true) == 8 * (7 + 5 + 7 + 6));
  // General cells: natural coordinates besides.
  CHECK(bytes_of_step<3>(Scheme::usl, true, ShapeFunctions::element, Affine::apic) ==
        8 * (17 + 16 + 2 * 9));
  CHECK(bytes_of_step<3>(Scheme::usl, true, ShapeFunctions::gimp) == 8 * (17 + 16 + 3 + 3 + 3));
  CHECK(bytes_of_step<3>(Scheme::usl, true, ShapeFunctions::cpdi) == 8 * (17 + 16 + 9 + 9 + 9));
  CHECK(bytes_of_step<3>(Scheme::usl, true, ShapeFunctions::cpdi2) == 8 * (17 + 16 + 2 * 24));
  CHECK(bytes_of_step<2>(Scheme::usf, true, ShapeFunctions::cpdi2) == 8 * (7 + 5 + 7 + 6 + 3 * 8));
  CHECK(bytes_of_step<2>(Scheme::usl, false) == 8 * (12 + 11 + 2 + 2));
  CHECK(bytes_of_step<2>(Scheme::usf, false) == 8 * (7 + 5 + 7 + 6 + 2 + 2));
  // A liquid in pores: its velocity and its pressure besides.
  const Model<3> wet = pore_block<3>({2}, PoreState::full),
                 dry = pore_block<3>({2}, PoreState::dry);
  CHECK(bytes_per_particle_step<3>(wet.analysis, true) == 8 * (17 + 16 + 2 * (3 + 1)));
  // Dry soil may open.
  CHECK(bytes_per_particle_step<3>(dry.analysis, true) == 8 * (17 + 16 + 2));
}

TEST_CASE("the median of samples") {
  CHECK(BenchSamples{}.median() == 0);
  CHECK(BenchSamples{{3, 1, 2}}.median() == 2);
  CHECK(BenchSamples{{4, 1, 2, 3}}.median() == 2.5);
}

TEST_CASE("a result is the same after writing and reading it, and has every sample") {
  const std::string text = bench_json(some_result());
  CHECK(bench_json(parse_bench_json(text, "x")) == text);
  const auto json = nlohmann::json::parse(text);
  const auto& variant = json.at("cases").at(0).at("variants").at(0);
  CHECK(variant.at("ns_per_particle_step").at("samples") == nlohmann::json{20, 10, 40});
  CHECK(variant.at("ns_per_particle_step").at("median") == 20);
  CHECK(variant.at("ns_per_particle_step").at("min") == 10);
  CHECK(variant.at("ns_per_particle_step").at("max") == 40);
  CHECK(json.at("machine").at("cpu") == "a processor");
  CHECK(json.at("machine").at("rates").at(0).at("triad_bytes_per_second").at("max") == 1.5e10);
  CHECK(json.at("protocol").at("repeats") == 5);
  for (const char* key : {"date", "version", "build"}) CHECK(json.contains(key));
}

TEST_CASE("a result compared with itself has ratios of one and no differences") {
  const BenchResult result = some_result();
  const std::string text = bench_comparison(result, result, "old.json");
  CHECK(text.find("differ") == std::string::npos);
  CHECK(text.find("not been measured") == std::string::npos);
  std::istringstream lines(text);
  int rows = 0;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("| ") || line.starts_with("| case")) continue;
    ++rows;
    CHECK_MESSAGE(line.ends_with(" 1.000 |"), line);
  }
  CHECK(rows == 7);  // three rates, a time, two stages, a ratio
}

TEST_CASE("a comparison says what else differs, and what was not measured") {
  const BenchResult earlier = some_result();
  BenchResult result = earlier;
  result.machine.cpu = "another processor";
  result.build = "-O0";
  result.protocol.repeats = 3;
  result.cases[0].variants[0].ns.values = {10};
  result.cases[0].figures.clear();
  const std::string text = bench_comparison(result, earlier, "old.json");
  CHECK(text.find("- processor: another processor (earlier: a processor)\n") != std::string::npos);
  CHECK(text.find("- build: -O0 (earlier: a compiler, \"flags\")\n") != std::string::npos);
  CHECK(text.find("- repeats: 3 (earlier: 5)\n") != std::string::npos);
  CHECK(text.find(
            "| h8-4k             | lattice      |      ns |    20.0 | 10.0 |         0.500 |\n") !=
        std::string::npos);
  CHECK(text.find("\n1 of the earlier figures have not been measured now.\n") != std::string::npos);
}

TEST_CASE("what is no result is refused with the reason") {
  const std::string good = bench_json(some_result());
  CHECK(refusal("{ \"lahar_bench\": 1, ") == "not a result of lahar bench: it is not JSON");
  CHECK(refusal(good.substr(0, good.size() / 2)) == "not a result of lahar bench: it is not JSON");
  CHECK(refusal("") == "not a result of lahar bench: it is not JSON");
  CHECK(refusal("[1]") == "not a result of lahar bench: \"lahar_bench\" is missing");
  CHECK(refusal("{\"mesh\": {}}") == "not a result of lahar bench: \"lahar_bench\" is missing");
  CHECK(refusal("{\"lahar_bench\": 7}") ==
        "not a result of lahar bench: its format is 7, this program reads 1");
  CHECK(refusal("{\"lahar_bench\": 1}") == "not a result of lahar bench: /date is missing");
  auto json = nlohmann::json::parse(good);
  json["cases"][0]["variants"][0]["particles"] = "many";
  CHECK(refusal(json.dump()) ==
        "not a result of lahar bench: /cases/0/variants/0/particles is not a number");
  json["cases"] = 3;
  CHECK(refusal(json.dump()) == "not a result of lahar bench: /cases is not a list");
}

TEST_CASE("every unknown benchmark is named, with the nearest one there is") {
  const auto all = bench_plans(2);
  CHECK(messages([&] {
          choose_plans(all, {"h8-1m", "q4-100", "h8-4kk"}, false, 2);
        }) == std::vector<std::string>{"there is no benchmark \"q4-100\"; did you mean 'q4-100k'?",
                                       "there is no benchmark \"h8-4kk\"; did you mean 'h8-4k'?"});
}

TEST_CASE("benchmarks of several threads are left out, or refused, where there is one") {
  const auto all = bench_plans(1);
  for (const BenchPlan& plan : choose_plans(all, {}, true, 1)) CHECK(plan.threads == 1);
  CHECK(messages([&] { choose_plans(all, {"threads-h8-125k"}, false, 1); }) ==
        std::vector<std::string>{
            "benchmark \"threads-h8-125k\" needs 2 threads, but only 1 may be used; "});
}

TEST_CASE("large benchmarks run when they are named or asked for") {
  const auto all = bench_plans(2);
  const auto has = [](const std::vector<BenchPlan>& plans, const std::string& name) {
    return std::any_of(plans.begin(), plans.end(),
                       [&](const BenchPlan& plan) { return plan.name == name; });
  };
  CHECK_FALSE(has(choose_plans(all, {}, false, 2), "h8-10m"));
  CHECK(has(choose_plans(all, {}, true, 2), "h8-10m"));
  CHECK(choose_plans(all, {"h8-10m"}, false, 2).size() == 1);
  // The default ones fit into a small machine.
  for (const BenchPlan& plan : choose_plans(all, {}, false, 2)) CHECK(plan.bytes() < 3e9);
}

TEST_CASE("a benchmark that does not fit into memory is refused") {
  const auto plans = choose_plans(bench_plans(2), {"h8-4k", "h8-10m"}, false, 2);
  CHECK(messages([&] { check_bench_memory(plans, 2147483648.0); }) ==
        std::vector<std::string>{
            "benchmark \"h8-10m\" needs about 9.5 GiB of memory, 2.0 GiB are available; choose "
            "smaller ones with --cases; lahar bench --list has their sizes"});
  CHECK(messages([&] { check_bench_memory(plans, 1e11); }).empty());
}

TEST_CASE("a plate on general cells is the same plate") {
  const Model<2> boxes = bench_plate({}), general = bench_plate_isoparametric();
  CHECK(boxes.particles.size() == 40155);
  CHECK(general.particles.x == boxes.particles.x);
  CHECK(general.mesh->n_cells() == boxes.mesh->n_cells());
  CHECK_FALSE(general.mesh->is_cartesian());
  for (const Index cell : general.particles.cell) REQUIRE(cell >= 0);
}

TEST_CASE("a report has a row per run, a figure per ratio, and tables whose columns align") {
  const std::string text = bench_markdown(some_result());
  CHECK(text.starts_with("# Lahar 1.2.3 (commit abc)\n"));
  std::istringstream lines(text);
  std::size_t width = 0;
  int tables = 0;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("|")) {
      width = 0;
      continue;
    }
    if (width == 0) width = line.size(), ++tables;
    CHECK_MESSAGE(line.size() == width, line);
  }
  CHECK(tables == 6);  // machine, rates, times, figures, stages, what ran
  CHECK(text.find("| h8-4k | lattice |     4,096 |       1 | 20.0 | 10.0 - 40.0 | <= 30 |   19.0 | "
                  "50.0 |   264 |     17.6 |     88 % |\n") != std::string::npos);
  CHECK(text.find("Samples differ by more than 20 %: h8-4k (lattice).\n") != std::string::npos);
}

TEST_CASE("a measurement has all samples of all runs, ratios of a round, and what it ran") {
  const ExecutionOptions serial{.mode = ExecutionOptions::Mode::serial, .threads = 1};
  const BlockSize size{2};
  BenchPlan plan{.name = "tiny", .title = "A tiny block", .stages = true};
  plan.jobs = {{.name = "one",
                .model = [size] { return AnyModel(lattice_block<2>(size)); },
                .execution = serial},
               {.name = "two",
                .model = [size] { return AnyModel(deformed_block<2>(size)); },
                .execution = serial,
                .copies = 2,
                .life = 100}};
  plan.ratios = {{"two / one", 1, 0, 1.5}};
  BenchMachine machine;
  machine.rates = {{1, {{1e9}}, {}, {}}};
  const BenchProtocol protocol{.repeats = 3, .sample_seconds = 0.001, .steps = 60};
  const BenchCase result = measure(plan, protocol, machine, [](const std::string&) {});
  REQUIRE(result.variants.size() == 2);
  for (const BenchVariant& v : result.variants) {
    CHECK(v.ns.values.size() == 3);
    CHECK(v.ns.min() > 0);
    CHECK(v.cpu_ns.min() > 0);
    CHECK(v.particles == 64);
    CHECK(v.bytes == 184);
    CHECK(v.crossings >= 0);
    CHECK(v.stages.size() > 3);
  }
  CHECK(result.variants[0].bound == doctest::Approx(184));
  CHECK(result.variants[1].bound == 0);  // two threads were not measured
  CHECK(result.variants[0].steps == 60);
  CHECK(result.variants[1].steps == 50);  // half of a life
  REQUIRE(result.figures.size() == 1);
  for (std::size_t k = 0; k < 3; ++k)
    CHECK(result.figures[0].samples.values[k] ==
          doctest::Approx(result.variants[1].ns.values[k] / result.variants[0].ns.values[k]));
}

TEST_CASE("soil of the benchmark is full of water, or the same without") {
  const Model<2> wet = pore_block<2>({3}, PoreState::full),
                 dry = pore_block<2>({3}, PoreState::dry);
  CHECK(wet.analysis.two_phase);
  CHECK_FALSE(dry.analysis.two_phase);
  CHECK(wet.particles.x == dry.particles.x);
  CHECK(wet.particles.size() == BlockSize{3}.particles(2));
}

TEST_CASE_TEMPLATE("a measurement of steps with a solve has its iterations and products", D,
                   std::integral_constant<int, 2>, std::integral_constant<int, 3>) {
  constexpr int dim = D::value;
  const BlockSize size{4};
  const auto figures = [&](const std::function<AnyModel()>& model) {
    BenchPlan plan{.name = "tiny", .title = "A tiny block", .solves = true};
    plan.jobs = {{.name = "solve", .model = model, .execution = {.threads = 1}}};
    BenchMachine machine;
    machine.rates = {{1, {{1e9}}, {}, {}}};
    const BenchProtocol protocol{.repeats = 2, .sample_seconds = 0.001, .steps = 2};
    const BenchCase result = measure(plan, protocol, machine, [](const std::string&) {});
    std::map<std::string, BenchSamples> by_name;
    for (const BenchFigure& figure : result.figures) {
      CHECK(figure.samples.values.size() == 2);
      CHECK(figure.samples.min() > 0);
      by_name[figure.name] = figure.samples;
    }
    return by_name;
  };
  for (const auto& by_name : {figures([&] { return AnyModel(implicit_block<dim>(size)); }),
                              figures([&] { return AnyModel(projected_dam<dim>(size)); })}) {
    REQUIRE(by_name.size() == 4);
    CHECK(by_name.at("solve, iterations per step").min() >= 3);
    CHECK(by_name.at("solve, a product").max() < by_name.at("solve, an iteration").max());
    CHECK(by_name.contains("solve, product / bandwidth bound"));
  }
}

TEST_CASE("what fails in a measuring process is thrown where it is waited for") {
  const auto message = [](const std::function<void(ChildProcess&)>& work) -> std::string {
    ChildProcess child(work);
    try {
      return child.receive();
    } catch (const SimulationError& error) {
      return std::string("simulation: ") + error.what();
    } catch (const IoError& error) {
      return std::string("io: ") + error.what();
    }
  };
  CHECK(message([](ChildProcess& parent) { parent.send("fine"); }) == "fine");
  CHECK(message([](ChildProcess&) { throw SimulationError("lost"); }) == "simulation: lost");
  CHECK(message([](ChildProcess&) { throw std::bad_alloc(); }) ==
        "io: not enough memory for this benchmark");
  CHECK(message([](ChildProcess&) { raise(SIGKILL); }) ==
        "io: a measuring process was killed by signal 9; signal 9 usually means that memory ran "
        "out");
  CHECK(message([](ChildProcess&) {}) == "io: a measuring process ended too early");
}

TEST_CASE("the machine is described, and its rates are measured on every pass") {
  const BenchMachine machine = describe_machine();
  CHECK(machine.cores >= 1);
  CHECK(machine.memory > 0);
  CHECK(available_memory() > 0);
  CHECK(bench_array_bytes() >= (64u << 20));
  const BenchRates rates = measure_rates(2, 2, 1 << 16);
  CHECK(rates.threads == 2);
  for (const BenchSamples* samples : {&rates.triad, &rates.update, &rates.multiply}) {
    CHECK(samples->values.size() == 2);
    CHECK(samples->min() > 0);
  }
  CHECK(rates.bandwidth() == std::max(rates.triad.max(), rates.update.max()));
}
