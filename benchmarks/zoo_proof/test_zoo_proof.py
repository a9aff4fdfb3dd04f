"""Kept for proof: worked numbers and limits of SPECIFICATION.md, and what holds for every machine drawn.

Run by name: ``pytest benchmarks/zoo_proof``.
"""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from diagnosis.proof.zoo.families.proof import load_proof_family
from models.assembly.gearbox import load_gearbox
from models.formulas.oil import pressure_viscosity_gold

A, B = load_proof_family("proof_a"), load_proof_family("proof_b")

from zoo_proof import laws_a, laws_b, parts, proof_a, proof_b, without_geometry  # noqa: E402

BOX = parts.Box(load_gearbox("fzg"))
CASES = [(family, machine) for family in (A, B) for machine in family.machines]
SEEDS = range(25)
SIXTY = np.array([60.0])
V = 8.3 / BOX.pair.r_w[0]  # rad/s of the pinion


def drawn(family, machine, seed):
    return family.draw(load_gearbox(machine), np.random.default_rng([seed, 101 if family is A else 102]))


def service(machine, n=0.4, T=0.4):
    """Inputs at fractions of the maxima."""
    gearbox = load_gearbox(machine)
    if gearbox.is_parametric:
        d = gearbox.definition
        given = {name: signal.default for name, signal in d.inputs.items()}
        if "speed" in given:
            given |= {"speed": 2.0 * n * d.operation.speed_rpm, "torque": 2.0 * T * d.operation.torque_Nm}
        return given | ({"heater_power": 50.0} if "heater_power" in given else {})
    box = parts.Box(gearbox)
    return box.at_service() | {"speed": n * box.max_speed, "torque": T * box.max_torque}


# ---------------------------------------------------------------------- sizes and worked numbers


def test_sizes_of_fzg():
    assert [round(BOX.C_part(part)) for part in BOX.parts] == pytest.approx([7060, 8625], rel=1e-3)
    assert pytest.approx(0.9e-3 * 848.0 * 2016, rel=1e-3) == BOX.C_oil  # 1568 is printed
    assert BOX.C_bearing("bearing_1") == pytest.approx(349, abs=0.5)
    assert [BOX.C_shaft(s) for s in BOX.shaft_of] == pytest.approx([367, 779], rel=2e-3)
    assert [BOX.C_gear(i) for i in (0, 1)] == pytest.approx([184, 346], rel=5e-3)
    assert BOX.f_im == pytest.approx((0.217, 0.299), abs=1e-3)
    assert pytest.approx(0.249, abs=5e-4) == BOX.L
    assert 3600 * (BOX.A_in / 6) ** 1.5 + 0.01 * BOX.C_oil == pytest.approx(30, abs=0.6)


def moment(n, T, **p):
    ones = np.ones(1)
    given = {"speed": n * ones, "torque": T * ones, "T_ambient": 27.0 * ones, "air_speed": 2.0 * ones}
    Ts = dict.fromkeys(("gear", "oil"), SIXTY)
    return parts.Moment(hours=0 * ones, since_start=0 * ones, inputs=given, T=Ts, p={k: v * ones for k, v in p.items()})


def test_splash_of_fzg():
    m = moment(V / parts.RPM, 0.0, phi=0.25)
    assert BOX.splash(m)[0] * 60000 == pytest.approx(6.0, abs=0.05)
    assert (BOX.rho_cp(SIXTY) * BOX.splash(m))[0] == pytest.approx(171, abs=1.5)


@pytest.mark.parametrize(("n", "expected"), [(261, 133), (2166, 782), (5214, 1352)])
def test_mesh_of_a(n, expected):
    law = BOX.mesh(laws_a.in_mesh, lambda m: m.T["gear"])
    assert law(moment(n, 302.0))[0] == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize(("n", "T", "expected"), [(261, 60, 100), (2166, 60, 442), (5214, 60, 689)])
def test_mesh_of_b(n, T, expected):
    law = BOX.mesh(laws_b.in_mesh, lambda m: 0 * m.hours + T)
    assert law(moment(n, 302.0, mu_b=0.09))[0] == pytest.approx(expected, rel=1e-2)


def test_no_load_no_mesh_loss():
    for law in (laws_a.in_mesh, laws_b.in_mesh):
        assert BOX.mesh(law, lambda m: m.T["gear"])(moment(2166.0, 0.0, mu_b=0.09))[0] == 0.0
        assert BOX.mesh(law, lambda m: m.T["gear"])(moment(0.0, 302.0, mu_b=0.09))[0] == 0.0


def test_friction_of_a():
    mu = laws_a.friction_benedict_kelley(np.array([160.0]), 13.07, np.array([2.0]), np.array([8.0]), 0.1655)
    assert mu[0] == pytest.approx(0.0514, abs=5e-5)


def test_friction_of_b():
    at = (1.2, np.array([13.07]), np.array([4.0]), 0.008, 0.1655)
    assert laws_b.friction_fluid(np.array([0.5]), *at)[0] == pytest.approx(0.0217, abs=5e-5)
    assert laws_b.friction_fluid(np.array([0.1]), *at)[0] == pytest.approx(0.0138, abs=5e-5)
    assert laws_b.friction_fluid(np.array([0.0]), *at)[0] == pytest.approx(0.0, abs=1e-6)
    share = laws_b.share_of_film(np.array([0.1, 0.5, 1.0, 1.99999, 3.0]))
    assert share == pytest.approx([0.272, 0.673, 0.883, 1.0, 1.0], abs=1e-3)


def test_film_of_b():
    omega, t = 1500 * parts.RPM, BOX.pair.T1C
    V_e = 0.5 * sum(BOX.pair.speeds(t, omega))
    alpha = pressure_viscosity_gold(BOX.nu(SIXTY), 9.904, 0.139)
    eta = 1e-3 * BOX.eta_mPas(SIXTY)
    h = laws_b.film(200 / BOX.pair.r_b[0], BOX.pair.rho_red_C, BOX.pair.b, BOX.E_red, eta, alpha, V_e)
    assert 1e6 * h[0] == pytest.approx(0.140, abs=1e-3)


@pytest.mark.parametrize(("v", "expected"), [(8.3, 2.9), (20.0, 40.0)])
def test_churning_of_a(v, expected):
    n = v / BOX.pair.r_w[0] / parts.RPM
    total = sum(
        laws_a.churning(BOX.nu60, n / (1, BOX.pair.u)[i], 2e3 * BOX.pair.r_a[i], 14.0, 4.5, BOX.e[i] / BOX.pair.r_a[i])
        for i in (0, 1)
    )
    assert 0.12 * total == pytest.approx(expected, rel=0.02)


def churned(v, T):
    nu, rho, found = BOX.nu(np.array([T])), BOX.rho(np.array([T])), []
    for i in (0, 1):
        omega = v / BOX.pair.r_w[i]
        r = BOX.pair.r_a[i]
        found.append(BOX.f_im[i] * laws_b.churned_disc(nu, rho, omega, r)[0] * omega)
        found.append(laws_b.thrown(rho, omega, r, BOX.e[i], BOX.pair.m_n, BOX.pair.b)[0])
    return found


def test_churning_of_b():
    assert churned(8.3, 60.0) == pytest.approx([3.1, 6.2, 6.7, 8.1], abs=0.06)
    for v, T, expected in ((8.3, 60, 16.8), (20, 60, 126.9), (8.3, 30, 23.0), (8.3, 90, 14.2)):
        assert 0.7 * sum(churned(v, T)) == pytest.approx(expected, rel=0.01)


def test_bearings():
    def watt(torque, n):
        return float(np.sum(torque)) * n * parts.RPM

    M = laws_a.bearing_torque(15.41, 2165.7, 4463.0, 60.0)
    assert pytest.approx((67.2, 80.3), abs=0.1) == M
    assert watt(1e-3 * np.array(M), 2165.7) == pytest.approx(33.5, abs=0.06)
    assert watt(1e-3 * np.array(laws_a.bearing_torque(15.41, 5214.0, 4463.0, 60.0)), 5214) == pytest.approx(
        109.8, abs=0.5
    )
    for n, F, expected in ((2165.7, 4463, 33.6), (2165.7, 1390, 22.8), (5214, 4463, 125), (261, 4463, 1.4)):
        assert watt(laws_b.bearing_torque(15.41, n, F, 60.0), n) == pytest.approx(expected, rel=0.012)


def test_seals():
    assert laws_a.seal_torque(24.0) == pytest.approx(0.0897, abs=5e-5)
    assert laws_a.seal_torque(24.0) * 2166 * parts.RPM == pytest.approx(20.3, abs=0.05)
    for d, n, expected in ((24.0, 2166, 14.3), (54.0, 2166 / 1.5, 24.5)):
        assert laws_b.seal_torque(np.ones(1), n, d)[0] * n * parts.RPM == pytest.approx(expected, abs=0.06)
    assert laws_b.seal_torque(np.ones(1), 0.0, 24.0)[0] == pytest.approx(3e-3 * 24 * 0.02 ** (1 / 3))


def test_windage():
    n = 20 / BOX.pair.r_w[0] / parts.RPM
    eta = BOX.eta_mPas(SIXTY)
    both = [laws_a.windage(n / (1, BOX.pair.u)[i], BOX.pair.r_a[i], BOX.pair.b, eta)[0] for i in (0, 1)]
    assert both == pytest.approx([4.5, 6.7], abs=0.06)


def test_heat_transfer():
    oil = BOX.nu(SIXTY), BOX.k(SIXTY), BOX.prandtl(SIXTY)
    assert laws_a.disc(V, *oil)[0] == pytest.approx(1807, rel=5e-3)
    assert laws_a.disc(V / 1.5, *oil)[0] == pytest.approx(1475, rel=5e-3)
    assert laws_b.cylinder(V, 2 * BOX.pair.r_a[0], *oil)[0] == pytest.approx(1664, rel=5e-3)
    assert laws_a.across(np.array(2.0), 0.215) == pytest.approx(10.9, abs=0.15)
    assert laws_a.rising(np.array(60.0), np.array(27.0), 0.215) == pytest.approx(5.1, abs=0.06)
    assert laws_b.rising(np.array(60.0), np.array(27.0)) == pytest.approx(4.2, abs=0.01)
    assert laws_b.wind(np.array(0.0)) == 0.0
    assert laws_b.wind(np.array(2.0)) == pytest.approx(8.8 * 2 / 2.1)
    assert parts.shaft_in_air(np.array(V), 0.024) == pytest.approx(33, abs=0.3)


def test_losses_without_geometry_at_the_reference():
    one = np.ones(1)
    assert without_geometry.bearing_free_loss(one, one, 0.5)[0] == 1.0
    assert without_geometry.loss_by_load(one, one, one)[0] == 1.0


# ---------------------------------------------------------------------- every machine


@pytest.mark.parametrize(("family", "machine"), CASES, ids=lambda x: getattr(x, "name", x))
def test_structure(family, machine):
    for seed in SEEDS:
        plant = drawn(family, machine, seed)
        bodies, boundaries = {b.name for b in plant.bodies}, {b.name for b in plant.boundaries}
        assert len(bodies) == len(plant.bodies)
        assert max(Counter(p.name for p in plant.paths).values()) == 1
        for source in plant.sources:
            assert sum(source.spread.values()) == pytest.approx(1.0)
            assert set(source.spread) <= bodies
            assert min(source.spread.values()) >= 0
        for probe in plant.probes:
            assert sum(probe.mix.values()) == pytest.approx(1.0)
            assert set(probe.mix) <= bodies | boundaries
            assert min(probe.mix.values()) >= 0
        reached = set(boundaries)
        for _ in bodies:
            for path in plant.paths:
                reached |= set(path.ends) if reached & set(path.ends) else set()
        assert reached == bodies | boundaries
        assert set(plant.spread) <= set(plant.parameters)


@pytest.mark.parametrize(("family", "machine"), CASES, ids=lambda x: getattr(x, "name", x))
def test_nominal_names(family, machine):
    network = load_gearbox(machine).network()
    nodes, links = {n.name for n in network.nodes}, {x.name for x in network.links}
    for seed in SEEDS:
        plant = drawn(family, machine, seed)
        assert {b.part_of for b in (*plant.bodies, *plant.boundaries)} <= nodes
        assert {p.part_of for p in plant.paths} <= nodes | links | {""}
        assert {p.channel for p in plant.probes} <= nodes
        assert set(plant.inputs) == set(network.inputs)


@pytest.mark.parametrize(("family", "machine"), CASES, ids=lambda x: getattr(x, "name", x))
def test_laws_are_positive_and_finite(family, machine):
    points = [
        (service(machine, n, T), warm)
        for n, T in ((0.0, 0.0), (0.0, 0.4), (0.4, 0.0), (0.02, 0.4), (0.4, 0.4), (0.9, 0.2))
        for warm in (-10.0, 20.0, 60.0, 120.0, 190.0)
    ]
    given = {name: np.array([at[name] for at, _ in points]) for name in points[0][0]}
    warm = np.array([T for _, T in points])
    for seed in SEEDS:
        plant = drawn(family, machine, seed)
        m = parts.moment_of(plant, given, warm)
        for path in plant.paths:
            G = path.conductance(m)
            assert G.min() > 0.0, path.name
            assert G.max() < 1e5, path.name
        for body in plant.bodies:
            assert np.min(body.capacity(m)) > 0.0, body.name
        for source in plant.sources:
            P = source.power(m)
            assert P.min() >= 0.0, source.name
            assert P.max() < 1e6, source.name


def steady(plant, given, T_start=50.0):
    """Temperatures at rest by fixed point iteration of the linear balance."""
    names = [b.name for b in plant.bodies]
    at = {name: k for k, name in enumerate(names)}
    T = dict.fromkeys(names, T_start)
    for _ in range(200):
        m = parts.moment_of(plant, given, T)
        K, q = np.zeros((len(at), len(at))), np.zeros(len(at))
        for path in plant.paths:
            G = float(path.conductance(m)[0])
            for a, b in (path.ends, path.ends[::-1]):
                if a in at:
                    K[at[a], at[a]] += G
                    if b in at:
                        K[at[a], at[b]] -= G
                    else:
                        q[at[a]] += G * float(m.T[b][0])
        for source in plant.sources:
            for body, share in source.spread.items():
                q[at[body]] += share * float(np.broadcast_to(source.power(m), (1,))[0])
        new = np.linalg.solve(K, q)
        moved = max(abs(new[at[n]] - T[n]) for n in names)
        T = {n: 0.5 * T[n] + 0.5 * float(new[at[n]]) for n in names}
        if moved < 1e-6:
            break
    return T, parts.moment_of(plant, given, T)


@pytest.mark.parametrize(("family", "machine"), CASES, ids=lambda x: getattr(x, "name", x))
def test_steady_heat_leaves_through_boundaries(family, machine):
    for seed in range(5):
        plant = drawn(family, machine, seed)
        T, m = steady(plant, service(machine, 0.3, 0.2))
        made = sum(float(s.power(m)[0]) for s in plant.sources)
        shed = 0.0
        for path in plant.paths:
            for a, b in (path.ends, path.ends[::-1]):
                if a in T and b not in T:
                    shed += float(path.conductance(m)[0]) * (T[a] - float(m.T[b][0]))
        assert made == pytest.approx(shed, rel=1e-6)


# Oil (mean of layers), lower housing, bearings of shaft 1, shaft 1, pinion, wheel; mesh, churning, bearings, seals.
TABLE = {
    (261, 94): ((37, 36, 36, 43, 45, 40, 41, 0, 5, 7), (35, 34, 34, 41, 42, 37, 31, 0, 5, 3)),
    (2166, 1): ((47, 46, 47, 51, 48, 47, 1, 5, 63, 50), (47, 47, 48, 49, 48, 48, 1, 19, 51, 45)),
    (2166, 94): ((80, 77, 78, 92, 94, 86, 235, 2, 51, 38), (76, 73, 75, 83, 83, 79, 177, 15, 61, 33)),
    (3914, 94): ((107, 103, 105, 123, 123, 115, 369, 5, 91, 59), (112, 109, 112, 120, 120, 116, 336, 50, 100, 55)),
}


@pytest.fixture
def plain(monkeypatch):
    """Nothing split, no strength, every parameter at its value."""
    monkeypatch.setattr(parts.Draft, "chance", lambda *_: False)
    monkeypatch.setattr(parts, "FARTHEST_SD", 0.0)
    for module in (proof_a, proof_b):
        monkeypatch.setattr(module, "STRENGTH", 1e-3)


@pytest.mark.parametrize(("family", "column"), [(A, 0), (B, 1)], ids=["a", "b"])
@pytest.mark.usefixtures("plain")
def test_steady_state_of_a_plain_plant(family, column):
    plant = drawn(family, "fzg", 0)
    lower = next(b.name for b in plant.bodies if b.part_of == "housing_lower")
    shaft, pinion = ("shaft_1", "pinion") if column == 0 else ("core_1", "rim_1")
    wheel = "wheel" if column == 0 else "rim_2"
    for (n, torque), expected in TABLE.items():
        T, m = steady(plant, {"speed": n, "torque": torque, "T_ambient": 27.0, "air_speed": 2.0})
        P = {s.name: float(s.power(m)[0]) for s in plant.sources}
        oil = T["sump"] if column == 0 else 0.5 * (T["oil_cold"] + T["oil_hot"])
        found = [oil, T[lower], 0.5 * (T["bearing_1"] + T["bearing_2"]), T[shaft], T[pinion], T[wheel]]
        losses = [P["mesh"], P["churning"], sum(P[f"bearing_{k}"] for k in (1, 2, 3, 4)), P["seal_1"] + P["seal_2"]]
        print(n, torque, np.round([*found, *losses], 1), expected[column])
        assert found == pytest.approx(expected[column][:6], abs=3.0)
        assert losses == pytest.approx(expected[column][6:], rel=0.05, abs=1.0)
