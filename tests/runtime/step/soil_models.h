/// \file Cases of other tests with soil that yields, and what is injected in three dimensions.
#pragma once

#include <algorithm>
#include <string>

#include "tests/runtime/step/models.h"

namespace lahar::test {

/// The same case of weak soils that yield, and soften as they do: slowly, for there is no stress
/// where strength falls faster than stress does when the soil is unloaded.
template <int Dim>
Model<Dim> yielding(Model<Dim> model, double youngs_modulus, double cohesion) {
  for (Material& material : model.materials) {
    MohrCoulomb soil{.youngs_modulus = youngs_modulus,
                     .poisson_ratio = 0.3,
                     .friction = 25,
                     .dilation = 4,
                     .cohesion = cohesion,
                     .tension_cutoff = cohesion};
    soil.softening = true;
    soil.residual_friction = 18;
    soil.residual_cohesion = 0.5 * cohesion;
    soil.residual_pdstrain = 2;
    material.law = soil;
  }
  return model;
}

inline Model<2> yielding_discs() {
  return yielding(two_discs(), 2000, 150);
}
inline Model<3> yielding_column() {
  return yielding(dam_break_3d(), 4e4, 100);
}

/// Share of the particles whose state variable is above zero.
inline double share_above_zero(const Frame& frame, std::string_view name) {
  const FrameColumn* column = frame.find(name);
  if (!column || frame.size() == 0) return 0;
  const auto n = std::count_if(column->values.begin(), column->values.end(),
                               [](double value) { return value > 0; });
  return static_cast<double>(n) / static_cast<double>(frame.size());
}

/// A shaft of ten cells into whose uppermost one particles fall, from 0.01 s to before 0.02 s.
inline Model<3> filled_shaft() {
  return model_of_text<3>(R"({
    "mesh": {"structured": {"cell_size": 0.05, "counts": [1, 1, 10]},
             "boundary_conditions": {"velocity_constraints": [
               {"nset": "all", "dir": "x", "velocity": 0},
               {"nset": "all", "dir": "y", "velocity": 0},
               {"nset": "floor", "dir": "z", "velocity": 0}]}},
    "sets": {"nodes": {"all": {"all": true},
                       "floor": {"half_space": {"point": [0, 0, 0], "normal": [0, 0, 1]}}},
             "cells": {"top": {"box": {"min": [0, 0, 0.45], "max": [0.05, 0.05, 0.5]}}}},
    "materials": [{"type": "LinearElastic", "density": 1800, "youngs_modulus": 1e5,
                   "poisson_ratio": 0}],
    "particles": [{"generator": {"type": "inject", "cset": "top", "nparticles_per_dir": 2,
                                 "velocity": [0, 0, -5], "duration": [0.01, 0.02],
                                 "material": 0}}],
    "external_loading_conditions": {"gravity": [0, 0, -9.81]},
    "analysis": {"dt": 1e-3, "nsteps": 100, "patch_particles": 16, "velocity_update": "pic"},
    "post_processing": {"output_steps": 10, "history_steps": 10}})");
}

/// Two jets of different bodies, both injected, that meet after 0.6 s.
inline Model<2> jets_in_contact() {
  Model<2> model = in_contact(jet("usf", false));
  model.injections.at(1).material = 1;
  model.gravity = Vec<2>::Zero();
  model.analysis.nsteps = 180;
  return model;
}

}  // namespace lahar::test
