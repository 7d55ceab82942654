#include "physics/kernels/liquid_contact.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "physics/basis/any_basis.h"
#include "physics/kernels/contact_push.h"
#include "physics/kernels/pore_rows.h"

namespace lahar {

namespace {

/// Call act(k, near, P) for the bodies that hold a particle at x, whose pushes have the sum `all`:
/// each takes the part along its normal.
template <int Dim, class Act>
void for_each_push(const Bodies<Dim>& bodies, const Vec<Dim>& x, double reach, Vec<Dim> all,
                   Act act) {
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    const auto near = bodies.nearest(k, x);
    const double gap = near.distance - reach, push = all.dot(near.normal);
    // A liquid that bears grains holds them where these hardly touch.
    if (!(gap < 0.0) && !(push > 0.0 && gap < reach)) continue;
    all -= push * near.normal;
    act(k, near, push);
  }
}

/// Whether particles of a bin may have pushes.
template <int Dim>
auto may_press(const Patch<Dim>& patch, const StepContext<Dim>& step) {
  return [&patch, &step](const ParticleBin& bin) {
    return has_liquid(*step.model)(bin) && has_particle_forces(patch, bin, *step.model);
  };
}

/// k of a particle with the springs of its skeleton.
template <int Dim>
double liquid_stiffness(const Touching<Dim>& p, const ContactBin& bin, double volume) {
  const Pores pores(*bin.liquid);
  const Scalar m(p.mass), V(volume);
  const double n = pores.porosity(m, V)[0], m_l = pores.liquid_mass(m, V)[0];
  const double moves = 1.0 / ((1 - n) * (1 - n) / p.mass + n * n / m_l);
  return std::min(bin.liquid->bulk_modulus / n * p.area / (0.5 * bin.h),
                  moves / (p.longest * p.longest));
}

}  // namespace

template <int Dim>
void press_liquid(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  const Bodies<Dim> bodies(patch, step);
  const ContactRows<Dim> rows(patch.particles);
  const auto liquid = patch.particles.template rows<Dim>(Column::contact_liquid);
  const double* u = patch.liquid.discharge.data();
  for_each_bin_with_basis(
      patch, bins, may_press(patch, step),
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
        const ContactBin common = contact_bin(patch, step, bin);
        const double longest = longest_step(step, common);
        for (Local p = bin.begin; p < bin.end; ++p) {
          const Vec<Dim> grains = get<Dim>(rows.force, p), before = get<Dim>(liquid, p);
          if (grains.isZero(0.0) && before.isZero(0.0)) continue;
          Touching<Dim> at;
          begin(at, rows, common, p, bodies, step.dt);
          move_with_step<Dim>(at, common, Vec<Dim>::Zero(), step.dt);
          limit_spring(at, common, longest);
          const double k = liquid_stiffness(at, common, patch.particles.row(Column::volume)[p]);
          Vec<Dim> now = Vec<Dim>::Zero();
          for_each_push(
              bodies, at.x, at.reach, before,
              [&](std::size_t body, const typename Solid<Dim>::Nearest& near, double old) {
                double out = 0;  // [m/s]
                give_push<Dim>(basis, p,
                               {near.normal, at.extent + near.distance - at.reach, at.extent},
                               [&](int i, const Vec<Dim>& w) {
                                 out += w.dot(Eigen::Map<const Vec<Dim>>(
                                     u + static_cast<std::ptrdiff_t>(nodes[i]) * node_width));
                               });
                const double moves = bodies.at(body).velocity_at(at.x).dot(near.normal);
                const double free = old - k * step.dt * (out - moves);
                const double least = -std::max(0.0, grains.dot(near.normal));
                const double push = std::max(free, least);
                const double mean = 0.5 * (old + push) * step.dt;
                const double lost = -least * (push - free) / k;  // the liquid comes off
                patch.work.internal -= mean * (out - moves) + lost;
                patch.work.external += mean * moves;
                patch.work.damping += lost;
                patch.work.friction += lost;
                now += push * near.normal;
                patch.reactions[body].template add<Dim>(-push * near.normal,
                                                        at.x - bodies.at(body).origin);
              });
          set<Dim>(liquid, p, now);
        }
      });
}

template <int Dim>
void map_liquid_pushes(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  const auto& list = step.model->rigid_bodies;
  std::vector<Placement<Dim>> places;
  for (const RigidBody<Dim>& body : list)
    places.push_back(placement_at(body, step.model->functions, step.time));
  const Bodies<Dim> bodies(*step.model, places);
  const ContactRows<Dim> rows(patch.particles);
  const auto liquid = patch.particles.template rows<Dim>(Column::contact_liquid);
  double* mixture = patch.own_sums(NodeSum::force, step.step);
  double* own = patch.own_sums(NodeSum::liquid_force, step.step);
  for_each_bin_with_basis(
      patch, bins, may_press(patch, step),
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
        for (Local p = bin.begin; p < bin.end; ++p) {
          const Vec<Dim> all = get<Dim>(liquid, p);
          if (all.isZero(0.0)) continue;
          const double reach = rows.reach[p], extent = rows.extent[p];
          for_each_push(bodies, get<Dim>(rows.x, p), reach, all,
                        [&](std::size_t, const typename Solid<Dim>::Nearest& near, double push) {
                          give_push<Dim>(
                              basis, p, {near.normal, extent + near.distance - reach, extent},
                              [&](int i, const Vec<Dim>& w) {
                                const NodeVector f = node_vector<Dim>(Vec<Dim>(push * w));
                                general::add_to_node(mixture, nodes[i], f);
                                general::add_to_node(own, nodes[i], f);
                              });
                        });
        }
      });
}

#define LAHAR_INSTANTIATE(Dim)                                                         \
  template void press_liquid<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins); \
  template void map_liquid_pushes<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
