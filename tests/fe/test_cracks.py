"""Cracked sectors: grids that part, whole sectors against half ones, the update of a ring against its whole matrix."""

import math

import numpy as np
import pytest

from femgear.contact.bodies import flank_load_columns, flank_stations, make_sectors
from femgear.contact.cracked_flanks import both_flank_loads, crack_stiffness, cracked_grids
from femgear.fe.compliance import condense_sector, tooth_compliance
from femgear.fe.cracks import WholeSchur, both_cuts, condense_whole, cracked_ring, sector_cuts_compliance
from femgear.fe.elasticity import Material
from femgear.fe.grid import check_grid
from femgear.gears.faults import Crack
from validation.faults import cut_ring
from validation.planetary import reference_set

STEEL = Material(206e9, 0.3, 7850.0)
CRACK = Crack(0, 0, 0, 0, None, math.radians(70.0), 1.5e-3)


@pytest.fixture(scope="module")
def sun():
    return reference_set().sun


@pytest.fixture(scope="module")
def grids(sun):
    return cracked_grids(sun, CRACK, flank_elements=4)


@pytest.fixture(scope="module")
def parts(sun, grids):
    """Whole and split sector, the split one with loads that open the crack behind those of the flanks."""
    whole, split = grids
    opening = np.zeros((2 * split.grid.n_nodes, len(split.normals)))
    for sign, nodes in zip((1.0, -1.0), split.faces, strict=True):
        for axis in (0, 1):
            opening[2 * nodes + axis, np.arange(len(nodes))] = sign * split.normals[:, axis]
    loads = both_flank_loads(split.grid, sun)
    matrices = [crack_stiffness(grid, sun, STEEL, None) for grid in (whole, split.grid)]
    before = condense_whole(whole, matrices[0], both_flank_loads(whole, sun), held="rim")
    return before, condense_whole(split.grid, matrices[1], np.hstack([loads, opening]), held="rim")


def of_flanks(part: WholeSchur, count: int) -> WholeSchur:
    return WholeSchur(part.stiffness, part.load_cut[:, :count], part.compliance[:count, :count])


def test_a_split_grid_has_two_faces_and_one_tip(grids):
    whole, split = grids
    check_grid(split.grid)
    faces = split.grid.points[split.faces]
    assert np.array_equal(faces[0], faces[1]) and not np.intersect1d(*split.faces).size
    assert split.grid.n_nodes == whole.n_nodes + split.faces.shape[1]
    # nothing is left without an element, and the fillet goes round the mouth by two nodes
    assert np.unique(split.grid.triangles).size == split.grid.n_nodes
    fillet = np.unique(split.grid.boundaries["fillet_left"])
    assert np.isin(split.faces[:, 0], fillet).all()


def test_a_crack_only_softens(parts):
    before, after = parts
    change = np.linalg.eigvalsh(after.stiffness - before.stiffness)
    assert change.max() < 1e-9 * np.abs(change).max()


def test_a_ring_by_its_cuts_is_the_ring_by_half_sectors(sun):
    sector = make_sectors(reference_set(), STEEL, flank_elements=4).sun
    loads = flank_load_columns(sector.grid, flank_stations(sector.grid, sun))
    options = {"count": sun.teeth, "rim": "rim", "loads": loads, "observations": loads}
    schur = condense_sector(sector.grid, sector.stiffness, **options).supported(None)
    whole, between = both_cuts(schur), tooth_compliance(schur)
    cuts, of_loads = sector_cuts_compliance(whole, sun.teeth)
    scale = np.abs(between).max()
    here = whole.compliance + whole.load_cut.T @ cuts @ whole.load_cut
    assert np.abs(here - between[0]).max() < 1e-12 * scale
    for lag in (1, 5, -1):
        there = whole.load_cut.T @ of_loads[-lag % sun.teeth].T
        assert np.abs(there - between[lag]).max() < 1e-12 * scale


def test_the_update_is_the_ring_with_one_cracked_sector(sun, parts):
    before, after = parts
    count = before.load_cut.shape[1]
    ring = cracked_ring(before, before, after, sun.teeth)
    whole = cut_ring(before, before, sun.teeth)
    cracked = cut_ring(before, of_flanks(after, count), sun.teeth)
    basis = ring.basis.reshape(len(whole), -1)
    change = basis @ ring.core @ basis.T
    assert np.abs(cracked - whole).max() > 0.1 * np.abs(whole).max()
    assert np.abs(cracked - whole - change).max() < 1e-12 * np.abs(whole).max()


@pytest.mark.decisive
def test_faces_open_as_the_whole_ring_says(sun, parts):
    """Openings per load of a flank and per force on the faces, with the faces as further loads of one sector."""
    before, after = parts
    count, total = before.load_cut.shape[1], after.load_cut.shape[1]
    ring = cracked_ring(before, before, after, sun.teeth)
    wide = WholeSchur(
        before.stiffness,
        np.pad(before.load_cut, ((0, 0), (0, total - count))),
        np.pad(before.compliance, ((0, total - count),) * 2),
    )
    cracked = cut_ring(wide, after, sun.teeth).reshape(sun.teeth, total, sun.teeth, total)
    scale = np.abs(ring.faces).max()
    assert np.abs(cracked[0, count:, 0, count:] - ring.faces).max() < 1e-12 * scale
    for tooth in (0, 1, 13, sun.teeth - 1):
        opened = ring.crossing @ ring.basis[tooth].T
        assert np.abs(cracked[0, count:, tooth, :count] - opened).max() < 1e-12 * scale
    assert np.linalg.eigvalsh(ring.faces)[0] > 0.0
