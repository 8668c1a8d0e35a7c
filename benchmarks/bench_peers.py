"""Other people's programs beside femgear, in one run: ROSS (`pip install "femgear[bench]"`), harmonicbalance.

A row of a program that is not installed is skipped, and pytest says which (`-rs`).
"""

from time import process_time

import numpy as np
import pytest

STIFFNESS = "Peers: mesh stiffness over one mesh period, 36 and 24 teeth, module 1.5 mm, width 25 mm"
DUFFING = "Peers: parametric Duffing oscillator, 12 harmonics, from one start"
ROTOR = "Peers: linear rotor of 42 dof with two discs (ROSS's matrices), 4 harmonics"
COUNT, OMEGA = 12, 1.1
SPEED, FORCES, TORSION = 300.0, {1: 10.0, 2: 5.0, 4: 2.0}, 1e3
"""Of the rotor: speed [rad/s], forces turning with its multiples [N], spring against its twist [N m/rad]."""


@pytest.fixture(scope="module")
def ross():
    return pytest.importorskip("ross", reason='ROSS is not installed: pip install "femgear[bench]"')


def row(benchmark, title, note):
    benchmark.extra_info.update(title=title, note=note)


@pytest.mark.benchmark(group=STIFFNESS, timer=process_time)
def test_six_meshes(benchmark):
    from bench_contact import Planets

    from femgear.contact.cycle import walk_mesh_cycle

    def stiffness():
        new = Planets()
        return walk_mesh_cycle(new.gears(3), new.bodies, sun_torque=100.0, positions=64).stiffness[:3]

    k = 1e-6 * benchmark.pedantic(stiffness, rounds=3, warmup_rounds=1)
    note = f"64 positions, grids by Gmsh included; sun-planet at 100 N m: mean {k.mean():.0f} N/um, {span(k)}"
    row(benchmark, "six meshes of a planetary set, finite elements and contact (femgear)", note)


@pytest.mark.benchmark(group=STIFFNESS, timer=process_time)
def test_mesh_of_ross(benchmark, ross):
    steel = ross.Material("steel", rho=7850, E=206e9, Poisson=0.3)
    common = {"n": 0, "material": steel, "width": 25e-3, "module": 1.5e-3, "pr_angle": np.radians(20.0)}

    def stiffness():
        pair = (
            ross.GearElementTVMS(**common, n_teeth=teeth, bore_diameter=bore)
            for teeth, bore in ((36, 24e-3), (24, 18e-3))
        )
        return np.asarray(ross.Mesh(*pair).get_stiffness_for_mesh_period()[1])

    k = 1e-6 * benchmark.pedantic(stiffness, rounds=3, warmup_rounds=1)
    note = f"{len(k)} positions, potential energy of beams; mean {k.mean():.0f} N/um, {span(k)}"
    row(benchmark, f"one external mesh (ROSS {ross.__version__})", note)


def span(k):
    return f"{k.min():.0f} to {k.max():.0f}"


def duffing():
    """``x'' + 0.1 x' + (1 + 0.2 cos w t) x + 0.3 x^3 = 0.2 cos w t``, solved by femgear: its lines."""
    from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
    from femgear.system.force_laws import GearMeshes, PolynomialSprings
    from femgear.system.fourier import FourierSeries
    from validation.nonlinear import oscillator

    mesh = GearMeshes([0], FourierSeries([[1.0, 0.2]]), separates=False)
    problem = oscillator(mesh, PolynomialSprings([0], [[0.0, 0.0, 0.3]]), damping=0.1, forces=[(0.2, (1,))])
    start = np.zeros((1, COUNT + 1), complex)
    start[0, 1] = 1.0
    options = {"harmonics": COUNT, "start": start, "stability": False}
    return solve_harmonic_balance(problem, OMEGA, **options).deflection[0]


@pytest.mark.benchmark(group=DUFFING, timer=process_time)
def test_duffing(benchmark):
    benchmark.pedantic(duffing, rounds=21, warmup_rounds=2)
    row(benchmark, "harmonic balance (femgear)", "without stability")


@pytest.mark.benchmark(group=DUFFING, timer=process_time)
def test_duffing_of_harmonicbalance(benchmark):
    pytest.importorskip("harmonicbalance")
    from validation.nonlinear_tones import PACKAGE, package_lines

    found = benchmark.pedantic(package_lines, args=(COUNT, OMEGA), rounds=21, warmup_rounds=2)
    error = np.abs(found - duffing()).max() / np.abs(found).max()
    assert error < 1e-9
    row(benchmark, f"{PACKAGE} with SciPy's root", f"lines differ by {error:.0e} of the largest")


@pytest.fixture(scope="module")
def rotor(ross):
    """Shaft of six elements with two discs on two bearings, its twist held at one end."""
    steel = ross.Material("steel", rho=7810, E=211e9, G_s=81.2e9)

    class Held(ross.Rotor):
        # free to twist, the matrix of the constant line would be singular
        def K(self, *args, **kwargs):
            matrix = super().K(*args, **kwargs).copy()
            matrix[5, 5] += TORSION
            return matrix

    shaft = [ross.ShaftElement(L=0.25, idl=0.0, odl=0.05, material=steel) for _ in range(6)]
    discs = [ross.DiskElement.from_geometry(n, steel, width=0.07, i_d=0.05, o_d=0.28) for n in (2, 4)]
    bearing = {"kxx": 1e6, "kyy": 0.8e6, "kzz": 1e6, "cxx": 100.0, "cyy": 100.0, "czz": 100.0}
    return Held(shaft, discs, [ross.BearingElement(n, **bearing) for n in (0, 6)])


def balanced(rotor):
    """Lines (42, 4) of the rotor by femgear."""
    from femgear.solvers.periodic.harmonic_balance import displacements, solve_harmonic_balance
    from femgear.system.force_laws import PolynomialSprings
    from femgear.system.system import HarmonicForce, MechanicalSystem, NonlinearSystem

    n = rotor.ndof
    K, W, turning = rotor.K(SPEED), np.zeros((n, 1)), np.zeros(n, complex)
    # the spring against twist is the one element
    K[5, 5] -= TORSION
    W[5] = 1.0
    # a force of 1 N on the disc in the middle, x behind y by a quarter of a turn
    turning[3 * rotor.number_dof : 3 * rotor.number_dof + 2] = 1.0, -1j
    names = tuple(f"{i}" for i in range(n))
    system = MechanicalSystem(rotor.M(SPEED), rotor.C(SPEED), K, W, np.zeros(n), names, gyroscopic=rotor.G())
    forces = tuple(HarmonicForce(size * turning, (order,)) for order, size in FORCES.items())
    problem = NonlinearSystem(system, (PolynomialSprings([0], [[TORSION]]),), forces, speed=SPEED)
    found = solve_harmonic_balance(problem, SPEED, harmonics=4, stability=False)
    return displacements(problem, found)[:, 1:]


@pytest.mark.benchmark(group=ROTOR, timer=process_time)
def test_rotor(benchmark, rotor):
    benchmark.pedantic(balanced, args=(rotor,), rounds=5, warmup_rounds=1)
    row(benchmark, "harmonic balance (femgear)", "ROSS's matrices included, solved line by line")


@pytest.mark.benchmark(group=ROTOR, timer=process_time)
def test_rotor_of_ross(benchmark, rotor):
    force = {"node": 3, "harmonics": [*FORCES], "magnitudes": [*FORCES.values()], "phases": [0.0] * 3}
    options = {"speed": SPEED, "t": np.linspace(0.0, 0.02, 65), "harmonic_forces": [force], "n_harmonics": 4}
    found = benchmark.pedantic(rotor.run_harmonic_balance_response, kwargs=options, rounds=5, warmup_rounds=1)
    lines = balanced(rotor)
    error = np.abs(found.dQ - lines).max() / np.abs(lines).max()
    assert error < 1e-10
    note = f"{len(found.Qt)} complex unknowns; lines differ by {error:.0e} of the largest"
    row(benchmark, "harmonic balance of ROSS", note)
