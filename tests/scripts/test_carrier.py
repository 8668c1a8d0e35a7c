"""The carrier of scripts/carrier.py: symmetric and reduced as it should be, and that of the shipped case."""

from dataclasses import astuple
from pathlib import Path

import numpy as np
import pytest
from carrier import Carrier, main, reduced

from femgear.errors import CaseError
from femgear.exchange.carrier_files import read_carrier
from femgear.fe.beam import rigid_link

SHIPPED = Path(__file__).parents[2] / "cases" / "carriers" / "drum_of_three.npz"


@pytest.fixture(scope="module")
def body(tmp_path_factory):
    path = tmp_path_factory.mktemp("carrier") / "carrier.npz"
    np.savez(path, **reduced(Carrier(size=0.012, around=8, modes=6)))
    return read_carrier(path)


@pytest.mark.slow
def test_pins_are_alike_to_rounding(body):
    turn = np.array([[-0.5, -np.sqrt(0.75), 0.0], [np.sqrt(0.75), -0.5, 0.0], [0.0, 0.0, 1.0]])
    both = np.kron(np.eye(2), turn)
    blocks = body.compliance.reshape(3, 6, 3, 6).transpose(0, 2, 1, 3)
    for n in range(3):
        for m in range(3):
            expected = both @ blocks[n, m] @ both.T
            assert np.abs(blocks[(n + 1) % 3, (m + 1) % 3] - expected).max() < 1e-9 * np.abs(body.compliance).max()


@pytest.mark.slow
def test_its_mass_is_that_of_its_volume(body):
    rigid = np.vstack([np.eye(6), *(rigid_link(pin - body.seat) for pin in body.pins)])
    mass = (rigid.T @ body.mass @ rigid)[0, 0]
    drum = np.pi * (0.05**2 * 0.044 - 0.0215**2 * 0.036 - 0.0075**2 * 0.008)
    stub = np.pi * (0.0225**2 - 0.0075**2) * 0.003
    pins = 3.0 * np.pi * 0.008**2 * 0.028
    angle, away = np.linspace(0.0, 2.0 * np.pi, 2001)[:-1], np.linspace(0.0, 0.022, 1001)
    x, y = Carrier().radius + np.outer(away, np.cos(angle)), np.outer(away, np.sin(angle))
    inside = (np.hypot(x, y) < 0.05) & (np.hypot(x, y) > 0.0215)
    pocket = float((inside * away[:, None]).sum() * (angle[1] * away[1]))
    assert mass == pytest.approx(7850.0 * (drum + stub + pins - 3.0 * pocket * 0.028), rel=0.01)


@pytest.mark.slow
def test_coarse_elements_are_near_the_shipped_file(body):
    shipped = read_carrier(SHIPPED)
    assert np.diag(body.compliance) == pytest.approx(np.diag(shipped.compliance), rel=0.05)
    assert body.frequency[:2] == pytest.approx(shipped.frequency[:2], rel=0.05)


def test_the_shipped_file_is_that_of_the_script():
    assert tuple(np.load(SHIPPED)["sizes"]) == astuple(Carrier())
    assert SHIPPED.stat().st_size < 300_000


@pytest.mark.slow
def test_a_file_that_is_there_is_not_computed_again(tmp_path, capsys):
    main(output=tmp_path, size=0.015, modes=2)
    first = (tmp_path / "carrier.npz").stat().st_mtime_ns
    main(output=tmp_path, size=0.015, modes=2)
    assert (tmp_path / "carrier.npz").stat().st_mtime_ns == first
    assert "a pin radially" in capsys.readouterr().out
    with pytest.raises(CaseError, match="sizes of the carrier"):
        main(output=tmp_path, size=1.0)
