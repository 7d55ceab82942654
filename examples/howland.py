#!/usr/bin/env python3
"""Compare a run of plate-with-hole.json with the exact elastic solution.

R. C. J. Howland (1930), "On the stresses in the neighbourhood of a circular hole in a strip under
tension", Phil. Trans. R. Soc. A 229, 49-86, gives the stress at the hole of an infinitely long strip.
Particles are not on the hole but up to a particle spacing inside the plate, where the stress is
already lower, so this script also computes the solution everywhere: an Airy function that leaves the
hole free of traction, fitted to the tractions on the outer edges. For a long strip it gives 3.15 and
-1.12 at the hole, within 1 % of Howland's 3.14 and -1.11. The plate of the example is only 1.6 times
as long as wide, and pulled evenly at its ends, which raises them to 3.18 and -1.15.
"""
import argparse
import json
import pathlib
import sys

import h5py
import numpy as np

HOLE = 0.5  # radius [m]
WIDTH = 5.0  # of the strip [m]
LENGTH = 8.0  # [m]
TRACTION = 100.0  # sigma_0 [Pa]

# 2 HOLE / WIDTH = 0.2: Howland's table, and what CB-Geo MPM publishes for the same discretisation.
HOWLAND = {"A xx": 3.14, "B xx": 0.0, "B yy": -1.11}
CBGEO = {"A xx": 3.13, "B xx": -0.029, "B yy": -1.08}


class Strip:
    """Stress in a strip with a hole under unit tension along x, by boundary collocation.

    Airy function: sum over even n of r^k cos(n theta), k = n, n+2, -n, 2-n (Michell), whose last two
    coefficients follow from the free hole. The others minimise the error of the tractions on a
    quarter of the outer edge.
    """

    TERMS = 24  # of the series; the tractions on the outer edges are then met to 1e-4

    def __init__(self, width, length, hole):
        self.hole, self.scale = hole, np.hypot(width, length) / 2 / hole
        s = (np.arange(200) + 0.5) / 200
        end = np.column_stack([np.full_like(s, length / 2), s * width / 2])
        side = np.column_stack([s * length / 2, np.full_like(s, width / 2)])
        at_end, at_side = self.basis(end), self.basis(side)
        rows = [at_end[0], at_end[2], at_side[1], at_side[2]]
        wanted = np.concatenate([np.ones_like(s), np.zeros(3 * len(s))])
        matrix = np.vstack(rows)
        self.coefficients = np.linalg.lstsq(matrix, wanted, rcond=None)[0]
        self.error = np.abs(matrix @ self.coefficients - wanted).max()

    def basis(self, points):
        """Stresses xx, yy, xy of every basis function; each of shape (points, functions)."""
        r = np.hypot(points[:, 0], points[:, 1]) / self.hole
        theta = np.arctan2(points[:, 1], points[:, 0])
        columns = [(2 - 2 / r**2, 2 + 2 / r**2, 0 * r)]  # r^2 - 2 ln r
        for n in range(2, 2 * self.TERMS, 2):
            free = np.array([[-n - n * n, 2 - n - n * n], [-n - 1, 1 - n]])
            for k in (n, n + 2):
                c, d = np.linalg.solve(free, [-(k - n * n), -(k - 1)])
                parts = [(1.0, k), (c, -n), (d, 2 - n)]
                norm = self.scale ** (2 - k)
                columns.append(tuple(
                    norm * sum(q * f(p) * r ** (p - 2) for q, p in parts) * trig(n * theta)
                    for f, trig in ((lambda p, n=n: p - n * n, np.cos),
                                    (lambda p: p * (p - 1), np.cos),
                                    (lambda p, n=n: n * (p - 1), np.sin))))
        rr, tt, rt = (np.column_stack(component) for component in zip(*columns))
        c, s = np.cos(theta)[:, None], np.sin(theta)[:, None]
        return (c * c * rr + s * s * tt - 2 * s * c * rt,
                s * s * rr + c * c * tt + 2 * s * c * rt,
                s * c * (rr - tt) + (c * c - s * s) * rt)

    def stress(self, points):
        """xx, yy, xy at points (N, 2), per unit of tension."""
        return np.column_stack([b @ self.coefficients for b in self.basis(np.atleast_2d(points))])


def last_frame(run):
    """The last frame of a run folder, and its time [s] (none for a single file)."""
    if run.is_file():
        return run, None
    for index in (run / "frames" / "particles.hdf.series", run / "particles.hdf.series"):
        if index.is_file():
            last = json.loads(index.read_text())["files"][-1]
            return index.parent / last["name"], last["time"]
    sys.exit(f"{run}: no frames/particles.hdf.series; is this the folder of a finished run?")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("run", type=pathlib.Path, help="run folder, or one frame (.hdf)")
    path, time = last_frame(parser.parse_args().run)
    with h5py.File(path) as file:
        points = file["VTKHDF/Points"][:, :2]
        velocity = file["VTKHDF/PointData/velocity"][:]
        stress = file["VTKHDF/PointData/stress"][:][:, [0, 1, 3]] / TRACTION

    strip = Strip(WIDTH, LENGTH, HOLE)
    a = int(np.argmin(np.hypot(points[:, 0], points[:, 1] - HOLE)))
    b = int(np.argmin(np.hypot(points[:, 0] - HOLE, points[:, 1])))
    at_hole = strip.stress([[0, HOLE], [HOLE, 0]])
    at_particle = strip.stress(points[[a, b]])
    rows = [("A xx", stress[a, 0], at_particle[0, 0], at_hole[0, 0]),
            ("B xx", stress[b, 0], at_particle[1, 0], at_hole[1, 0]),
            ("B yy", stress[b, 1], at_particle[1, 1], at_hole[1, 1])]

    print("Stress / sigma_0 at the hole: A above it, across the load; B beside it, along the load")
    if time is not None:
        print(f"(t = {time:.3g} s, fastest particle {np.abs(velocity).max():.1e} m/s)")
    print()
    print("           nearest particle      |       at the hole itself")
    print("          Lahar   exact   CB-Geo |  exact   Howland (long strip)")
    for name, value, there, hole in rows:
        print(f"  {name}   {value:6.3f}  {there:6.3f}   {CBGEO[name]:6.3f} |"
              f" {hole:6.3f}   {HOWLAND[name]:7.2f}")
    print()
    for label, i in (("A", a), ("B", b)):
        print(f"  nearest particle to {label}: ({points[i, 0]:.4f}, {points[i, 1]:.4f}) m, "
              f"{np.hypot(*points[i]) - HOLE:.4f} m from the hole")
    error = stress - strip.stress(points)
    norm = np.sqrt((error**2).sum() / (strip.stress(points)**2).sum())
    print(f"  all {len(points):,} particles, all components: {100 * norm:.1f} % from the exact "
          "solution (root mean square)")
    print(f"  exact solution: tractions on the outer edges met to {strip.error:.0e} sigma_0")


if __name__ == "__main__":
    main()
