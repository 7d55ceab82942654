#include "runtime/exchange/failure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <tuple>

namespace lahar {

void FailureList::add(Failure failure) {
  const std::scoped_lock lock(mutex_);
  failures_.push_back(std::move(failure));
}

bool FailureList::empty() const {
  const std::scoped_lock lock(mutex_);
  return failures_.empty();
}

bool FailureList::by(Step step) const {
  const std::scoped_lock lock(mutex_);
  return std::any_of(failures_.begin(), failures_.end(),
                     [&](const Failure& f) { return f.step <= step; });
}

Failure FailureList::earliest() const {
  const std::scoped_lock lock(mutex_);
  return *std::min_element(failures_.begin(), failures_.end(),
                           [](const Failure& a, const Failure& b) {
                             return std::tuple(a.step, a.stage_index, a.patch) <
                                    std::tuple(b.step, b.stage_index, b.patch);
                           });
}

Index FailureList::count(Step step) const {
  const std::scoped_lock lock(mutex_);
  return std::count_if(failures_.begin(), failures_.end(),
                       [&](const Failure& f) { return f.step == step; });
}

void take_first_text(const Communicator& ranks, bool has, std::string& text) {
  const Index first = ranks.min(Index{has ? ranks.rank() : ranks.size()});
  if (first < ranks.size()) ranks.broadcast(text, static_cast<int>(first));
}

std::string failure_message(const Failure& first, int rank, Index failed,
                            std::string_view counted) {
  std::string text =
      fmt::format("{} {} (t = {:.6g} s), rank {}, patch {}, stage {}: {}", counted, first.step,
                  first.time, rank, first.patch, first.stage, first.cause);
  if (failed > 1) text += fmt::format(" ({} more patches failed in this {})", failed - 1, counted);
  return text;
}

namespace {

std::string tuple(std::span<const double> values) {
  return fmt::format("({:.6g})", fmt::join(values, ", "));
}

std::string name_of(Index id, Index injected) {
  return id >= injected ? "an injected particle" : fmt::format("particle {}", id);
}

/// `x` [m] and `v` [m/s] may have more components than the model.
template <int Dim>
std::string describe(const std::string& name, std::span<const double> x,
                     std::span<const double> v) {
  return fmt::format("{} at {} m, velocity {} m/s", name, tuple(x.first(Dim)), tuple(v.first(Dim)));
}

}  // namespace

template <int Dim>
std::string describe_particle(const Particles<Dim>& particles, Local p, Index injected) {
  std::array<double, Dim> x, v;
  for (int d = 0; d < Dim; ++d) {
    x[static_cast<std::size_t>(d)] = particles.row(Column::x, d)[p];
    v[static_cast<std::size_t>(d)] = particles.row(Column::v, d)[p];
  }
  return describe<Dim>(name_of(particles.id[static_cast<std::size_t>(p)], injected), x, v);
}

template <int Dim>
std::string describe_particle(const RemovedParticle& particle) {
  return describe<Dim>(fmt::format("particle {}", particle.id), particle.position,
                       particle.velocity);
}

template <int Dim>
std::string describe_fault(const ParticleFault& fault, const Model<Dim>& model, Index injected) {
  constexpr std::size_t n = Dim;
  const std::string particle =
      describe<Dim>(name_of(fault.particle, injected), fault.position, fault.velocity);
  const std::string more =
      fault.count > 1 ? fmt::format(" (and {} more here)", fault.count - 1) : "";
  switch (fault.kind) {
    case ParticleFault::Kind::left_mesh:
      return particle + more +
             " left the mesh. Enlarge the mesh, constrain its boundary nodes, or let such "
             "particles "
             "be removed with \"locate_particles\": false in \"analysis\".";
    case ParticleFault::Kind::not_finite:
      return particle + more +
             " is not finite: the computation has become unstable. Reduce the time step or check "
             "material parameters and loads.";
    case ParticleFault::Kind::volume:
      return fmt::format(
          "{} at {} m{} would get a volume of zero or less within one step: "
          "its cell collapses. Reduce the time step{}.",
          name_of(fault.particle, injected), tuple(std::span(fault.position).first(n)), more,
          model.analysis.scheme == Scheme::musl || begins_with_solve(model.analysis)
              ? ""
              : ", or use \"mpm_scheme\": \"musl\", which bears nodes of little mass better");
    case ParticleFault::Kind::moved_too_far:
      return particle + more +
             " moved beyond the neighbouring patches within one step. Reduce the time step.";
    case ParticleFault::Kind::law:
      if (model.analysis.plane == Plane::stress)
        return fmt::format(
            "{}{}: material '{}' found no stress that it allows, or none that is zero across the "
            "sheet, after stress {} Pa (xx yy zz xy yz xz). Check its parameters, reduce the time "
            "step, or use \"plane\": \"strain\" in \"analysis\".",
            particle, more, model.materials[fault.material].name, tuple(fault.stress));
      return fmt::format(
          "{}{}: material '{}' found no stress that it allows after stress {} Pa (xx yy zz xy yz "
          "xz), not even in {} parts of the increment. Check its parameters, or reduce the time "
          "step.",
          particle, more, model.materials[fault.material].name, tuple(fault.stress), most_parts);
    case ParticleFault::Kind::domain:
      return particle + more +
             " has a domain that reaches beyond the cells around its own. Use larger cells or "
             "smaller particles, or take the functions of a smaller domain with "
             "\"large_domains\": \"clip\" in \"analysis\".";
    case ParticleFault::Kind::folded:
      return particle + more +
             " has a domain whose corners have moved so that it folds: functions would be "
             "negative. Reduce the time step, use more particles per cell, or "
             "\"shape_functions\": \"cpdi\", whose domains remain parallelepipeds.";
    default:
      return particle;
  }
}

std::string unstable_message(double dt, double limit, const std::string& particle) {
  return fmt::format("the time step {:.6g} s is above the stability limit {:.6g} s of {}.", dt,
                     limit, particle);
}

std::string unstable_hint(double limit) {
  // Rounded down to three digits, so that the value is one that will be accepted.
  const double unit = std::pow(10.0, std::floor(std::log10(limit)) - 2);
  limit = std::floor(limit / unit) * unit;
  return fmt::format(
      "Use a step below {:.3g} s, an adaptive one (\"time_step\": {{\"adaptive\": true}}), or "
      "accept "
      "it with \"time_step\": {{\"accept_unstable\": true}}.",
      limit);
}

template std::string describe_fault<2>(const ParticleFault&, const Model<2>&, Index);
template std::string describe_fault<3>(const ParticleFault&, const Model<3>&, Index);
template std::string describe_particle<2>(const Particles<2>&, Local, Index);
template std::string describe_particle<3>(const Particles<3>&, Local, Index);
template std::string describe_particle<2>(const RemovedParticle&);
template std::string describe_particle<3>(const RemovedParticle&);

}  // namespace lahar
