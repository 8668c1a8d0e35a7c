"""Kinds and phasing of helical modes, and where their energy sits."""

from dataclasses import replace

import numpy as np
import pytest
from published.planetary_sets import kahraman_set

from femgear.errors import CaseError
from femgear.stages.lumped_set import gear_set_modes
from femgear.system.mesh_directions import gear_set_system
from femgear.system.mode_kinds import gear_set_kinds, gear_set_motions, phase_basis, phasing
from femgear.system.rigid_bodies import HelicalSupport
from validation.reference.mode_energy import gear_set_springs, stiffness_of, strain_shares


def equal(planets, **changes):
    return kahraman_set(planet_angles=2.0 * np.pi * np.arange(planets) / planets, **changes)


@pytest.mark.parametrize("planets", [3, 4, 5, 6])
@pytest.mark.parametrize("contact_points", ["base_circles", "pitch_point"])
def test_number_of_modes_of_every_kind(planets, contact_points):
    """12 rotational-axial, 12 pairs of translational-tilting and 6 (N - 3) planet modes (Eritenel 2009)."""
    data = equal(planets, contact_points=contact_points)
    modes = gear_set_modes(data)
    kinds = np.array(modes.kind)
    count = {name: int(np.sum(kinds == name)) for name in set(kinds)}
    assert count.pop("rigid") == 1 and count["rotational-axial"] == 11
    assert count["translational-tilting"] == 24
    assert count.get("planet", 0) == 6 * (planets - 3) and "mixed" not in count
    paired = modes.frequency[kinds == "translational-tilting"]
    assert paired[::2] == pytest.approx(paired[1::2], rel=1e-8)


def test_kinds_do_not_follow_the_order_of_the_planets():
    """Turning the whole set turns the shapes, not the frequencies and kinds."""
    one, two = equal(5), kahraman_set(planet_angles=2.0 * np.pi * np.arange(5) / 5 + 0.4)
    first, second = gear_set_modes(one), gear_set_modes(two)
    assert first.frequency == pytest.approx(second.frequency, rel=1e-8, abs=1e-6)
    assert first.kind == second.kind


def test_phasing_of_the_modes_of_six_planets():
    """The classes 0, 1, 2 and 3 of the cyclic group: six modes of each that can be told apart in twos."""
    data = equal(6)
    modes = gear_set_modes(data, max_frequency=60e3)
    shape = modes.shape @ phase_basis(gear_set_motions(data, modes.shape), modes.frequency)
    names = phasing(gear_set_motions(data, shape))
    kinds = dict(zip(("rotational-axial", "translational-tilting"), ("in phase", "sequentially phased 1")))
    for kind, name in zip(gear_set_kinds(data, shape, frequency=modes.frequency), names):
        if kind == "planet":
            assert name in ("sequentially phased 2", "counter-phased")
        elif kind != "rigid":
            assert name == kinds[kind]
    assert {"sequentially phased 2", "counter-phased"} <= set(names)


def test_modes_of_unequal_planets_are_mixed():
    data = kahraman_set(planet_angles=[0.0, 1.2, 3.3, 4.6])
    assert gear_set_modes(data).kind.count("mixed") > 5


def test_springs_make_the_whole_stiffness_and_their_shares_add_up():
    bearing = HelicalSupport(np.array([1e8, 2e8, 3e8, 4e8]), 1e9, 1e5, 3e3)
    data = kahraman_set(planet_bearing=bearing, slices=2, face_width=0.03, contact_points="pitch_point")
    system, modes = gear_set_system(data), gear_set_modes(data, max_frequency=20e3)
    springs = gear_set_springs(data)
    total = system.K + (system.W * data.column_stiffness) @ system.W.T
    assert stiffness_of(springs) == pytest.approx(total, rel=1e-12, abs=1e-12 * np.abs(total).max())
    shares = strain_shares(springs, modes.shape)
    assert sum(shares.values()) == pytest.approx(np.ones(len(modes.frequency)), rel=1e-9)
    energy = np.einsum("im,ij,jm->m", modes.shape, total, modes.shape)
    assert energy == pytest.approx((2 * np.pi * modes.frequency) ** 2, rel=1e-7)
    assert {"bearing of planet 4, torsional", "support of the sun, tilt"} <= set(springs)
    held = replace(data, ring=replace(data.ring, support=HelicalSupport(np.inf, 0.0, np.inf, np.inf)))
    assert not [name for name in gear_set_springs(held) if "ring, " in name]


def test_shapes_of_another_set_are_refused():
    with pytest.raises(CaseError, match="E-SHAPE"):
        gear_set_kinds(equal(4), np.eye(36), frequency=np.ones(36))
