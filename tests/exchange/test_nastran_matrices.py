"""Matrices in files of Nastran: those of a beam that Nastran itself reduced, and entries of small files."""

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh

from femgear.errors import CaseError
from femgear.exchange.nastran_matrices import dmig_matrices

DMIG = "DMIG,K,0,6,2,0\nDMIG,K,7,1,,7,1,2.D7\nDMIG,K,7,1,,9,3,-1.D7\nDMIG,K,9,3,,9,3,3.D7\n"


def test_eigenvalues_that_nastran_printed():
    """A beam by MSC Nastran 2013: PARAM,EXTOUT,matrixpch, and the table of its .f06 (MIT, see the file)."""
    (K, M), row, _ = dmig_matrices(Path(__file__).with_name("nastran_beam.pch"))
    assert sorted(row) == [(n, c) for n in range(1, 6) for c in (3, 4)]
    printed = "1.764385E+04 1.800475E+04 6.542455E+05 6.645972E+05 7.545368E+06 7.580662E+06 6.257528E+07"
    found = eigh(K.real, M.real, eigvals_only=True)[2:]
    assert [f"{one:.6E}" for one in found] == [*printed.split(), "6.263273E+07"]


def test_entries_stand_at_node_and_component_and_symmetric_ones_twice(tmp_path):
    path = tmp_path / "two.pch"
    path.write_text(DMIG + "DMIG,M,0,6,2,0\nDMIG,M,7,1,,7,1,0.5\nDMIG,M,9,3,,9,3,0.25\n")
    (stiffness, mass), row, place = dmig_matrices(path)
    assert row == {(7, 1): 0, (9, 3): 1} and place == {}
    assert stiffness.real.tolist() == [[2e7, -1e7], [-1e7, 3e7]] and not stiffness.imag.any()
    assert np.diag(mass.real).tolist() == [0.5, 0.25]


def test_a_file_without_mass_says_what_is_looked_for(tmp_path):
    (tmp_path / "one.pch").write_text(DMIG)
    with pytest.raises(CaseError, match="one stiffness and one mass") as error:
        dmig_matrices(tmp_path / "one.pch")
    assert error.value.code == "E-COUNT" and error.value.value == "K" and "MAAX" in error.value.limit
