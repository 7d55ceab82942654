// The list of cases of `lahar bench`.
#include <fmt/format.h>

#include <algorithm>

#include "io/base/problems.h"
#include "runtime/bench/bench_cases.h"
#include "runtime/bench/bench_solves.h"
#include "runtime/terminal/console.h"

namespace lahar {

namespace {

using Kind = BenchPlan::Kind;

const ExecutionOptions one_thread{.threads = 1};
const ExecutionOptions serial{.mode = ExecutionOptions::Mode::serial, .threads = 1};

ExecutionOptions on(int threads) {
  return {.threads = threads};
}

/// Sizes of the blocks, by the number of particles that names them.
constexpr BlockSize q4_4k{16}, q4_100k{80}, q4_1m{250}, q4_10m{790};
constexpr BlockSize h8_4k{8}, h8_125k{25}, h8_1m{50}, h8_10m{108};

template <int Dim>
BenchJob lattice(const std::string& name, const BlockSize& size, const ExecutionOptions& execution,
                 double goal = 0) {
  return {.name = name,
          .model = [size] { return AnyModel(lattice_block<Dim>(size)); },
          .execution = execution,
          .particles = static_cast<double>(size.particles(Dim)),
          .goal = goal};
}

template <int Dim>
BenchJob irregular(const std::string& name, const BlockSize& size,
                   const ExecutionOptions& execution = one_thread) {
  BenchJob job = lattice<Dim>(name, size, execution);
  job.model = [size] { return AnyModel(deformed_block<Dim>(size)); };
  job.life = flight_steps;
  return job;
}

BenchJob plate(const std::string& name, const ExecutionOptions& execution,
               const std::string& scheme, double goal = 0) {
  return {.name = name,
          .model = [scheme] { return AnyModel(bench_plate({"analysis.mpm_scheme=" + scheme})); },
          .execution = execution,
          .particles = 40155,
          .goal = goal,
          .steps = 1000};
}

/// Models of solves have two particles along each edge of a cell in 2D, too.
Index two_per_cell(const BlockSize& size, int dim) {
  Index n = 1;
  for (int d = 0; d < dim; ++d) n *= 2 * size.cells;
  return n;
}

BenchJob with_particles(BenchJob job, Index particles) {
  job.particles = static_cast<double>(particles);
  return job;
}

BenchPlan plates() {
  BenchJob general = plate("USF, isoparametric", one_thread, "usf", 20);
  general.model = [] { return AnyModel(bench_plate_isoparametric()); };
  return {
      .name = "plate",
      .title = "Plate with a hole, Q4, 40,155 particles",
      .jobs = {plate("USF", one_thread, "usf", 12), plate("USL", one_thread, "usl", 10), general}};
}

template <int Dim>
BenchPlan block(const std::string& size_name, const BlockSize& size, double goal = 0) {
  // A block of one patch flies into eight: that has nothing to do with its order.
  const double deformed_goal = size.cells > h8_4k.cells ? 1.15 : 0;
  return {
      .name = fmt::format("{}-{}", Dim == 2 ? "q4" : "h8", size_name),
      .title = fmt::format("Block, {}, linear elastic, USL, {} particles", Dim == 2 ? "Q4" : "H8",
                           format_count(size.particles(Dim))),
      .jobs = {lattice<Dim>("lattice", size, one_thread, goal), irregular<Dim>("deformed", size)},
      .ratios = {{"deformed / lattice", 1, 0, deformed_goal}}};
}

BenchPlan soil(const std::string& size_name, const BlockSize& size) {
  const auto job = [&](const char* name, SoilState state) {
    BenchJob one = lattice<3>(name, size, one_thread, 80);
    one.model = [size, state] { return AnyModel(soil_block(size, state)); };
    one.life = 400;  // steps until the block's sides have relaxed too far into it
    return one;
  };
  return {.name = "h8-soil-" + size_name,
          .title = fmt::format("Block, H8, Mohr-Coulomb, USL, {} particles",
                               format_count(size.particles(3))),
          .jobs = {job("all yielding", SoilState::yielding), job("elastic", SoilState::elastic)}};
}

/// Each sample is the same fall, from its beginning.
template <int Dim>
BenchJob falling(const char* name) {
  return {.name = name,
          .model = [] { return AnyModel(collapse<Dim>()); },
          .execution = one_thread,
          .particles = static_cast<double>(collapse_particles<Dim>),
          .steps = collapse_steps<Dim>,
          .life = collapse_steps<Dim>};
}

BenchPlan collapses() {
  return {.name = "collapse",
          .title = "Soil that runs out, Mohr-Coulomb, MUSL, splines, gaps",
          .jobs = {falling<2>("column of sand, 2D"), falling<3>("cliff of soil, 3D")},
          .stages = true};
}

template <int Dim>
BenchPlan large_block(const std::string& size_name, const BlockSize& size) {
  BenchPlan plan = block<Dim>(size_name, size);
  plan.large = true;
  plan.bound_at_most = 1.2;
  return plan;
}

/// In the caches and beyond.
template <int Dim>
BenchPlan stages(const BlockSize& small, const BlockSize& big) {
  const auto name = [](const BlockSize& size) {
    return format_count(size.particles(Dim)) + " particles";
  };
  return {.name = Dim == 2 ? "stages-q4" : "stages-h8",
          .title = fmt::format("Each stage alone, {}, USL, serial loop", Dim == 2 ? "Q4" : "H8"),
          .jobs = {lattice<Dim>(name(small), small, serial), lattice<Dim>(name(big), big, serial),
                   irregular<Dim>(name(big) + ", deformed", big, serial)},
          .stages = true};
}

/// Functions and transfers other than linear ones with FLIP, beside these; the goals are of issue
/// and literature for one core.
template <int Dim>
BenchPlan kernels(const std::string& size_name, const BlockSize& size) {
  BenchPlan plan{.name = fmt::format("kernels-{}d", Dim),
                 .title = fmt::format("Functions and transfers, {}D, linear elastic, USL, {} "
                                      "particles",
                                      Dim, size_name),
                 .stages = true};
  const auto add = [&](const std::string& name, ShapeFunctions functions, Affine affine,
                       double goal = 0, Element element = multilinear<Dim>) {
    BenchJob job = lattice<Dim>(name, size, one_thread, goal);
    job.model = [=] {
      Model<Dim> model = element == multilinear<Dim> ? lattice_block<Dim>(size)
                                                     : element_block<Dim>(size, element);
      model.analysis.functions = functions;
      model.analysis.affine = affine;
      if (affine != Affine::none) model.analysis.transfer.flip = 0.0;
      return AnyModel(std::move(model));
    };
    plan.jobs.push_back(job);
  };
  const bool solid = Dim == 3;
  add("linear", ShapeFunctions::element, Affine::none);
  add("linear, APIC", ShapeFunctions::element, Affine::apic);
  add("GIMP", ShapeFunctions::gimp, Affine::none, solid ? 150 : 0);
  add("quadratic spline", ShapeFunctions::quadratic_spline, Affine::none);
  add("quadratic spline, APIC", ShapeFunctions::quadratic_spline, Affine::apic, solid ? 100 : 0);
  add("cubic spline, TPIC", ShapeFunctions::cubic_spline, Affine::tpic);
  add("CPDI", ShapeFunctions::cpdi, Affine::none);
  add("CPDI2", ShapeFunctions::cpdi2, Affine::none);
  if constexpr (Dim == 2) {
    add("T3", ShapeFunctions::element, Affine::none, 25, Element::T3);
    add("Q8", ShapeFunctions::element, Affine::none, 35, Element::Q8);
  }
  return plan;
}

/// Steps that begin with a linear solve.
BenchPlan solves(const std::string& name, const std::string& title, BenchJob job,
                 const std::function<AnyModel()>& model) {
  job.model = model;
  return {.name = name, .title = title, .jobs = {job}, .solves = true};
}

template <int Dim>
BenchPlan implicit(const std::string& size_name, const BlockSize& size) {
  return solves(fmt::format("implicit-{}-{}", Dim == 2 ? "q4" : "h8", size_name),
                fmt::format("Implicit step, {}, linear elastic, Newmark's method, {} particles",
                            Dim == 2 ? "Q4" : "H8", format_count(two_per_cell(size, Dim))),
                with_particles(lattice<Dim>("Newmark", size, one_thread), two_per_cell(size, Dim)),
                [size] { return AnyModel(implicit_block<Dim>(size)); });
}

BenchPlan projection(const std::string& size_name, const BlockSize& size) {
  return solves("projection-q4-" + size_name,
                fmt::format("Projection, Q4, dam of water, {} particles",
                            format_count(two_per_cell(size, 2))),
                with_particles(lattice<2>("projection", size, one_thread), two_per_cell(size, 2)),
                [size] { return AnyModel(projected_dam<2>(size)); });
}

template <int Dim>
BenchPlan two_phase(const std::string& size_name, const BlockSize& size) {
  constexpr double goal = 1.7;
  const auto job = [&](const char* name, PoreState state) {
    BenchJob one = lattice<Dim>(name, size, one_thread);
    one.model = [size, state] { return AnyModel(pore_block<Dim>(size, state)); };
    return one;
  };
  return {.name = fmt::format("two-phase-{}-{}", Dim == 2 ? "q4" : "h8", size_name),
          .title = fmt::format("Soil full of water against dry soil, {}, USL, {} particles",
                               Dim == 2 ? "Q4" : "H8", format_count(size.particles(Dim))),
          .jobs = {job("two phases", PoreState::full), job("one phase", PoreState::dry)},
          .ratios = {{"two phases / one phase", 0, 1, goal}},
          .stages = true};
}

template <int Dim>
BenchPlan contact(const std::string& size_name, const BlockSize& size) {
  constexpr double goal = 1.25;
  const auto job = [&](const char* name, int bodies) {
    BenchJob one = lattice<Dim>(name, size, one_thread);
    one.model = [size, bodies] { return AnyModel(stacked_block<Dim>(size, bodies)); };
    return one;
  };
  return {.name = fmt::format("contact-{}-{}", Dim == 2 ? "q4" : "h8", size_name),
          .title = fmt::format("Bodies in contact, {}, quadratic splines, MUSL, {} particles",
                               Dim == 2 ? "Q4" : "H8", format_count(size.particles(Dim))),
          .jobs = {job("two bodies", 2), job("one body", 1)},
          .ratios = {{"two bodies / one body", 0, 1, goal}},
          .stages = true};
}

BenchPlan graph_overhead(const std::string& name, const std::string& title, const BenchJob& graph,
                         const BenchJob& loop) {
  return {.name = name,
          .title = title,
          .jobs = {graph, loop},
          .ratios = {{"task graph / serial loop", 0, 1, 1.02}}};
}

BenchPlan trace_overhead(const std::string& name, const std::string& title, const BenchJob& job) {
  BenchJob traced = job;
  traced.name = "traced";
  traced.traced = true;
  return {.name = name,
          .title = title,
          .jobs = {traced, job},
          .ratios = {{"traced / not traced", 0, 1, 1.02}}};
}

/// Two threads of one run against two runs of one thread each.
BenchPlan two_threads(const std::string& size_name, const BlockSize& size, bool large) {
  BenchJob runs = lattice<3>("two runs of one thread", size, one_thread);
  runs.copies = 2;
  return {.name = "threads-h8-" + size_name,
          .title = fmt::format("Two threads, H8, USL, {} particles per run",
                               format_count(size.particles(3))),
          .jobs = {lattice<3>("two threads", size, on(2)), runs},
          .ratios = {{"throughput: two threads / two runs", 1, 0, 0, 0.97}},
          .large = large,
          .threads = 2};
}

/// 1, 2, 4, ... and all.
std::vector<int> thread_counts(int most) {
  std::vector<int> counts;
  for (int n = 1; n < most; n *= 2) counts.push_back(n);
  counts.push_back(most);
  return counts;
}

std::string threads_name(int n) {
  return fmt::format("{} thread{}", n, n == 1 ? "" : "s");
}

template <class MakeJob>
BenchPlan scaling(const std::string& name, const std::string& title, int most, MakeJob job) {
  BenchPlan plan{.name = name, .title = title, .threads = 2};
  for (const int n : thread_counts(most)) {
    plan.jobs.push_back(job(n));
    if (n > 1)
      plan.ratios.push_back(
          {fmt::format("speed-up of {}", threads_name(n)), 0, plan.jobs.size() - 1});
  }
  return plan;
}

BenchPlan memory(const std::string& size_name, const BlockSize& size, bool large) {
  BlockSize empty{2};
  empty.mesh_cells = size.cells + 2 * (size.cells / 2);
  BlockSize full = size;
  full.mesh_cells = empty.mesh_cells;
  BenchJob with_output = lattice<3>("output on", full, one_thread);
  with_output.output = true;
  return {.kind = Kind::memory,
          .name = "memory-h8-" + size_name,
          .title = fmt::format("Memory per particle, H8, USL, {} particles",
                               format_count(size.particles(3))),
          .jobs = {lattice<3>("output off", full, one_thread), with_output,
                   lattice<3>("empty", empty, one_thread)},
          .large = large};
}

BenchPlan start_up(const std::string& name, const std::string& title, const BlockSize& size,
                   bool large) {
  return {.kind = Kind::start_up,
          .name = name,
          .title = title,
          .jobs = {lattice<3>("start", size, one_thread)},
          .large = large};
}

}  // namespace

double BenchPlan::bytes() const {
  // The columns of a particle, the table it is made from, and its share of the nodes while the
  // table becomes patches; a process without particles. Structured meshes store next to nothing.
  constexpr double per_particle = 500, per_process = 50e6;
  double sum = 0, most = 0;
  for (const BenchJob& job : jobs) {
    const double bytes = job.copies * (job.particles * per_particle + per_process);
    sum += bytes;
    most = std::max(most, bytes);
  }
  return kind == Kind::time ? sum : most;
}

double BenchPlan::seconds(int repeats) const {
  constexpr double build = 2e-6, step = 1e-7, writing = 5e-6;  // [s] per particle
  constexpr int steps_of_sample = 2, warm_up = 2;
  double sum = 0;
  for (const BenchJob& job : jobs) {
    double each = build;
    if (kind == Kind::time) each += (repeats * steps_of_sample + warm_up) * step;
    if (kind == Kind::start_up) each *= repeats;
    if (job.output) each += writing;
    sum += job.copies * job.particles * each;
  }
  return sum;
}

std::vector<BenchPlan> bench_plans(int threads) {
  return {
      plates(),
      block<2>("100k", q4_100k),
      block<2>("1m", q4_1m),
      large_block<2>("10m", q4_10m),
      block<3>("4k", h8_4k, 30),
      block<3>("125k", h8_125k, 30),
      block<3>("1m", h8_1m, 35),
      large_block<3>("10m", h8_10m),
      soil("125k", h8_125k),
      collapses(),
      stages<2>(q4_4k, q4_1m),
      stages<3>(h8_4k, h8_1m),
      kernels<2>("102,400", q4_100k),
      kernels<3>("125,000", h8_125k),
      implicit<2>("160k", {200}),
      implicit<3>("110k", {24}),
      projection("160k", {200}),
      two_phase<2>("100k", q4_100k),
      two_phase<3>("125k", h8_125k),
      contact<2>("100k", q4_100k),
      contact<3>("125k", h8_125k),
      graph_overhead("graph-plate", "Task graph against the serial loop, plate with a hole, USF",
                     plate("task graph", one_thread, "usf"), plate("serial loop", serial, "usf")),
      graph_overhead("graph-h8-125k", "Task graph against the serial loop, H8, 125,000 particles",
                     lattice<3>("task graph", h8_125k, one_thread),
                     lattice<3>("serial loop", h8_125k, serial)),
      trace_overhead("trace-plate", "A trace against none, plate with a hole, USF",
                     plate("not traced", one_thread, "usf")),
      trace_overhead("trace-h8-125k", "A trace against none, H8, 125,000 particles",
                     lattice<3>("not traced", h8_125k, one_thread)),
      two_threads("125k", h8_125k, false),
      two_threads("10m", h8_10m, true),
      scaling("scaling-plate", "Threads, plate with a hole, USF", threads,
              [](int n) { return plate(threads_name(n), on(n), "usf"); }),
      scaling("scaling-h8-1m", "Threads, H8, USL, 1,000,000 particles", threads,
              [](int n) { return lattice<3>(threads_name(n), h8_1m, on(n)); }),
      memory("1m", h8_1m, false),
      memory("10m", h8_10m, true),
      start_up("start-h8-1m", "Start-up, H8, 1,000,000 particles", h8_1m, false),
      start_up("start-h8-10m", "Start-up, H8, 10,077,696 particles", h8_10m, true),
      start_up("start-100m-cells", "Start-up, mesh of 100,544,625 cells, 1 % of them filled",
               {100, 465}, true)};
}

std::vector<BenchPlan> choose_plans(std::vector<BenchPlan> all,
                                    const std::vector<std::string>& names, bool large,
                                    int threads) {
  if (names.empty()) {
    std::erase_if(all, [&](const BenchPlan& plan) {
      return (plan.large && !large) || plan.threads > threads;
    });
    return all;
  }
  std::vector<std::string> known;
  for (const BenchPlan& plan : all) known.push_back(plan.name);
  std::vector<Problem> problems;
  for (const std::string& name : names)
    if (std::find(known.begin(), known.end(), name) == known.end())
      problems.push_back({.message = fmt::format("there is no benchmark \"{}\"", name),
                          .hint = suggest(name, known, "benchmarks")});
  for (const BenchPlan& plan : all)
    if (plan.threads > threads && std::find(names.begin(), names.end(), plan.name) != names.end())
      problems.push_back(
          {.message = fmt::format("benchmark \"{}\" needs {} threads, but only {} may be used",
                                  plan.name, plan.threads, threads)});
  if (!problems.empty()) throw InputError(std::move(problems));
  std::erase_if(all, [&](const BenchPlan& plan) {
    return std::find(names.begin(), names.end(), plan.name) == names.end();
  });
  return all;
}

void check_bench_memory(const std::vector<BenchPlan>& plans, double available) {
  std::vector<Problem> problems;
  for (const BenchPlan& plan : plans)
    if (plan.bytes() > available)
      problems.push_back(
          {.message = fmt::format("benchmark \"{}\" needs about {} of memory, {} are available",
                                  plan.name, format_bytes(plan.bytes()), format_bytes(available)),
           .hint = "choose smaller ones with --cases; lahar bench --list has their sizes"});
  if (!problems.empty()) throw InputError(std::move(problems));
}

}  // namespace lahar
