"""What the pictures of a run-up explain."""

from report.test_figures import synthetic

from femgear.report import waterfall
from femgear.stages import static_figures as static_figures


def test_the_run_up_explains_its_numbers_and_its_excitation():
    runup = synthetic.runup()
    title = waterfall.runup_levels(runup).axes[0].get_title(loc="left")
    assert title == "a × b: mode a at mesh harmonic b; dots: operating speeds"
    runup.attrs["method"] = "supports"
    runup["excitation_limit"] = 6.0 * runup["mesh_frequency"]
    title = waterfall.runup_levels(runup).axes[0].get_title(loc="left")
    assert title.endswith("excited up to 1.08 kHz")
