"""Textbook routes to the same numbers, for comparison."""

from __future__ import annotations

from dataclasses import replace

import numpy as np


def whole_body_columns(grid, material, width, count, columns: int):
    """Displacements of a whole gear, held at its bore, under unit loads on one flank.

    Parameters
    ----------
    grid : Grid
        Sector.
    count : int
        Sectors.
    columns : int
        Load cases: radial forces at as many nodes of one flank.

    Returns
    -------
    (2n, columns) array
    """
    from scipy.sparse.linalg import splu

    from femgear.fe.elasticity import stiffness
    from femgear.fe.grid import rotated_copies

    whole = rotated_copies(grid, count)
    matrix = stiffness(whole, material, state="plane strain", thickness=width)
    held = np.unique(whole.boundaries["rim"])
    free = np.setdiff1d(np.arange(2 * len(whole.points)), np.concatenate([2 * held, 2 * held + 1]))
    factor = splu(
        matrix[free][:, free].tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    flank = np.unique(whole.boundaries["flank_left"])[:columns]
    load = np.zeros((2 * len(whole.points), len(flank)))
    load[2 * flank, np.arange(len(flank))] = 1.0
    return factor.solve(load[free])


def without_residual(modes):
    """The modal basis without the static part of the modes left out, as a purely modal model has it."""
    elastic = modes.frequency > 1e-3
    share = np.zeros(len(modes.frequency))
    share[elastic] = modes.modal_load[elastic] / (2 * np.pi * modes.frequency[elastic]) ** 2
    return replace(modes, residual=np.zeros_like(modes.residual), load_deflection=modes.mesh_deflection @ share)


def modal_harmonic_balance(modes, excitation, frequency, *, excitation_harmonics: int, harmonics: int):
    """Mesh deflections by one linear system in all modal coordinates and harmonics of one speed.

    Parameters
    ----------
    modes, excitation
        As `femgear.solvers.periodic.spectral.solve_spectral` takes them.
    frequency : float
        Mesh frequency [Hz].

    Returns
    -------
    (n_meshes, H + 1) complex array
    """
    R, h = modes.mesh_deflection, np.arange(-harmonics, harmonics + 1)
    omega, size = 2 * np.pi * modes.frequency, len(h)

    def lines(samples):
        two_sided = np.fft.fft(samples, axis=1) / samples.shape[1]
        return two_sided[:, np.arange(-excitation_harmonics, excitation_harmonics + 1)]

    k, s, force = (lines(x) for x in (excitation.stiffness, excitation.deflection, excitation.force))
    lag = np.subtract.outer(h, h)
    inside = np.abs(lag) <= excitation_harmonics
    toeplitz = np.where(inside, k[:, np.where(inside, lag, 0) + excitation_harmonics], 0.0)
    wide = np.arange(-excitation_harmonics, excitation_harmonics + 1)
    padded_s, padded_f = np.zeros((2, len(k), size), complex)
    padded_s[:, wide + harmonics], padded_f[:, wide + harmonics] = s, force
    source = np.einsum("jab,jb->ja", toeplitz, padded_s) - padded_f
    varying = toeplitz - modes.mesh_stiffness[:, None, None] * np.eye(size)
    matrix = np.einsum("jm,jab,jn->manb", R, varying, R)
    drive = 2 * np.pi * frequency * h
    own = omega[:, None] ** 2 - drive**2 + 2j * modes.damping_ratio[:, None] * omega[:, None] * drive
    own[:, harmonics][omega < 2e-2 * np.pi] = 1.0
    m = len(omega)
    matrix[np.arange(m)[:, None], np.arange(size), np.arange(m)[:, None], np.arange(size)] += own
    right = R.T @ source
    right[:, harmonics] += modes.modal_load
    solution = np.linalg.solve(matrix.reshape(m * size, m * size), right.ravel()).reshape(m, size)
    two_sided = R @ solution
    result = 2 * two_sided[:, harmonics:]
    result[:, 0] /= 2
    return result


def contact_problems(gears, bodies, *, sun_torque: float, positions: int):
    """The contact problems of some positions, as `femgear.contact.solve.solve_contact` takes them."""
    from femgear.contact.assembly import assemble_contact
    from femgear.contact.windows import mesh_windows

    n = gears.n_planets
    share = sun_torque / (gears.sun.base_radius * n)
    setup = mesh_windows(
        gears,
        bodies,
        share=share,
        positions=positions,
        cells=36,
        nearest=3.0 * share / (10e9 * gears.sun.face_width),
        contact="profile",
    )
    load = np.append(np.zeros(n), sun_torque / gears.sun.base_radius)
    problems = [assemble_contact(setup, bodies, p) for p in range(positions)]
    return [(problem.H, problem.gap, problem.G, load) for problem in problems]


def contact_by_daqp(H, gap, G, load):
    """Contact loads by the general quadratic program: min p'Hp/2 + gap'p, p >= 0, G'p = load.

    In micrometres and kilonewtons, as general solvers need it.
    """
    import daqp

    n, m = G.shape
    upper = np.concatenate([np.full(n, 1e30), load / 1e3])
    lower = np.concatenate([np.zeros(n), load / 1e3])
    sense = np.concatenate([np.zeros(n), np.full(m, 5)]).astype(np.int32)
    loads, _, flag, _ = daqp.solve(
        np.ascontiguousarray(H * 1e9), gap * 1e6, np.ascontiguousarray(G.T), upper, lower, sense
    )
    assert flag == 1
    return loads * 1e3
