"""Modified Cam-Clay and NorSand against transcriptions of their equations in Cartesian components.

usage: critical_state_soils.py SOIL_POINTS

The equations of an implicit step are solved here for all components of the stress at once, with
gradients of the yield functions by complex steps and Newton's method with differences; the laws
themselves work with invariants. 1,000 random increments of each must agree to 1e-8. Then NorSand
against the explicit scheme of CB-Geo MPM: with its two steps that gives the values frozen in its
unit test, with many, and two repairs, it tends to what the law gives.
"""
import math
import random
import subprocess
import sys

try:
    import numpy as np
except ImportError:
    print("skipped: this test needs numpy")
    sys.exit(77)

EYE = np.array([1, 1, 1, 0, 0, 0.0])
TWICE = np.array([1, 1, 1, 2, 2, 2.0])
TOLERANCE = 1e-8


def invariants(sigma):
    """p, q and the Lode angle of stresses, shape (6, ...)."""
    p = -(sigma[0] + sigma[1] + sigma[2]) / 3
    x, y, z = sigma[0] + p, sigma[1] + p, sigma[2] + p
    a, b, c = sigma[3], sigma[4], sigma[5]
    j2 = (x * x + y * y + z * z) / 2 + a * a + b * b + c * c
    j3 = x * y * z + 2 * a * b * c - x * b * b - y * c * c - z * a * a
    cosine = 1.5 * math.sqrt(3) * j3 / j2**1.5
    if not np.iscomplexobj(cosine):
        cosine = np.clip(cosine, -1, 1)
    return p, np.sqrt(3 * j2), np.arccos(cosine) / 3


def strength(m, theta):
    return m - m * m / (3 + m) * np.cos(1.5 * theta)


def elastic(k, g, strain):
    trace = strain[:3].sum()
    return (k - 2 / 3 * g) * trace * EYE + g * strain * np.array([2, 2, 2, 1, 1, 1])


def gradient(f, sigma):
    return f(sigma[:, None] + 1e-30j * np.eye(6)).imag / 1e-30


def norm(strain):
    """Of the deviator of a strain with engineering shear."""
    e = strain - strain[:3].sum() / 3 * EYE
    return math.sqrt((e * e / TWICE).sum())


def solve(residual, x):
    """Newton's method with a Jacobian of central differences; None if it does not converge."""
    r = residual(x)
    for _ in range(60):
        if not np.all(np.isfinite(r)):
            return None
        if np.abs(r).max() < 1e-13:
            return x
        jacobian = np.empty((len(x), len(x)))
        for i in range(len(x)):
            h = 1e-6 * max(abs(x[i]), 1e-3)
            dx = np.zeros(len(x))
            dx[i] = h
            jacobian[:, i] = (residual(x + dx) - residual(x - dx)) / (2 * h)
        try:
            step = np.linalg.solve(jacobian, r)
        except np.linalg.LinAlgError:
            return None
        for share in (1, 0.5, 0.25, 0.125, 0.0625, 0.03):
            new = residual(x - share * step)
            if np.all(np.isfinite(new)) and np.abs(new).max() < np.abs(r).max():
                break
        else:  # at the accuracy of the arithmetic
            return x if np.abs(r).max() < 1e-11 else None
        x, r = x - share * step, new
    return None


# --- Modified Cam-Clay ---------------------------------------------------------------------------

CLAY = ("bulk_modulus shear_modulus p q theta pc void_ratio delta_phi m_theta f_function dpvstrain "
        "dpdstrain pvstrain pdstrain chi pcd pcc subloading_r").split()


def clay_bonds(m, chi):
    if not m["bonding"]:
        return 0.0, 0.0
    return m["mc_a"] * (chi * m["s_h"]) ** m["mc_b"], m["mc_c"] * (chi * m["s_h"]) ** m["mc_d"]


def clay_yield(m, sigma, pc, chi, r, slope=None):
    pcd, pcc = clay_bonds(m, chi)
    p, q, theta = invariants(sigma)
    if slope is None:
        slope = strength(m["m"], theta) if m["three_invariants"] else m["m"]
    return (q / slope) ** 2 + (p + pcc) * (p - r * (pc + pcd + pcc))


def clay_step(m, sigma, s, strain):
    p, _, _ = invariants(sigma)
    ratio = 3 * (1 - 2 * m["poisson_ratio"]) / (2 * (1 + m["poisson_ratio"]))
    g = ratio * (1 + s["void_ratio"]) / m["kappa"] * p
    if m["bonding"]:
        g += m["m_shear"] * s["chi"] * m["s_h"]
    k = g / ratio
    trial = sigma + elastic(k, g, strain)
    s = dict(s)
    upsilon = (1 + s["void_ratio"]) / (m["lambda"] - m["kappa"])
    s["void_ratio"] = (1 + s["void_ratio"]) * math.exp(strain[:3].sum()) - 1
    r_n = s["subloading_r"]
    if clay_yield(m, trial, s["pc"], s["chi"], r_n) <= 0:
        if m["subloading"]:
            pcd, pcc = clay_bonds(m, s["chi"])
            p, q, theta = invariants(trial)
            slope = strength(m["m"], theta) if m["three_invariants"] else m["m"]
            s["subloading_r"] = (q**2 / slope**2 / (p + pcc) + p) / (s["pc"] + pcd + pcc)
        return trial, s, "elastic"
    scale = s["pc"]

    def plastic(x):
        stress, pc, chi, r = x[:6] * scale, x[6] * scale, x[7], x[8]
        slope = m["m"]
        if m["three_invariants"]:  # flow is radial: the slope is not differentiated
            slope = strength(slope, invariants(stress)[2])
        flow = x[9] / scale * gradient(lambda z: clay_yield(m, z, pc, chi, r, slope), stress)
        return stress, pc, chi, r, flow, -flow[:3].sum(), norm(flow)

    def residual(x):
        stress, pc, chi, r, flow, volume, shear = plastic(x)
        pcd, pcc = clay_bonds(m, chi)
        growth = 0.0
        if m["subloading"]:
            rate = m["subloading_u"] * (1 + (pcd + pcc) / pc)
            growth = rate * math.log(max(r, 1e-9)) * math.hypot(volume, shear)
        return np.concatenate((
            (stress - trial + elastic(k, g, flow)) / scale,
            [pc / scale - s["pc"] / scale * math.exp(upsilon * volume),
             chi - s["chi"] * (math.exp(-m["m_degradation"] * shear) if m["bonding"] else 1),
             r - r_n + growth,
             clay_yield(m, stress, pc, chi, r) / scale**2]))

    x = solve(residual, np.concatenate((trial / scale, [1, s["chi"], r_n, 0.0])))
    if x is None or x[9] < 0:
        return None
    stress, s["pc"], s["chi"], s["subloading_r"], _, volume, shear = plastic(x)
    s["pvstrain"] += volume
    s["pdstrain"] += shear
    return stress, s, "plastic"


def clay_case(rng):
    m = dict(youngs_modulus=1e7, poisson_ratio=rng.uniform(0.1, 0.4), p_ref=1e5, e_ref=1.12,
             pc0=3e5, ocr=1.5, m=rng.uniform(0.8, 1.4), kappa=0.03,
             three_invariants=rng.random() < 0.5, bonding=rng.random() < 0.4,
             subloading=rng.random() < 0.4, subloading_u=rng.uniform(5, 50), s_h=0.5, mc_a=1e5,
             mc_b=1.6, mc_c=4e4, mc_d=1.2, m_degradation=5.0, m_shear=1e7)
    m["lambda"] = rng.uniform(0.08, 0.2)
    s = dict.fromkeys(CLAY, 0.0)
    s.update(pc=rng.uniform(1e5, 4e5), void_ratio=rng.uniform(0.5, 1.5), subloading_r=1.0,
             chi=rng.uniform(0.3, 1) if m["bonding"] else 1.0)
    s["pcd"], s["pcc"] = clay_bonds(m, s["chi"])
    p = rng.uniform(0.15, 0.95) * s["pc"]
    sigma = np.array([rng.uniform(-1, 1) for _ in range(6)])
    sigma -= sigma[:3].sum() / 3 * EYE
    _, q, theta = invariants(sigma)
    slope = strength(m["m"], theta) if m["three_invariants"] else m["m"]
    limit = slope * math.sqrt((p + s["pcc"]) * (s["pc"] + s["pcd"] + s["pcc"] - p))
    sigma = sigma * (rng.uniform(0.1, 0.9999) ** 0.2 * limit / q) - p * EYE
    if m["subloading"]:
        q = invariants(sigma)[1]
        s["subloading_r"] = ((q / slope) ** 2 / (p + s["pcc"]) + p) / (
            s["pc"] + s["pcd"] + s["pcc"])
    return m, sigma, s


# --- NorSand -------------------------------------------------------------------------------------

SAND = ("M_theta M_image M_image_tc void_ratio e_image psi_image p_image p_cohesion p_dilation "
        "pdstrain").split() + [f"plastic_strain{i}" for i in range(6)]


def sand_m_tc(m):
    sine = math.sin(math.radians(m["friction_cs"]))
    return 6 * sine / (3 - sine)


def sand_chi_image(m):
    return m["chi"] / (1 - m["chi"] * m["lambda"] / sand_m_tc(m))


def sand_yield(m, sigma, e, p_i, cohesion, dilation):
    p, q, theta = invariants(sigma)
    m_tc = sand_m_tc(m)
    psi = e - m["gamma"] + m["lambda"] * math.log(p_i / m["reference_pressure"])
    m_i = strength(m_tc, theta) * (1 - sand_chi_image(m) * m["N"] * abs(psi) / m_tc)
    return q - m_i * (p + cohesion) * (1 - np.log((p + cohesion) / (p_i + cohesion + dilation)))


def sand_cap(m, e, p_i):
    """Largest p_i / p."""
    m_tc = sand_m_tc(m)
    psi = e - m["gamma"] + m["lambda"] * math.log(p_i / m["reference_pressure"])
    chi_i = sand_chi_image(m)
    return math.exp(-chi_i * psi / (m_tc - chi_i * m["N"] * abs(psi)))


def sand_step(m, sigma, s, strain):
    p, _, _ = invariants(sigma)
    k = (1 + s["void_ratio"]) / m["kappa"] * p
    if m["bond_model"]:
        k += m["m_modulus"] * (s["p_cohesion"] + s["p_dilation"])
    g = 3 * k * (1 - 2 * m["poisson_ratio"]) / (2 * (1 + m["poisson_ratio"]))
    trial = sigma + elastic(k, g, strain)
    s = dict(s)
    e = s["void_ratio"] = (1 + s["void_ratio"]) * math.exp(strain[:3].sum()) - 1
    p_trial, _, _ = invariants(trial)
    if s["p_image"] > p_trial * sand_cap(m, e, s["p_image"]):
        return None  # on the inner cap: tested by themselves
    if sand_yield(m, trial, e, s["p_image"], s["p_cohesion"], s["p_dilation"]) <= 0:
        return trial, s, "elastic"
    scale, m_tc = s["p_image"], sand_m_tc(m)

    def plastic(x):
        stress, p_i = x[:6] * scale, scale * math.exp(x[6])
        cohesion = s["p_cohesion"] * math.exp(-m["m_cohesion"] * x[7])
        dilation = s["p_dilation"] * math.exp(-m["m_dilation"] * x[7])
        flow = x[8] * gradient(lambda z: sand_yield(m, z, e, p_i, cohesion, dilation), stress)
        return stress, p_i, cohesion, dilation, flow

    def residual(x):
        stress, p_i, cohesion, dilation, flow = plastic(x)
        p, _, theta = invariants(stress)
        rate = m["hardening_modulus"] * strength(m_tc, theta) / m_tc * (p / p_i) ** 2 * (
            sand_cap(m, e, p_i) - p_i / p)
        return np.concatenate((
            (stress - trial + elastic(k, g, flow)) / scale,
            [x[6] - rate * x[7], x[7] - math.sqrt(2 / 3) * norm(flow),
             sand_yield(m, stress, e, p_i, cohesion, dilation) / scale]))

    try:
        x = solve(residual, np.concatenate((trial / scale, [0, 1e-12, 0])))
    except (ValueError, OverflowError):
        return None
    if x is None or x[8] < 0:
        return None
    stress, s["p_image"], s["p_cohesion"], s["p_dilation"], flow = plastic(x)
    s["pdstrain"] += x[7]
    for i in range(6):
        s[f"plastic_strain{i}"] -= flow[i]
    return stress, s, "plastic"


def sand_material():
    return {"poisson_ratio": 0.3, "reference_pressure": 1000, "friction_cs": 30, "N": 0.3,
            "lambda": 0.1, "kappa": 0.03, "gamma": 1.3, "chi": 3.5, "hardening_modulus": 200,
            "void_ratio_initial": 0.85, "p_image_initial": 87014.6, "bond_model": False,
            "p_cohesion_initial": 0, "p_dilation_initial": 0, "m_cohesion": 0, "m_dilation": 0,
            "m_modulus": 0}


def sand_case(rng):
    m = sand_material()
    m.update(poisson_ratio=rng.uniform(0.1, 0.3), friction_cs=rng.uniform(27, 36),
             N=rng.uniform(0, 0.4), chi=rng.uniform(2, 4), hardening_modulus=rng.uniform(50, 400),
             bond_model=rng.random() < 0.5)
    s = dict.fromkeys(SAND, 0.0)
    s.update(p_image=rng.uniform(5e4, 3e5), pdstrain=rng.uniform(0, 0.02))
    if m["bond_model"]:
        m.update(m_cohesion=20, m_dilation=5, m_modulus=10)
        s.update(p_cohesion=rng.uniform(1e3, 2e4), p_dilation=rng.uniform(1e3, 4e4))
    critical = m["gamma"] - m["lambda"] * math.log(s["p_image"] / m["reference_pressure"])
    s["void_ratio"] = critical + rng.uniform(-0.1, 0.08)
    p = s["p_image"] / rng.uniform(0.6, 0.95 * sand_cap(m, s["void_ratio"], s["p_image"]))
    sigma = np.array([rng.uniform(-1, 1) for _ in range(6)])
    sigma -= sigma[:3].sum() / 3 * EYE
    unit = sigma / invariants(sigma)[1]
    f = [sand_yield(m, q * unit - p * EYE, s["void_ratio"], s["p_image"], s["p_cohesion"],
                    s["p_dilation"]) for q in (1.0, 2.0)]
    sigma = unit * (1 - f[0]) * rng.uniform(0.2, 0.9999) ** 0.2 - p * EYE  # F is linear in q
    return m, sigma, s


# --- Comparison ----------------------------------------------------------------------------------


def ask(program, requests):
    """Stress and state after each of (law, names, material, steps, stress, state, strain)."""
    lines = []
    for law, names, m, steps, sigma, s, strain in requests:
        words = [law, str(len(m))] + [f"{k} {float(v)!r}" for k, v in m.items()] + [str(steps)]
        numbers = list(sigma) + [s[n] for n in names] + list(strain)
        lines.append(" ".join(words + [repr(float(x)) for x in numbers]))
    done = subprocess.run([program], input="\n".join(lines) + "\n", capture_output=True, text=True,
                          check=True)
    for line, request in zip(done.stdout.splitlines(), requests):
        words = line.split()
        numbers = [float(w) for w in words[1:]]
        yield words[0] == "1", np.array(numbers[:6]), dict(zip(request[1], numbers[6:]))


def compare(program, law, names, case, step, watched, count=1000):
    rng = random.Random(7)
    expected, requests, kinds = [], [], {"elastic": 0, "plastic": 0, "left out": 0}
    while len(expected) < count:
        m, sigma, s = case(rng)
        size = 10 ** rng.uniform(-4.5, -2.5)
        strain = np.array([rng.uniform(-size, size) for _ in range(6)])
        result = step(m, sigma, s, strain)
        if result is None:
            kinds["left out"] += 1
            continue
        if result[2] == "elastic" and kinds["elastic"] >= count // 4:
            continue
        kinds[result[2]] += 1
        expected.append(result[:2])
        requests.append((law, names, m, 1, sigma, s, strain))
    worst = {"stress": 0.0}
    for (converged, sigma, s), (stress, state) in zip(ask(program, requests), expected):
        assert converged, f"{law}: an increment did not converge"
        worst["stress"] = max(worst["stress"], np.abs(sigma - stress).max() / np.abs(stress).max())
        for name in watched:
            error = abs(s[name] - state[name]) / max(abs(state[name]), 1e-3)
            worst[name] = max(worst.get(name, 0), error)
    print(f"{law}: {kinds}; largest differences "
          + ", ".join(f"{k} {v:.1e}" for k, v in worst.items()))
    assert kinds["left out"] < count // 2, "too many without a solution of the smooth equations"
    assert max(worst.values()) < TOLERANCE, f"{law} differs from its transcription"


def explicit(m, n, repaired):
    """CB-Geo MPM's explicit scheme in triaxial compression to 2 % strain without volume change: the
    tangent at the beginning of a step, p_image from the yield function afterwards.

    Repaired: M_i,tc in the exponent of the hardening law (Jefferies and Been) where that scheme has
    M_tc; the tangent knows that M_i changes with p_image, so that p_image follows its law."""
    m_tc, chi_i, e = sand_m_tc(m), sand_chi_image(m), m["void_ratio_initial"]
    p, q, p_i, deviatoric = 2e5, 0.0, m["p_image_initial"], 0.0
    initial = (m["p_cohesion_initial"], m["p_dilation_initial"])
    rates = (m["m_cohesion"], m["m_dilation"])

    def bonds():
        return [a * math.exp(-b * deviatoric) for a, b in zip(initial, rates)]

    for _ in range(n):
        c = bonds()
        k = (1 + e) / m["kappa"] * p + m["m_modulus"] * sum(c)
        g = 3 * k * (1 - 2 * m["poisson_ratio"]) / (2 * (1 + m["poisson_ratio"]))
        psi = e - m["gamma"] + m["lambda"] * math.log(p_i / m["reference_pressure"])
        m_i = m_tc - chi_i * m["N"] * abs(psi)
        big_p, big_i, strain = p + c[0], p_i + sum(c), 0.02 / n
        ln = math.log(big_p / big_i)
        if (q + 3 * g * strain) / big_p - m_i + m_i * ln <= 0:
            q += 3 * g * strain
            continue
        a, b = m_i * ln, 1.0 if q > 1e-6 else 0.0
        f_i, f_c = -m_i * big_p / big_i, m_i * (ln - big_p / big_i)
        exponent = -chi_i * psi / (m_i if repaired else m_tc)
        rate = m["hardening_modulus"] * (p / p_i) ** 2 * (math.exp(exponent) - p_i / p) * p_i
        hardening = b * (f_i * rate - f_c * c[0] * rates[0] - f_i * c[1] * rates[1])
        if repaired:
            hardening += b * (ln - 1) * big_p * -chi_i * m["N"] * math.copysign(
                m["lambda"] / p_i, psi) * rate
        flow = 3 * g * b * strain / (k * a * a + 3 * g * b * b - hardening)
        p -= k * flow * a
        q += 3 * g * (strain - flow * b)
        if repaired:
            p_i += rate * flow
        else:
            p_i = (p + c[0]) * math.exp(q / ((p + c[0]) * m_i) - 1) - sum(c)
        deviatoric += flow * b
    return p, q, p_i, deviatoric, bonds()


def against_reference(program):
    plain, bonded = sand_material(), sand_material()
    bonded.update(bond_model=True, p_cohesion_initial=1e4, p_dilation_initial=2e4, m_cohesion=20,
                  m_dilation=5, m_modulus=10)
    frozen = {"plain": (-3.135822631389302e5, -0.990588326830326e5, 192117.6341206412, 0.0074378171),
              "bonded": (-3.683366868268871e5, -0.891399619172741e5, 219729.658826928, 0.0040388856)}
    for name, m in (("plain", plain), ("bonded", bonded)):
        p, q, p_i, deviatoric, _ = explicit(m, 2, False)
        for got, want in zip((-p - 2 / 3 * q, -p + q / 3, p_i, deviatoric), frozen[name]):
            assert abs(got / want - 1) < 1e-7, f"{name}: {got} is not the frozen value {want}"
        s = dict.fromkeys(SAND, 0.0)
        s.update(void_ratio=0.85, p_image=m["p_image_initial"],
                 p_cohesion=m["p_cohesion_initial"], p_dilation=m["p_dilation_initial"])
        n = 20000
        strain = np.array([-0.02, 0.01, 0.01, 0, 0, 0]) / n
        (converged, sigma, s), = ask(program, [("NorSand", SAND, m, n, -2e5 * EYE, s, strain)])
        assert converged
        p, q, p_i, deviatoric, c = explicit(m, n, True)
        pairs = {"sigma_xx": (sigma[0], -p - 2 / 3 * q), "sigma_yy": (sigma[1], -p + q / 3),
                 "p_image": (s["p_image"], p_i), "pdstrain": (s["pdstrain"], deviatoric)}
        if m["bond_model"]:
            pairs |= {"p_cohesion": (s["p_cohesion"], c[0]), "p_dilation": (s["p_dilation"], c[1])}
        worst = max(abs(a / b - 1) for a, b in pairs.values())
        as_it_is = explicit(m, n, False)
        print(f"NorSand, {name}, {n} steps: the repaired explicit scheme differs by {worst:.1e}, as "
              f"it is in p by {as_it_is[0] / p - 1:.1e}, in q by {as_it_is[1] / q - 1:.1e}, in two "
              f"steps in sigma_xx by {frozen[name][0] / sigma[0] - 1:.1e}")
        assert worst < 1e-4, f"{name}: {pairs}"


def main():
    program = sys.argv[1]
    compare(program, "ModifiedCamClay", CLAY, clay_case, clay_step,
            ["pc", "void_ratio", "chi", "subloading_r", "pvstrain", "pdstrain"])
    compare(program, "NorSand", SAND, sand_case, sand_step,
            ["void_ratio", "p_image", "p_cohesion", "p_dilation", "pdstrain"]
            + [f"plastic_strain{i}" for i in range(6)])
    against_reference(program)


if __name__ == "__main__":
    main()
