"""Flash and bulk temperatures, load sharing, scuffing."""

import numpy as np
import pytest

from femgear.gears.contact_temperature import (
    STEEL_CONTACT,
    bulk_temperature_of_flash,
    bulk_temperature_of_losses,
    contact_half_width,
    flash_temperature,
    hertz_pressure,
    mean_over_path,
    path_load_sharing,
    reduced_modulus,
    scuffing_safety,
    scuffing_temperature,
)
from validation.heat import closed_forms
from validation.losses import spur_test_gear

PAIR = spur_test_gear((0.1817, 0.1715), (82.636, 118.544))


@pytest.mark.parametrize("row", closed_forms(), ids=lambda row: row.quantity)
def test_rows_of_closed_forms_pass(row):
    assert row.verdict == "passes"


def test_hertz_of_equal_steel_cylinders():
    modulus = reduced_modulus((206e9, 0.3), (206e9, 0.3))
    assert modulus == pytest.approx(206e9 / 0.91)
    load, radius = 1e5, 0.01
    pressure, half = hertz_pressure(load, radius, modulus), contact_half_width(load, radius, modulus)
    assert np.pi / 2.0 * pressure * half == pytest.approx(load)
    assert pressure == pytest.approx(0.25 * modulus * half / radius)


def test_flash_temperature_is_zero_at_the_pitch_point_and_without_load():
    assert flash_temperature(0.05, 1e5, 1e-4, 3.0, 3.0) == 0.0
    assert flash_temperature(0.05, 0.0, 0.0, 3.0, 4.0) == 0.0
    one = flash_temperature(0.05, 1e5, 1e-4, 2.0, 4.0)
    assert flash_temperature(0.1, 1e5, 1e-4, 4.0, 2.0) == pytest.approx(2.0 * one)
    # one surface that takes heat twice as well: the sum in the denominator
    better = flash_temperature(0.05, 1e5, 1e-4, 2.0, 4.0, (2.0 * STEEL_CONTACT, STEEL_CONTACT))
    assert one / better == pytest.approx((2.0 * 2.0**0.5 + 2.0) / (2.0**0.5 + 2.0))


def test_load_sharing_adds_up_to_the_whole_load():
    start, end = PAIR.path
    path = np.linspace(start + 1e-9, start + PAIR.base_pitch - 1e-9, 50)
    both = path_load_sharing(PAIR, path) + path_load_sharing(PAIR, path + PAIR.base_pitch)
    double = path + PAIR.base_pitch < end
    assert both[double] == pytest.approx(1.0, abs=1e-6)
    assert path_load_sharing(PAIR, np.array([start - 1e-4, end + 1e-4])).tolist() == [0.0, 0.0]
    wide = path_load_sharing(PAIR, np.array([start, 0.0, end]), 1.2, 0.3)
    assert wide * PAIR.contact_ratio == pytest.approx([1.3, 1.0, 1.3])
    assert path_load_sharing(PAIR, np.array([start]), 0.9, 0.3)[0] * PAIR.contact_ratio == pytest.approx(1.27)


def test_bulk_temperatures_rise_with_flash_and_losses():
    assert bulk_temperature_of_flash(90.0, 50.0, supply=1.2) == pytest.approx(90.0 + 0.47 * 1.2 * 50.0)
    assert bulk_temperature_of_flash(90.0, 50.0, supply=1.0, meshes=3.0) == pytest.approx(90.0 + 0.47 * 2.0 * 50.0)
    rise = bulk_temperature_of_losses(0.0, 300.0, 91.5e-3, 14e-3, supply=1.2)
    assert rise == pytest.approx(7400.0 * (0.3 / (91.5 * 14.0)) ** 0.72)
    assert bulk_temperature_of_losses(0.0, 600.0, 91.5e-3, 14e-3, supply=1.0) == pytest.approx(rise * 2.0**0.72 / 1.2)
    path = np.linspace(-1.0, 2.0, 31)
    assert mean_over_path(path, 3.0 * path) == pytest.approx(1.5)


def test_scuffing_goes_by_the_square_of_the_load_stage():
    assert scuffing_temperature(12, 1.0) == pytest.approx(80.0 + 2.25 * 144.0)
    assert scuffing_temperature(6, 0.9, 1.15) == pytest.approx(80.0 + (0.85 + 1.61) * 0.9 * 36.0)
    assert scuffing_safety(380.0, 190.0, 90.0) == pytest.approx(2.9)
