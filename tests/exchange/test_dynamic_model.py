"""Models for other programs: what is written, and that it moves in time as the spectral solver says."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from chain_model import HARMONICS, chain_excitation, chain_model, chain_modes, chain_system
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.io import loadmat

from femgear.errors import CaseError
from femgear.exchange.dynamic_model import (
    POINTS,
    StiffnessTable,
    mesh_tables,
    write_state_space,
    write_stiffness_table,
)
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.system.fourier import sample

ARRAYS = (
    "A B C D state input output state_unit input_unit output_unit nominal mesh mesh_stiffness phase angle stiffness "
    "deflection force friction backlash natural_frequency damping_ratio speed mesh_rate title "
    "mesh_ratio mesh_ahead"
).split()


def test_what_is_written_moves_in_time_as_the_spectral_solver_says(tmp_path):
    """The model of the file with k(t): e = x - f / k_m closes the loop of every mesh."""
    excitation = chain_excitation()
    write_state_space(chain_model(excitation), tmp_path / "chain.npz", harmonics=HARMONICS)
    file = np.load(tmp_path / "chain.npz")
    A, B, C, D, nominal, mean = (file[name] for name in ("A", "B", "C", "D", "nominal", "mesh_stiffness"))
    M, end = len(mean), len(file["phase"]) * file["phase"][1]
    record = np.concatenate([file[name] for name in ("stiffness", "deflection", "force")])
    curves = CubicSpline(np.append(file["phase"], end), np.append(record, record[:, :1], axis=1).T, bc_type="periodic")

    hertz = float(file["mesh_rate"] * file["speed"])

    def displacements(time, states, acting):
        """Displacements of flanks, of several motions at once: e = x - f / k_m, x = C states + D (e, other inputs)."""
        k, deflection, force = curves(hertz * time % end).reshape(3, M, 1)
        share, constant = np.diag(1.0 - k[:, 0] / mean), (force - k * deflection) / mean[:, None] * acting
        free = C[:M] @ states + (D[:M, M:] @ nominal[M:])[:, None] * acting
        x = np.linalg.solve(np.eye(M) - D[:M, :M] @ share, free - D[:M, :M] @ constant)
        return share @ x - constant

    # the motion that repeats: of all starts, and of none under what acts
    size, acting = len(A), np.append(np.zeros(len(A)), 1.0)

    def rate(time, states):
        columns = states.reshape(size, -1)
        inputs = np.vstack([displacements(time, columns, acting), nominal[M:, None] * acting])
        return (A @ columns + B @ inputs).ravel()

    # the free rotation of the whole moves no mesh: it stays where it is
    times, starts = np.arange(33) / (32 * hertz), np.eye(size, size + 1).ravel()
    motion = solve_ivp(rate, (0.0, times[-1]), starts, "DOP853", times, rtol=1e-10, atol=1e-14)
    columns = motion.y.T.reshape(len(times), size, -1)
    turned = columns[-1, :, :-1] - np.eye(size)
    first = np.linalg.lstsq(-turned, columns[-1, :, -1], rcond=1e-12)[0]
    states = columns @ np.append(first, 1.0)
    inputs = [displacements(t, y[:, None], np.ones(1))[:, 0] for t, y in zip(times, states, strict=True)]
    inputs = np.column_stack([inputs, np.tile(nominal[M:], (len(times), 1))])
    found = (C[: 2 * M] @ states.T + D[: 2 * M] @ inputs.T)[:, :-1]
    modes = chain_modes(chain_system(), excitation)
    response = solve_spectral(modes, excitation, [hertz], excitation_harmonics=HARMONICS, response_harmonics=60)
    expected = sample(np.stack([response.deflection[0, 0], response.force[0, 0]]), 128)[:, ::4]
    assert (np.abs(found - expected).max(axis=1) <= 1e-6 * np.abs(expected).max(axis=1)).all()


def test_matlab_and_numpy_get_the_same(tmp_path):
    model = chain_model()
    for name in ("chain.npz", "chain.mat"):
        write_state_space(model, tmp_path / name, harmonics=3)
    ours, theirs = np.load(tmp_path / "chain.npz"), loadmat(tmp_path / "chain.mat", simplify_cells=True)
    assert set(ours.files) == set(ARRAYS) == {key for key in theirs if not key.startswith("_")}
    for name in ARRAYS:
        if ours[name].dtype.kind == "U":
            assert np.atleast_1d(ours[name]).tolist() == np.atleast_1d(theirs[name]).tolist(), name
        else:
            assert np.array_equal(ours[name].ravel(), np.ravel(theirs[name])), name
    assert ours["angle"][-1] == pytest.approx(ours["phase"][-1] / ours["mesh_rate"], rel=1e-15)


def test_tables_hold_the_harmonics_that_are_asked_for():
    model = chain_model()
    few, all_of_it = mesh_tables(model, 2), mesh_tables(model, 1000)
    assert few.stiffness.shape == (1, 2 * POINTS) and len(all_of_it.phase) == 127 * POINTS
    assert few.phase[-1] == pytest.approx(1.0 - 1.0 / (2 * POINTS))
    lines = np.fft.rfft(few.stiffness[0])
    assert np.abs(lines[3:]).max() < 1e-9 * np.abs(lines).max() < np.abs(lines[2])
    # at the positions of the record the whole table is the record
    at = np.interp(np.arange(256) / 256, all_of_it.phase, all_of_it.stiffness[0], period=1.0)
    np.testing.assert_allclose(at, model.excitation.stiffness[0], rtol=1e-3)
    assert few.friction.shape == (0, 2 * POINTS)
    with pytest.raises(CaseError, match="needs harmonics"):
        mesh_tables(model, 0)


def test_two_periods_of_the_excitation_fill_one_table():
    model = chain_model(replace(chain_excitation(), periods=2))
    tables = mesh_tables(model, 2)
    assert tables.stiffness.shape == (1, 4 * POINTS) and tables.phase[-1] == pytest.approx(2.0 - 1.0 / (2 * POINTS))


TABLE = StiffnessTable(
    np.linspace(0.0, 0.3, 4), ("gear 1-gear 2",), np.array([[3e8, 4e8, 5e8, 3e8]]), 1e-6 * np.array([[2, 3, 4, 2]])
)


def test_a_stiffness_table_is_read_back(tmp_path):
    for name in ("k.csv", "k.mat", "k.npz"):
        write_stiffness_table(TABLE, tmp_path / name)
    with open(tmp_path / "k.csv", encoding="utf-8", newline="") as stream:
        header, *rows = csv.reader(stream)
    assert header == [
        "angle [rad]",
        "stiffness of gear 1-gear 2 [N/m]",
        "transmission error of gear 1-gear 2 [m]",
    ]
    expected = np.column_stack([TABLE.angle, TABLE.stiffness[0], TABLE.deflection[0]])
    np.testing.assert_allclose(np.array(rows, float), expected, rtol=1e-8)
    ours, theirs = np.load(tmp_path / "k.npz"), loadmat(tmp_path / "k.mat")
    for read in (ours, theirs):
        assert np.array_equal(read["stiffness"], TABLE.stiffness) and str(read["stiffness_unit"].item()) == "N/m"
        assert np.array_equal(np.ravel(read["angle"]), TABLE.angle)


@pytest.mark.parametrize(("write", "what"), [(write_state_space, chain_model()), (write_stiffness_table, TABLE)])
def test_other_endings_are_refused(tmp_path, write, what):
    with pytest.raises(CaseError, match="no such format") as refused:
        write(what, tmp_path / "model.txt")
    assert refused.value.code == "E-CHOICE" and not [*tmp_path.iterdir()]
