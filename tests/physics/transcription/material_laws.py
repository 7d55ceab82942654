#!/usr/bin/env python3
"""Constitutive laws against transcriptions of their equations: `lahar material` is led along random
strain increments, and every one of them is computed again here from the state before it.

    material_laws.py LAHAR [INCREMENTS]

Derivatives are taken by a complex step, so that nothing is shared with the program but the yield
functions and potentials themselves (CB-Geo MPM, theory/material). Needs no packages.
"""
import cmath
import csv
import json
import math
import random
import subprocess
import sys
import tempfile

TOLERANCE = 1e-8  # of a stress, relative to its size; of a state variable, absolute or relative


def invariants(s):
    p = (s[0] + s[1] + s[2]) / 3
    d = [s[0] - p, s[1] - p, s[2] - p, s[3], s[4], s[5]]
    J2 = (d[0] ** 2 + d[1] ** 2 + d[2] ** 2) / 2 + d[3] ** 2 + d[4] ** 2 + d[5] ** 2
    J3 = (d[0] * d[1] * d[2] + 2 * d[3] * d[4] * d[5]
          - d[0] * d[4] ** 2 - d[1] * d[5] ** 2 - d[2] * d[3] ** 2)
    return p, d, J2, J3


def gradient(f, s):
    """df/ds by a complex step; shear components count twice, as in Voigt notation."""
    h = 1e-20 * (1 + max(abs(v) for v in s))
    return [f([v + 1j * h * (i == k) for i, v in enumerate(s)]).imag / h for k in range(6)]


def elastic(E, nu, e):
    G, lame = E / 2 / (1 + nu), E * nu / (1 + nu) / (1 - 2 * nu)
    v = lame * (e[0] + e[1] + e[2])
    return [v + 2 * G * e[0], v + 2 * G * e[1], v + 2 * G * e[2], G * e[3], G * e[4], G * e[5]]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


# --- laws: (parameters, stress, state, strain increment, dt) -> stress, state ----------------------


def linear_elastic(m, s, q, e, dt):
    return [a + b for a, b in zip(s, elastic(m["youngs_modulus"], m["poisson_ratio"], e))], q


def newtonian(m, s, q, e, dt):
    v = e[0] + e[1] + e[2]
    p, mu = q[0] - m["bulk_modulus"] * v, m["dynamic_viscosity"]
    return [-p * (k < 3) + mu / dt * (2 * e[k] - 2 / 3 * v if k < 3 else e[k])
            for k in range(6)], [p]


def bingham(m, s, q, e, dt):
    K = m["youngs_modulus"] / 3 / (1 - 2 * m["poisson_ratio"])
    p = q[0] - K * (e[0] + e[1] + e[2])
    D = [x / dt / (1 if k < 3 else 2) for k, x in enumerate(e)]
    g = math.sqrt(2 * dot(D, D) + 2 * dot(D[3:], D[3:]))
    twice = 2 * (m["tau0"] / max(g, m["critical_shear_rate"]) + m["mu"])
    return [-p * (k < 3) + twice * D[k] for k in range(6)], [p]


def von_mises(m, s, q, e, dt):
    s = linear_elastic(m, s, q, e, dt)[0]
    p, d, J2, _ = invariants(s)
    G, H, f = m["youngs_modulus"] / 2 / (1 + m["poisson_ratio"]), m["hardening_modulus"], math.sqrt(
        3 * J2)
    x = max(0, (f - m["yield_stress"] - H * q[0]) / (3 * G + H))
    return [p * (k < 3) + d[k] * (1 - 3 * G * x / f) for k in range(6)], [q[0] + x]


def drucker_prager(m, s, q, e, dt):
    s = linear_elastic(m, s, q, e, dt)[0]
    E, nu = m["youngs_modulus"], m["poisson_ratio"]
    K, G = E / 3 / (1 - 2 * nu), E / 2 / (1 + nu)
    sin, psi = math.sin(math.radians(m["friction"])), math.sin(math.radians(m["dilation"]))
    a, b = 6 * sin / (3 - sin), 6 * psi / (3 - psi)
    k = 6 * m["cohesion"] * math.cos(math.radians(m["friction"])) / (3 - sin)
    p, d, J2, _ = invariants(s)
    f = math.sqrt(3 * J2)
    x = max(0, (f + a * p - k) / (3 * G + a * b * K))
    to_p, to_f = p - K * b * x, f - 3 * G * x
    if to_p > m["tension_cutoff"]:
        to_p, to_f = m["tension_cutoff"], min(f, k - a * m["tension_cutoff"])
    return ([to_p * (i < 3) + d[i] * to_f / f for i in range(6)],
            [q[0] + (f - to_f) / 3 / G, q[1] + (p - to_p) / K])


def neo_hookean(m, s, q, e, dt):
    E, nu = m["youngs_modulus"], m["poisson_ratio"]
    mu, lame = E / 2 / (1 + nu), E * nu / (1 + nu) / (1 - 2 * nu)
    full = lambda v: [[v[0], v[3], v[5]], [v[3], v[1], v[4]], [v[5], v[4], v[2]]]
    times = lambda a, b: [[dot(r, c) for c in zip(*b)] for r in a]
    f = [[x / (1 if i == j else 2) + (i == j) for j, x in enumerate(r)]
         for i, r in enumerate(full(e))]
    b = times(times(f, full(q)), f)
    det = (b[0][0] * (b[1][1] * b[2][2] - b[1][2] ** 2) - b[0][1] ** 2 * b[2][2]
           + 2 * b[0][1] * b[1][2] * b[0][2] - b[0][2] ** 2 * b[1][1])
    J = math.sqrt(det)
    b = [b[0][0], b[1][1], b[2][2], b[0][1], b[1][2], b[0][2]]
    return [((lame * math.log(J) - mu) * (k < 3) + mu * b[k]) / J for k in range(6)], b


class MohrCoulomb:
    """Yield functions, potentials, and the cutting-plane return with a first step along the tangent."""

    def __init__(self, m, s, q):
        rad, x = math.radians, q[6]
        peak = (rad(m["friction"]), rad(m["dilation"]), m["cohesion"])
        self.strength, self.fall = peak, (0, 0)
        if m["softening"] and x > m["peak_pdstrain"]:
            rest = (rad(m["residual_friction"]), rad(m["residual_dilation"]), m["residual_cohesion"])
            range_ = m["residual_pdstrain"] - m["peak_pdstrain"]
            w = max(0, (m["residual_pdstrain"] - x) / range_)
            self.strength = tuple(r + w * (a - r) for a, r in zip(peak, rest))
            if w > 0:
                self.fall = ((rest[0] - peak[0]) / range_, (rest[2] - peak[2]) / range_)
        self.phi, self.psi, self.c = self.strength
        self.T, self.off = m["tension_cutoff"], 0.1 * m["cohesion"] * math.tan(self.psi)
        self.D = lambda e: elastic(m["youngs_modulus"], m["poisson_ratio"], e)
        self.size = 0

    @staticmethod
    def haigh(s):
        p, _, J2, J3 = invariants(s)
        r = 1.5 * cmath.sqrt(3) * J3 / J2 ** 1.5
        if abs(r) > 1:
            r = r / abs(r)
        return p, cmath.sqrt(2 * J2), cmath.acos(r) / 3

    def tension(self, s):
        p, rho, t = self.haigh(s)
        return math.sqrt(2 / 3) * rho * cmath.cos(t) + p - self.T

    def shear(self, s, phi=None):
        p, rho, t = self.haigh(s)
        f = self.phi if phi is None else phi
        a = t + math.pi / 3
        return (math.sqrt(1.5) * rho * (cmath.sin(a) / math.sqrt(3) / cmath.cos(f)
                                        + cmath.cos(a) * cmath.tan(f) / 3)
                + p * cmath.tan(f) - self.c)

    def menetrey(self, s, e, scale, off, slope):
        p, rho, t = self.haigh(s)
        c = cmath.cos(t)
        R = scale * (4 * (1 - e * e) * c * c + (2 * e - 1) ** 2) / (
            2 * (1 - e * e) * c
            + (2 * e - 1) * cmath.sqrt(4 * (1 - e * e) * c * c + 5 * e * e - 4 * e))
        return cmath.sqrt(off * off + 1.5 * (R * rho) ** 2), p * slope, R

    def potential(self, s, tensile):
        sin = math.sin(self.phi)
        if tensile:
            w, v, _ = self.menetrey(s, 0.6, 1 / 3, 0.1 * self.T, 1)
        else:
            w, v, _ = self.menetrey(s, (3 - sin) / (3 + sin), (3 - sin) / 6 / math.cos(self.phi),
                                    self.off, math.tan(self.psi))
        return w + v

    def kind(self, s, above):
        """(yields, on the tension surface, value of that yield function)"""
        ft, fs = self.tension(s).real, self.shear(s).real
        tensile = ft > above
        if ft > above and fs > above:
            n = (1 + math.sin(self.phi)) / (1 - math.sin(self.phi))
            p, rho, t = self.haigh(s)
            least = p.real + math.sqrt(2 / 3) * rho.real * math.cos(t.real - 4 * math.pi / 3)
            h = ft + (math.sqrt(1 + n * n) + n) * (
                least - self.T * n + 2 * self.c * math.sqrt(n))
            tensile = h > sys.float_info.epsilon
        return ft > above or fs > above, tensile, ft if tensile else fs

    def off_surface(self, s, tolerance):
        """The same after a step: also where that ended inside, unless the surface comes to meet it."""
        ft, fs = self.tension(s).real, self.shear(s).real
        if self.fall == (0, 0) and max(ft, fs) < -tolerance:
            return True, ft > fs, max(ft, fs)
        return self.kind(s, tolerance)

    def step(self, s, tensile):
        """Df, Dg, plastic strain per multiplier, and f:D:g with the softening."""
        f = gradient(self.tension if tensile else self.shear, s)
        g = gradient(lambda x: self.potential(x, tensile), s)
        # dg/dq: of the stress's deviator, made larger.
        p, d, J2, _ = invariants(s)
        q = math.sqrt(3 * J2)
        per_q = dot(g, d) / q
        per_phi = self.shear(s, self.phi + 1e-20j).imag / 1e-20
        softening = -(per_phi * self.fall[0] - self.fall[1]) * per_q
        Dg = self.D(g)
        return f, Dg, per_q, dot(f, Dg) + softening

    def update(self, s, e, x):
        trial = [a + b for a, b in zip(s, self.D(e))]
        p, rho, _ = self.haigh(trial)
        size = rho.real + abs(p.real) + self.c
        tolerance = 1e-12 * size
        yields, tensile, value = self.kind(trial, tolerance)
        if not yields:
            return trial, x
        now, gained = trial, 0
        if invariants(s)[2] > 0:
            begins, kind, start = self.kind(s, -1e-9 * size)
            if begins and abs(start) < 1e-9 * size:
                f, Dg, per, K = self.step(s, kind)
                k = dot(f, self.D(e)) / K
                now, gained = [a - k * b for a, b in zip(trial, Dg)], k * per
                yields, tensile, value = self.off_surface(now, tolerance)
        for _ in range(200):
            if not yields:
                return now, x + max(0, gained)  # plastic strain never falls
            f, Dg, per, K = self.step(now, tensile)
            k = value / K
            now, gained = [a - k * b for a, b in zip(now, Dg)], gained + k * per
            yields, tensile, value = self.off_surface(now, tolerance)
        raise RuntimeError("no convergence")


def mohr_coulomb(m, s, q, e, dt):
    law = MohrCoulomb(m, s, q)
    now, x = law.update(s, e, q[6])
    p, rho, t = law.haigh(now)
    return now, list(law.strength) + [math.sqrt(3) * p, rho.real, t.real, x]


CASES = [
    (linear_elastic, {"type": "LinearElastic", "youngs_modulus": 1e7, "poisson_ratio": 0.3}),
    (newtonian, {"type": "Newtonian", "bulk_modulus": 2e6, "dynamic_viscosity": 50}),
    (bingham, {"type": "Bingham", "youngs_modulus": 1e6, "poisson_ratio": 0.3, "tau0": 200,
               "mu": 3e5, "critical_shear_rate": 2e-4}),
    (von_mises, {"type": "VonMises", "youngs_modulus": 1e7, "poisson_ratio": 0.3,
                 "yield_stress": 4000, "hardening_modulus": 2e5}),
    (drucker_prager, {"type": "DruckerPrager", "youngs_modulus": 1e7, "poisson_ratio": 0.3,
                      "friction": 30, "dilation": 5, "cohesion": 2000, "tension_cutoff": 1000}),
    (neo_hookean, {"type": "NeoHookean", "youngs_modulus": 1e7, "poisson_ratio": 0.3}),
    (mohr_coulomb, {"type": "MohrCoulomb", "youngs_modulus": 1e7, "poisson_ratio": 0.3,
                    "friction": 32, "dilation": 8, "cohesion": 2000, "tension_cutoff": 500,
                    "softening": False}),
    (mohr_coulomb, {"type": "MohrCoulomb", "youngs_modulus": 1e7, "poisson_ratio": 0.2,
                    "friction": 0, "dilation": 0, "cohesion": 2500, "tension_cutoff": 1000,
                    "softening": False}),
    (mohr_coulomb, {"type": "MohrCoulomb", "youngs_modulus": 1e7, "poisson_ratio": 0.3,
                    "friction": 32, "dilation": 8, "cohesion": 4000, "tension_cutoff": 200,
                    "softening": True, "residual_friction": 25, "residual_dilation": 2,
                    "residual_cohesion": 1500, "peak_pdstrain": 1e-3,
                    "residual_pdstrain": 0.05}),
]


def compare(lahar, law, material, count, folder):
    rng = random.Random(material["type"] + str(count))
    size = 3e-4
    with open(folder + "/increments.txt", "w") as file:
        for _ in range(count):
            file.write(" ".join(repr(rng.uniform(-size, size)) for _ in range(6)) + "\n")
    with open(folder + "/driver.json", "w") as file:
        json.dump({"material": dict(material, density=1000),
                   "initial_stress": [-1e4, -1.1e4, -0.9e4, 100, 0, 0],
                   "path": [{"increments": "increments.txt", "time": 1.0 * count}]}, file)
    subprocess.run([lahar, "material", folder + "/driver.json", "--no-plot"], check=True,
                   stdout=subprocess.DEVNULL)
    with open(folder + "/driver.csv") as file:
        rows = list(csv.reader(file))
    states = [[float(x) for x in row] for row in rows[1:]]
    assert len(states) == count + 1
    worst = 0.0
    for before, after in zip(states, states[1:]):
        e = [a - b for a, b in zip(after[2:8], before[2:8])]  # rounded, as the sums are
        s, q = law(material, before[8:14], before[16:], e, 1.0)
        scale = max(abs(x) for x in before[8:14] + after[8:14])
        errors = [abs(a - b) / scale for a, b in zip(s, after[8:14])]
        errors += [abs(a - b) / max(1, abs(b)) for a, b in zip(q, after[16:])]
        worst = max(worst, max(errors))
    return worst


def main():
    lahar, count = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 1000
    failed = False
    for law, material in CASES:
        with tempfile.TemporaryDirectory() as folder:
            worst = compare(lahar, law, material, count, folder)
        good = worst < TOLERANCE
        failed |= not good
        print(f"{material['type']:15} {count} random increments: {worst:.1e}"
              f"{'' if good else '  MORE THAN ' + str(TOLERANCE)}")
    sys.exit(failed)


if __name__ == "__main__":
    main()
