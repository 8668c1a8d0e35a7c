"""The examples: they answer their question from any folder, in a form that Sphinx-Gallery takes."""

import re
from pathlib import Path

import pytest
from script_runs import run_script

pytestmark = pytest.mark.usefixtures("pictures_undrawn")

FOLDER = Path(__file__).resolve().parents[2] / "scripts" / "examples"
# what each one prints: closed forms, published orders, neighbouring rows of docs, or the effect that it shows
ANSWERS = {
    "drivetrain_spectrum": r"mesh harmonic 2: 1135 Hz",
    "envelope_lobes": r"equal: 6 lobes[^\n]*\nthird planet moved: 3 lobes",
    "face_load": r"crowning 0 um: K_Hbeta \[1\. .*\ncrowning 4 um",
    "gear_rattle": r"0\.8: drive 0\.49, free 0\.21, back 0\.30",
    "grid_to_vtu": r"elements, 1117 mm\^2",
    "helical_set": r"harmonic 1: carrier 0\.0 N, ring 0\.0 N, sun 0\.0 N\nharmonic 2: carrier [1-9]",
    "iso_stiffness": r"\[0\.98\d* 0\.9\d* +0\.8\d*\]",
    "mesh_cycle": r"rigid 1\.544, under load 1\.7",
    "mode_kinds": r"rotational: .* 4462.*\ntranslational: 1227, 1227",
    "pin_error": r"sun held: 2\.4\d* at 6 um\nsun floats: 1\.000",
    "pin_error_lobes": r"true: 6 lobes\n.*true: 6 lobes\n800 rpm.*: 5 lobes\n2200 rpm.*: 6 lobes",
    "published_table": r"743\.2   743\.164 Hz[\s\S]* 11775\.3 11775\.266 Hz",
    "relief_map": r"200 N m: 15 um",
    "relief_shape": r"linear: 0\.\d+ um at 4 um\nparabolic: 0\.\d+ um at 6 um",
    "root_stress_cycle": r"gear 1: 25\d MPa, ISO 6336-3 290 MPa\ngear 2: 26\d MPa, ISO 6336-3 294 MPa",
    "sensor_side_bands": r"\[528, 531, 534, 537, 540, 543, 546, 549, 552\]",
    "six_bolts": r"foundation alone: up to [\d.]+ m/s\^2\nsix bolts: up to [\d.]+",
    "sound_to_wav": r"5\.0\d s, 6\d\.\d dB",
    "speed_sweep": r"mesh harmonic 1: 1\d{4} rpm\nmesh harmonic 2: 7\d{3} rpm",
    "tolerance_samples": r"sigma 1\.5 um: .* 1\.9\d\nsigma 3 um: .* 2\.\d+",
    "tooth_number_phasing": r"\['translational', 'planet', 'translational', 'rotational'\]",
    "tooth_wedging": r"free from 0\.09 mm on",
    "veering": r"\d\d stiffnesses, places left unresolved: 0",
}
LONG = {
    "drivetrain_spectrum",
    "envelope_lobes",
    "face_load",
    "iso_stiffness",
    "pin_error_lobes",
    "relief_map",
    "relief_shape",
    "six_bolts",
    "sound_to_wav",
    "speed_sweep",
    "tolerance_samples",
}


@pytest.fixture
def pyplot(monkeypatch):
    """Figures that no window shows, in the style that Matplotlib starts with."""
    import matplotlib.pyplot as plt

    plt.switch_backend("agg")
    monkeypatch.setattr(plt, "show", lambda: None)
    with plt.style.context("default"):
        yield plt
    plt.close("all")


def test_each_has_the_form_of_the_gallery():
    """A title underlined as long as it is, a text, cells with words of their own, fewer than 50 lines."""
    paths = sorted(FOLDER.glob("*.py"))
    assert [path.stem for path in paths] == sorted(ANSWERS)
    for path in paths:
        text = path.read_text(encoding="utf-8")
        title, line, words = re.match(r'"""\n(.+)\n(=+)\n\n(.+?)\n"""\n', text, re.DOTALL).groups()
        assert title.endswith("?") and len(title) == len(line) and len(words) > 100, path.name
        assert re.search(r"\n# %%\n# \w", text) and len(text.splitlines()) < 50, path.name


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name in LONG else ()) for name in ANSWERS]
)
def test_example_answers_and_draws(name, tmp_path, monkeypatch, pyplot):
    """It prints its answer; its only picture has axes with units."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    done = run_script(f"examples/{name}.py", folder=tmp_path)
    assert done.returncode == 0 and re.search(ANSWERS[name], done.stdout), done.stdout + done.stderr
    (number,) = pyplot.get_fignums()
    figure = pyplot.figure(number)
    for ax in figure.axes:
        radius = ax.get_title() if ax.name == "polar" else ax.get_ylabel()
        assert "[" in radius or radius == "modes that are driven", radius
        assert "[" in ax.get_xlabel() or not ax.get_xlabel(), ax.get_xlabel()
    assert any(ax.get_xlabel() for ax in figure.axes)
    written = [one for one in tmp_path.iterdir() if one.suffix in {".wav", ".vtu"}]
    assert len(written) == (name in {"grid_to_vtu", "sound_to_wav"})
