"""A thick-walled tube under internal pressure (Lame)."""
import numpy as np

from . import Number, finish, line, refine, scenario

TITLE = "Thick-walled tube"
SHORT = "bodies of revolution, quasi-static steps"
CHECKS = """A tube of radii 1 m and 2 m, held along its axis, has an internal pressure. The model is a body of
revolution; the pressure acts as forces at the nodes of the inner surface. Stresses are means over cells, because
cells have linear functions."""
REFERENCE = """Lame: the radial stress p / 3 (1 - 4 / r^2), the hoop stress p / 3 (1 + 4 / r^2), and at the inner
surface the displacement (1 + nu) p / (3 E) (5 - 2 nu). The scale of stresses is p."""
FIGURE = "stresses over the radius: means over cells (points), Lame (lines)"
PRESSURE, MODULUS, POISSON, CELL = 10.0, 1e6, 0.3, 1 / 8


def scenarios(cell, step):
    h = CELL * cell
    force = PRESSURE * 2 * np.pi * 1.0 * h  # of a node and the length h
    ends = {"union": [{"box": {"min": [1 - h / 4, y - h / 4], "max": [1 + h / 4, y + h / 4]}} for y in (0, 2 * h)]}
    case = refine(scenario({
        "title": "Thick-walled tube",
        "mesh": {"structured": {"cell_size": CELL, "extent": [2.25, 2 * h]},
                 "boundary_conditions": {"velocity_constraints": [{"nset": -1, "dir": "y", "velocity": 0}]}},
        "sets": {"nodes": {"middle": {"box": {"min": [1 - h / 4, h * 3 / 4], "max": [1 + h / 4, h * 5 / 4]}},
                           "ends": ends}},
        "materials": [{"name": "tube", "type": "LinearElastic", "density": 1000, "youngs_modulus": MODULUS,
                       "poisson_ratio": POISSON}],
        "particles": [{"generator": {"type": "region", "per_cell": 2, "material": "tube",
                                     "region": {"box": {"min": [1, 0], "max": [2, 2 * h]}}}}],
        "external_loading_conditions": {"concentrated_nodal_forces": [
            {"nset": "middle", "dir": "x", "force": force}, {"nset": "ends", "dir": "x", "force": force / 2}]},
        "analysis": {"plane": "axisymmetric", "mpm_scheme": "newmark", "dt": 1.0, "nsteps": 1,
                     "shape_functions": "element",
                     "scheme_settings": {"quasi_static": True, "relative_residual_tolerance": 1e-10}},
        "post_processing": {"output_steps": 1},
    }, "thick-tube"), cell, step)
    return {"tube": case}


def lame(r):
    """Radial and hoop stress over the pressure."""
    return (1 - 4 / r**2) / 3, (1 + 4 / r**2) / 3


def means(run):
    """Means over cells: radius, radial and hoop stress over the pressure, and those of Lame."""
    frame = run.frames[-1]
    r, V = frame["coordinates"][:, 0], frame["volume"]
    size = run.scenario["mesh"]["structured"]["cell_size"]
    cell = np.floor((r - 1) / (size[0] if isinstance(size, list) else size)).astype(int)
    values = np.array([r, frame["stress_xx"] / PRESSURE, frame["stress_zz"] / PRESSURE, *lame(r)])
    return np.array([np.bincount(cell, weights=V * value) for value in values]) / np.bincount(cell, weights=V)


def measure(runs):
    frame = runs["tube"].frames[-1]
    _, radial, hoop, exact_radial, exact_hoop = means(runs["tube"])
    r = frame["coordinates"][:, 0]
    inner = np.linalg.lstsq(np.array([r, 1 / r]).T, frame["displacement_x"], rcond=None)[0].sum()  # a r + b / r
    exact = (1 + POISSON) * PRESSURE / 3 / MODULUS * (5 - 2 * POISSON)
    return [
        Number("displacement of the inner surface", 1e6 * inner, 1e6 * exact, "micrometre"),
        Number("largest deviation of the radial stress over p", np.abs(radial - exact_radial).max(), 0, "", 1),
        Number("largest deviation of the hoop stress over p", np.abs(hoop - exact_hoop).max(), 0, "", 1),
    ]


def draw(axes, results):
    r = np.linspace(1, 2, 200)
    for values in lame(r):
        axes.plot(r, values, color="black", lw=1)
    radius, radial, hoop, _, _ = means(results["(dt, h)"]["tube"])
    axes.plot(radius, radial, "o", ms=5, label="radial")
    axes.plot(radius, hoop, "s", ms=5, label="hoop")
    finish(axes, "radius [m]", "stress / p")
