"""The load of a strip footing on clay (Prandtl)."""
import numpy as np

from . import Number, finish, refine, scenario

TITLE = "Strip footing"
SHORT = "the load at which clay fails, locking"
CHECKS = """Quasi-static steps press a rough footing, 2 m wide, into undrained clay until the ground fails. The model has
one half of it. Clay that keeps its volume locks without B-bar."""
REFERENCE = "Prandtl (1920): q = (2 + pi) s_u."
FIGURE = "load over settlement with B-bar, and without it"
SAYS = """Half the cell halves the error: the footing acts about half a cell wider than it is. Without B-bar the clay
is much too strong, and nothing else in the run says so."""
ASIDE = ["load at the end over Prandtl's, without B-bar"]
TOLERANCE = 1e-3
STRENGTH, SETTLEMENT, WIDTH = 2e4, 0.002, 1.0
PRANDTL = (2 + np.pi) * STRENGTH * WIDTH


def scenarios(cell, step):
    return {name: footing(cell, step, b_bar) for name, b_bar in (("b-bar", True), ("locked", False))}


def footing(cell, step, b_bar):
    h = 0.25 * cell
    return refine(scenario({
        "title": "A strip footing on clay",
        "mesh": {"structured": {"cell_size": 0.25, "extent": [5, 4]},
                 "boundary_conditions": {"velocity_constraints": [
                     {"nset": "sides", "dir": "x", "velocity": 0},
                     {"nset": "base", "dir": "x", "velocity": 0},
                     {"nset": "base", "dir": "y", "velocity": 0},
                     {"nset": "footing", "dir": "x", "velocity": 0},
                     {"nset": "footing", "dir": "y", "velocity": -SETTLEMENT}]}},
        "sets": {"nodes": {
            "sides": {"union": [{"half_space": {"point": [0, 0], "normal": [1, 0]}},
                                {"half_space": {"point": [5, 0], "normal": [-1, 0]}}]},
            "base": {"half_space": {"point": [0, 0], "normal": [0, 1]}},
            "footing": {"box": {"min": [0, 3.25], "max": [WIDTH + h, 4]}}}},
        "particles": [
            {"generator": {"type": "region", "region": {"box": {"min": [0, 0], "max": [5, 3]}},
                           "per_cell": 2, "material": "clay"}},
            {"generator": {"type": "region", "region": {"box": {"min": [0, 3], "max": [WIDTH, 3.75]}},
                           "per_cell": 2, "material": "concrete"}}],
        "materials": [
            {"name": "clay", "type": "MohrCoulomb", "density": 2000, "youngs_modulus": 2.9e8, "poisson_ratio": 0.45,
             "friction": 0, "dilation": 0, "cohesion": STRENGTH, "tension_cutoff": 1e9},
            {"name": "concrete", "type": "LinearElastic", "density": 2000, "youngs_modulus": 2.9e10,
             "poisson_ratio": 0.2}],
        "analysis": {"mpm_scheme": "newmark", "scheme_settings": {"quasi_static": True}, "shape_functions": "element",
                     "b_bar": b_bar, "dt": 0.05, "nsteps": 20},
        "post_processing": {"output_steps": 20, "history_steps": 1},
    }, "footing"), cell, step)


def load(run):
    """Settlement and load over Prandtl's: the work of what moves the footing, over its way."""
    history = run.history
    settlement = SETTLEMENT * history.time.to_numpy()
    force = np.diff(history.external) / np.diff(settlement)
    return (settlement[1:] + settlement[:-1]) / 2, force / PRANDTL


def measure(runs):
    return [Number("load at the end over Prandtl's, with B-bar", load(runs["b-bar"])[1][-1], 1),
            Number("load at the end over Prandtl's, without B-bar", load(runs["locked"])[1][-1], 1)]


def draw(axes, results):
    for variant, cell in (("(dt, h)", "h"), ("(dt/2, h/2)", "h/2")):
        for name, label in (("b-bar", "B-bar"), ("locked", "without")):
            settlement, force = load(results[variant][name])
            axes.plot(1e3 * settlement, force, lw=1, ls="-" if name == "b-bar" else "--", label=f"{label}, {cell}")
    axes.axhline(1, color="black", lw=1)
    finish(axes, "settlement [mm]", "load / Prandtl's")
