"""Water that seeps upwards carries the grains (Terzaghi's critical gradient)."""
import numpy as np

from . import GRAVITY, Number, finish, line, refine, scenario

TITLE = "Upward seepage"
SHORT = "effective stress and the critical gradient"
CHECKS = """Water flows upwards through a column of saturated soil of 1 m. It carries a part of the grains, so the
effective stress falls with the gradient of the head."""
REFERENCE = """Terzaghi (1922): the effective stress at the depth d is (1 - n) (rho_s - rho_w) g d (1 - i / i_c), and
the critical gradient i_c = (1 - n) (rho_s / rho_w - 1) = 0.99."""
FIGURE = "gradient of the effective stress over that of the head: runs (points), Terzaghi (line)"
TOLERANCE = 1e-4
GRAINS, WATER, POROSITY, CONDUCTIVITY = 2650.0, 1000.0, 0.4, 1e-3
CRITICAL = (1 - POROSITY) * (GRAINS / WATER - 1)
BUOYANT = (1 - POROSITY) * (GRAINS - WATER) * GRAVITY  # [N/m^3]
SHARES = (0.0, 0.5, 1.0)


def scenarios(cell, step):
    return {f"gradient-{share}": column(share * CRITICAL, cell, step) for share in SHARES}


def column(gradient, cell, step):
    h = 0.1 * cell
    return refine(scenario({
        "title": "Upward seepage",
        "mesh": {"structured": {"cell_size": 0.1, "extent": [h, 1.2]},
                 "boundary_conditions": {"velocity_constraints": [
                     {"nset": -1, "dir": "x", "velocity": 0},
                     {"nset": "base", "dir": "y", "phase": "skeleton", "velocity": 0},
                     {"nset": "base", "dir": "y", "phase": "liquid",
                      "velocity": CONDUCTIVITY * gradient / POROSITY}]}},
        "sets": {"nodes": {"base": {"half_space": {"point": [0, 0], "normal": [0, 1]}}}},
        "materials": [
            {"name": "soil", "type": "LinearElastic", "density": GRAINS, "youngs_modulus": 1e8, "poisson_ratio": 0.2,
             "porosity": POROSITY, "k_x": CONDUCTIVITY},
            {"name": "water", "type": "Newtonian", "density": WATER, "bulk_modulus": 1e9, "dynamic_viscosity": 1e-3}],
        "particles": [{"generator": {"type": "region", "material": ["soil", "water"], "per_cell": 2,
                                     "region": {"box": {"min": [0, 0], "max": [h, 1]}}}}],
        "external_loading_conditions": {"gravity": {"gravity": [0, -GRAVITY], "ramping_time": 0.1}},
        "analysis": {"shape_functions": "element", "end_time": 0.4},
        "post_processing": {"output_dt": 0.4},
    }, "seepage"), cell, step)


def stress(run):
    """Gradient of the effective stress over the depth, over the buoyant weight: a line through the top."""
    frame = run.frames[-1]
    depth = 1 - frame["coordinates"][:, 1]
    return -float(np.dot(depth, frame["stress_yy"]) / np.dot(depth, depth)) / BUOYANT


def measure(runs):
    found = [stress(runs[f"gradient-{share}"]) for share in SHARES]
    critical = SHARES[1] * CRITICAL * found[0] / (found[0] - found[1])
    return [Number(f"stress over that without flow, i = {share} i_c", value, 1 - share, "", 1)
            for share, value in zip(SHARES, found)] + [
        Number("critical gradient, by the first two", critical, CRITICAL)]


def draw(axes, results):
    line(axes, [0, CRITICAL], [1, 0], "Terzaghi")
    axes.plot(np.array(SHARES) * CRITICAL, [stress(run) for run in results["(dt, h)"].values()], "o", ms=5,
              label="runs")
    finish(axes, "gradient of the head", "effective stress / that without flow")
