/// \file Particles without cohesion that fly into a corner, where far too many come to be in few
/// patches.
#pragma once

#include "tests/runtime/step/models.h"

namespace lahar::test {

/// `source`: another generator; "hatch" is a set of cells above the corner.
inline Model<2> falling_dust(const std::string& source = "") {
  return model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.05, "extent": [1, 1]},
             "boundary_conditions": {"velocity_constraints": [
               {"nset": "floor", "dir": "y", "velocity": 0},
               {"nset": "wall", "dir": "x", "velocity": 0}]}},
    "sets": {"nodes": {"floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}},
                       "wall": {"half_space": {"point": [0, 0], "normal": [1, 0]}}},
             "cells": {"hatch": {"box": {"min": [0.1, 0.6], "max": [0.3, 0.7]}}}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 10,
                   "poisson_ratio": 0}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "velocity": [-0.1, -1],
                                 "material": 0,
                                 "region": {"box": {"min": [0, 0], "max": [0.8, 1]}}}})" +
                          source + R"(],
    "analysis": {"dt": 0.01, "nsteps": 100, "patch_particles": 36, "split_steps": 7,
                 "watchdog": {"action": "off"}},
    "post_processing": {"output_steps": 20, "history_steps": 8}})");
}

/// More dust from a hatch, as fast as what falls past it, once that is by.
inline Model<2> falling_dust_with_source() {
  return falling_dust(R"(, {"generator": {"type": "inject", "cset": "hatch", "material": 0,
    "nparticles_per_dir": 3, "velocity": [-0.1, -1], "duration": [0.3, 10]}})");
}

inline Model<3> falling_dust_3d() {
  return model_of_text<3>(R"({
    "mesh": {"structured": {"cell_size": 0.1, "extent": [1, 0.6, 1]},
             "boundary_conditions": {"velocity_constraints": [
               {"nset": "floor", "dir": "z", "velocity": 0},
               {"nset": "wall", "dir": "x", "velocity": 0}]}},
    "sets": {"nodes": {"floor": {"half_space": {"point": [0, 0, 0], "normal": [0, 0, 1]}},
                       "wall": {"half_space": {"point": [0, 0, 0], "normal": [1, 0, 0]}}}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 10,
                   "poisson_ratio": 0}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "velocity": [-0.1, 0, -1],
                                 "material": 0,
                                 "region": {"box": {"min": [0, 0, 0], "max": [0.8, 0.6, 1]}}}}],
    "analysis": {"dt": 0.01, "nsteps": 100, "patch_particles": 100, "split_steps": 7,
                 "watchdog": {"action": "off"}},
    "post_processing": {"output_steps": 20, "history_steps": 8}})");
}

}  // namespace lahar::test
