"""CalculiX as a reference: inputs that it understands and tables that are read, on closed forms."""

import numpy as np
import pytest

from femgear.fe.elasticity import Material
from validation import calculix
from validation.calculix import (
    Mates,
    PlaneBody,
    fields,
    frequencies,
    installed,
    moduli,
    natural_frequencies,
    over_arc,
    pair_contact,
    tables,
)
from validation.calculix_casing import bore_load, hats
from validation.calculix_rows import where_installed
from validation.calculix_solid import LAYERS, solid_contact

WITHOUT_CONTRACTION = Material(206e9, 0.0, 7850.0)
PLANE_STRAIN = {"tooth": "plane strain", "body": "plane strain"}
needs_program = pytest.mark.skipif(not installed(), reason="CalculiX is not installed")


def block(x, y, count=4) -> PlaneBody:
    """Rectangle between two ends in x and y, with its sides "below", "above" and "beside" (small x)."""
    n = 2 * count + 1
    columns, rows = np.meshgrid(np.linspace(*x, n), np.linspace(*y, n))
    number = np.arange(n * n).reshape(n, n)
    triangles = []
    for i in range(0, n - 1, 2):
        for j in range(0, n - 1, 2):
            s = number[i : i + 3, j : j + 3]
            triangles.append([s[0, 0], s[0, 2], s[2, 2], s[0, 1], s[1, 2], s[1, 1]])
            triangles.append([s[0, 0], s[2, 2], s[2, 0], s[1, 1], s[2, 1], s[1, 0]])
    edges = {
        name: np.column_stack([line[:-1:2], line[2::2], line[1::2]])
        for name, line in (("below", number[0]), ("above", number[-1]), ("beside", number[:, 0]))
    }
    points = np.column_stack([columns.ravel(), rows.ravel()])
    return PlaneBody(points, np.array(triangles), edges, np.ones(len(triangles), bool))


def named(body, rim, flank):
    edges = {"rim": body.edges[rim], "fillet 0": body.edges["beside"]}
    edges |= dict.fromkeys(("flank 0", "contact 0"), body.edges[flank])
    return PlaneBody(body.points, body.triangles, edges, body.tooth)


@needs_program
def test_two_bars_pressed_together_by_a_rotation():
    """Bars of the length L end to end, one end turned by theta about a point beside: p = E theta x/(2 L)."""
    radius, height, length, width, theta = 0.05, 0.01, 0.01, 0.02, 1e-4
    x = radius - height / 2, radius + height / 2
    bodies = (
        named(block(x, (-length, 0.0)), "below", "above"),
        named(block(x, (0.0, length)), "above", "below"),
    )
    found = pair_contact(
        bodies,
        [Mates((0, 0), (0.0, 0.0))],
        [radius * theta, 2 * radius * theta],
        base_radius=radius,
        width=width,
        material=WITHOUT_CONTRACTION,
        states=(PLANE_STRAIN, PLANE_STRAIN),
        penalty=1e17,
    )
    rate = 206e9 * theta / (2 * length)
    torque = rate * width * (height * radius**2 + height**3 / 12)
    assert found.torque == pytest.approx([torque, 2 * torque], rel=1e-3)
    assert found.pressure == pytest.approx(np.full((2, 1, 2), rate * x[1]) * [1, 2], rel=0.01)
    assert np.abs(found.root).max() < 0.01 * rate * x[1]
    assert found.at(1.5 * torque, found.approach) == pytest.approx(1.5 * radius * theta, rel=1e-3)


@needs_program
def test_block_on_springs():
    """Rigid body on springs at its corners: k/m twice, and k sum r^2 / I."""
    a, b = 0.02, 0.01
    body = block((0.0, a), (0.0, b), count=2)
    corners = [0, 4, 20, 24]
    mass = 7850.0 * a * b
    found = natural_frequencies(
        body,
        WITHOUT_CONTRACTION,
        PLANE_STRAIN,
        springs=dict.fromkeys(corners, 1e6),
        masses=dict.fromkeys(corners, 0.1 * mass),
        count=3,
    )
    square = 4e6 / (1.4 * mass)
    arm = (a**2 + b**2) / 4
    turning = 4e6 * arm / (mass * (a**2 + b**2) / 12 + 0.4 * mass * arm)
    assert found == pytest.approx(np.sqrt([square, square, turning]) / (2 * np.pi), rel=1e-3)


def test_plane_stress_as_plane_strain():
    material = Material(206e9, 0.3, 7850.0)
    E, nu = moduli(material, "plane stress")
    strain = Material(1e6 * E, nu, 7850.0)
    assert strain.lame("plane strain") == pytest.approx(material.lame("plane stress"), rel=1e-12)


def test_shares_over_an_arc():
    angle = np.linspace(-np.pi, np.pi, 73)[:-1]
    points = np.column_stack([np.cos(angle), np.sin(angle)])
    i = np.arange(0, 72, 2)
    body = PlaneBody(points, np.zeros((0, 6), int), {"rim": np.column_stack([i, (i + 2) % 72, i + 1])}, i > 99)
    shares = over_arc(body, "rim", 3.1, 0.5)
    assert sum(shares.values()) == pytest.approx(1.0)
    mean = sum(share * points[node] for node, share in shares.items())
    assert mean == pytest.approx(np.sinc(0.25 / np.pi) * np.array([np.cos(3.1), np.sin(3.1)]), abs=5e-3)


def test_tables_and_fields_are_read():
    text = (
        "\n forces (fx,fy,fz) for set RIM and time  0.1E+01\n\n         1  1.0E+00 -2.0E+00  0.0E+00\n"
        "\n displacements (vx,vy,vz) for set RIM and time  0.1E+01\n\n         1  5.0E+00 -2.0E+00  0.0E+00\n"
    )
    (forces,) = tables(text, "forces")
    assert forces.tolist() == [[1.0, 1.0, -2.0, 0.0]]
    text = (
        " -4  STRESS      6    1\n -5  SXX         1    4    1    1\n"
        " -1        12-1.00000E+02 2.00000E+00\n -3\n"
        " -4  DISP        4    1\n -1        12 1.00000E+00\n -3\n"
    )
    ((nodes, values),) = fields(text, "STRESS")
    assert nodes.tolist() == [12] and values.tolist() == [[-100.0, 2.0]]
    row = "      1   0.1579137E+08   0.3973836E+04   0.6324555E+03   0.0000000E+00\n"
    assert frequencies(f"\n     E I G E N V A L U E   O U T P U T\n\n{row}") == pytest.approx([632.4555])


@needs_program
def test_two_blocks_pressed_over_their_width():
    """The same bars as solids of layers: every layer has the same part of the torque."""
    radius, height, length, width, theta = 0.05, 0.01, 0.01, 0.02, 1e-4
    x = radius - height / 2, radius + height / 2
    bodies = (
        named(block(x, (-length, 0.0), 2), "below", "above"),
        named(block(x, (0.0, length), 2), "above", "below"),
    )
    found = solid_contact(
        bodies,
        [radius * theta, 2 * radius * theta],
        base_radius=radius,
        width=width,
        material=WITHOUT_CONTRACTION,
        slope=0.0,
        penalty=1e17,
    )
    torque = 206e9 * theta / (2 * length) * width * (height * radius**2 + height**3 / 12)
    assert found.torque == pytest.approx([torque, 2 * torque], rel=1e-3)
    assert found.layer_torque == pytest.approx(found.torque[:, None] / LAYERS * np.ones(LAYERS), rel=1e-6)


def test_force_on_a_bore():
    """A force on some waves of a ring still has its resultant, which is of the wave one."""
    radius, width, count, place = 0.081, 0.025, 64, 0.3
    angle, z = np.meshgrid(np.linspace(0, 2 * np.pi, 2 * count + 1), [-width / 2, 0, width / 2])
    points = np.column_stack([radius * np.cos(angle.ravel()), radius * np.sin(angle.ravel()), z.ravel()])
    number = np.arange(angle.size).reshape(angle.shape)
    triangles = []
    for j in range(0, 2 * count, 2):
        s = number[:, j : j + 3]
        triangles.append([s[0, 0], s[0, 2], s[2, 2], s[0, 1], s[1, 2], s[1, 1]])
        triangles.append([s[0, 0], s[2, 2], s[2, 0], s[1, 1], s[2, 1], s[1, 0]])
    load = bore_load(points, np.array(triangles), place, 56, radius)
    slope = np.radians(20.0)
    resultant = [np.sin(slope + place), -np.cos(slope + place), 0.0]
    assert load.sum(axis=0) == pytest.approx(resultant, abs=5e-3)
    assert hats(np.linspace(0, 7, 50), 56).sum(axis=0) == pytest.approx(np.ones(50))


def test_rows_say_that_calculix_is_missing_or_fails(monkeypatch):
    def some_pair():
        raise RuntimeError("CalculiX: *ERROR: no solution")

    monkeypatch.setattr(calculix, "PROGRAM", None)
    (row,) = where_installed(some_pair)()
    assert row.verdict == "information" and "ccx" in row.note
    monkeypatch.setattr(calculix, "PROGRAM", "ccx")
    (row,) = where_installed(some_pair)()
    assert row.verdict == "FAILS" and "no solution" in row.note
