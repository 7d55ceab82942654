#include "runtime/timestep.h"

#include "physics/kernels.h"

namespace lahar {

template <int Dim>
std::vector<TimestepStage<Dim>> timestep(const Analysis& analysis) {
  using P = Patch<Dim>;
  using S = const StepContext<Dim>;
  using List = std::vector<TimestepStage<Dim>>;

  const TimestepStage<Dim> p2g{{.name = "P2G", .exchange = "particles"}, [](P& p, S&) {
                                 receive(p);
                                 if (!update_idle(p)) map_mass_momentum(p);
                               }};
  const TimestepStage<Dim> force{{.name = "force"}, [](P& p, S& s) { map_force(p, s); }};
  const TimestepStage<Dim> g2p{{.name = "G2P"}, [](P& p, S& s) { update_particles(p, s); }};
  const TimestepStage<Dim> locate{{.name = locate_stage, .gives_dt = analysis.step.adaptive},
                                  [](P& p, S& s) {
                                    // Before particles leave for other patches, so that none is
                                    // missed.
                                    if (s.model->analysis.step.adaptive)
                                      p.time_step_limit = time_step_limit(p, *s.model);
                                    lahar::locate(p, s);
                                  }};
  const TimestepStage<Dim> output{{.name = output_stage}, nullptr};

  // Strain and stress: one stage, or two with the exchange of nodal pressure between them.
  const bool usf = analysis.scheme == Scheme::usf;
  List stress;
  if (analysis.pressure_smoothing) {
    stress = {{{.name = "strain", .needs_dt = usf},
               [](P& p, S& s) {
                 update_stress(p, s, StressPart::strain);
                 map_pressure(p, s);
               }},
              {{.name = "stress", .exchange = "pressure"}, [](P& p, S& s) {
                 sum_over_patches(p, NodeSum::pressure);
                 smooth_pressure(p, s);
                 update_stress(p, s, StressPart::law);
               }}};
  } else {
    stress = {{{.name = "stress", .needs_dt = usf},
               [](P& p, S& s) { update_stress(p, s, StressPart::both); }}};
  }

  List list;
  const auto add = [&](const TimestepStage<Dim>& stage) { list.push_back(stage); };
  const auto add_stress = [&] { list.insert(list.end(), stress.begin(), stress.end()); };

  if (usf) {  // update stress first: strain from the velocities at the beginning of the step
    add(p2g);
    add({{.name = "velocity", .exchange = "mass, momentum"}, [](P& p, S&) {
           sum_over_patches(p, NodeSum::mass_momentum);
           nodal_velocity(p, NodeSum::mass_momentum);
         }});
    add_stress();
    add(force);
    add({{.name = "integrate", .exchange = "force"}, [](P& p, S& s) {
           sum_over_patches(p, NodeSum::force);
           integrate(p, s);
         }});
    add(g2p);
  } else {  // update stress last: one exchange carries mass, momentum and force
    add(p2g);
    add(force);
    add({{.name = "integrate", .exchange = "mass, momentum, force", .needs_dt = true},
         [](P& p, S& s) {
           sum_over_patches(p, NodeSum::mass_momentum);
           sum_over_patches(p, NodeSum::force);
           nodal_velocity(p, NodeSum::mass_momentum);
           integrate(p, s);
         }});
    add(g2p);
    if (analysis.scheme == Scheme::musl) {  // nodal velocities again, from the updated particles
      add({{.name = "P2G again"}, [](P& p, S&) { map_momentum(p); }});
      add({{.name = "velocity", .exchange = "momentum"}, [](P& p, S&) {
             sum_over_patches(p, NodeSum::momentum);
             nodal_velocity(p, NodeSum::momentum);
           }});
    }
    add_stress();
  }
  add(locate);
  add(output);
  return list;
}

template std::vector<TimestepStage<2>> timestep<2>(const Analysis&);
template std::vector<TimestepStage<3>> timestep<3>(const Analysis&);

}  // namespace lahar
