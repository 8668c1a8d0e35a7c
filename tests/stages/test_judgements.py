"""Judgements of page one: states follow from the numbers and the limits of the case."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

from femgear.case.sections import StrengthSection
from femgear.findings import DOUBT, FAULT, NOTE, Finding
from femgear.stages.judgements import (
    Least,
    judge_heat,
    judge_lives,
    judge_noise,
    judge_numbers,
    judge_smoothness,
    judge_strength,
    least_of,
    least_over_life,
    lives_of_bearings,
    lives_of_teeth,
    margins_of_levels,
    resonance_of_line,
    unrated_gears,
    voice_words,
    without_life,
)
from femgear.stages.strength import OF_ROOTS

ROOT, FLANK = Least(1.92, "root of the planet"), Least(1.21, "flank of the sun")


def test_safeties_are_judged_by_those_asked_for():
    asked = StrengthSection(required_root_safety=1.4, required_flank_safety=1.0)
    holds = judge_strength(ROOT, FLANK, asked)
    assert holds.state == "good" and holds.limit == (
        "S_F at least 1.4 and S_H at least 1, ISO 6336:2019, reached at 1.4 times the load"
    )
    without = judge_strength(ROOT, FLANK, StrengthSection())
    assert without.limit.startswith("S_F and S_H at least 1, as the case asks for no other, ISO 6336:2019")
    assert holds.sentence == (
        "Strong enough for 1.4 times the load: S_F 1.92 against breakage (root of the planet), "
        "S_H 1.21 against pitting (flank of the sun)"
    )
    more = StrengthSection(required_root_safety=2.0, required_flank_safety=1.25, edition=2006)
    fails = judge_strength(ROOT, FLANK, more)
    assert fails.state == "bad" and fails.limit.endswith("ISO 6336:2006, reached at 0.94 times the load")
    assert (
        fails.sentence == "Not strong enough, only for 0.94 times the load: S_F 1.92 of 2 needed against breakage "
        "(root of the planet) and S_H 1.21 of 1.25 needed against pitting (flank of the sun)"
    )
    # root stress grows with the load, pressure with its root: at 0.94 = 1.21²/1.25² times the load S_H is 1.25
    assert (1.21 / 1.25) ** 2 == pytest.approx(0.94, abs=0.005) and 1.92 / 2.0 > 0.94
    assert "times the load" not in judge_strength(Least(math.nan, ""), FLANK, asked).limit
    # a safety that is exactly the one asked for holds, one without a number does not
    assert judge_strength(Least(1.4, ""), Least(1.0, ""), asked).state == "good"
    unknown = judge_strength(Least(math.nan, ""), FLANK, asked)
    assert unknown.state == "bad" and unknown.sentence.startswith("Not strong enough: S_F nan of ")


def test_strength_without_limits_is_open_and_half_of_it_deserves_a_look():
    open_ = judge_strength(None, None, StrengthSection(), "root 130 MPa, pressure 736 MPa")
    assert (open_.state, open_.answer) == ("open", "root 130 MPa, pressure 736 MPa")
    assert "material.treatment" in open_.limit and open_.words == "○ no limit"
    nothing = judge_strength(None, None, StrengthSection())
    assert (nothing.state, nothing.words) == ("absent", "○ not computed") and "material.treatment" in nothing.limit
    half = judge_strength(None, FLANK, StrengthSection())
    assert half.state == "look" and half.limit.endswith("S_F is not rated")
    doubt = Finding("W-FACE-LOAD", "", "text", severity=DOUBT)
    doubtful = judge_strength(ROOT, FLANK, StrengthSection(), "", [doubt], ["W-FACE-LOAD"])
    assert doubtful.state == "look" and doubtful.limit.endswith("; doubt: uneven load over the width")
    assert doubtful.sentence.startswith("With a doubt strong enough for 1.5 times the load: ")
    more = [doubt, Finding("W-THRUST", "", "text", severity=DOUBT)]
    doubtful = judge_strength(ROOT, FLANK, StrengthSection(), "", more, ["W-FACE-LOAD", "W-THRUST"])
    assert doubtful.sentence.startswith("With doubts strong enough")
    assert judge_strength(ROOT, FLANK, StrengthSection(), "", [doubt], ["W-THRUST"]).state == "good"


def test_gears_that_nothing_rates_deserve_a_look_and_are_named():
    """Gear 2 has no limits, the sun no root that the method covers, the ring no load."""
    values = ("gear_2", None, None, 1e8), ("sun", 5e8, 1e9, math.nan), ("ring", 5e8, 1e9, 0.0)
    flanks = [
        SimpleNamespace(gear=gear, root_limit=root, contact_limit=contact, root_stress=stress, contact_stress=5e8)
        for gear, root, contact, stress in values
    ]
    assert unrated_gears(SimpleNamespace(flanks=flanks)) == ["gear 2", "S_F of the sun"]
    part = judge_strength(ROOT, FLANK, StrengthSection(), unrated=["gear 2"])
    assert part.state == "look" and part.limit.endswith("; gear 2 is not rated")
    assert (
        part.sentence.startswith("Strong enough as far as it is rated, for 1.5 times the load: ")
        and "; gear 2 is not" in part.sentence
    )
    low = judge_strength(ROOT, FLANK, StrengthSection(required_root_safety=9.0), unrated=["gear 2"])
    assert low.state == "bad" and "gear 2" in low.limit
    # what no gear has is said once
    whole = judge_strength(ROOT, None, StrengthSection(), unrated=["S_H of gear 1", "gear 2"])
    assert whole.limit.endswith("; S_H and gear 2 are not rated")


def test_safeties_of_faulty_teeth_deserve_a_look():
    """They are those of whole teeth: ISO 6336 knows no crack in a root."""
    fault = Finding("W-FAULT", "planet.fault[0]", "text", severity=DOUBT)
    part = judge_strength(ROOT, FLANK, StrengthSection(), "", [fault], OF_ROOTS)
    assert part.state == "look" and "effects of a fault left out" in part.limit
    assert part.sentence.startswith("But for the faulty teeth strong enough for 1.5 times the load: ")


def test_what_no_steel_carries_fails_whatever_its_safeties():
    fault = Finding("W-PRESSURE", "", "text", severity=FAULT)
    assert judge_strength(ROOT, FLANK, StrengthSection(), "", [fault]).state == "bad"
    unrated = judge_strength(None, None, StrengthSection(), "root 900 MPa", [fault])
    assert (unrated.state, unrated.answer) == ("bad", "root 900 MPa")
    # the code with its meaning
    assert unrated.limit == "pressure beyond any steel (W-PRESSURE)"


def test_the_pressure_at_the_sharp_edge_of_a_pit_is_that_of_the_grid():
    pressure = Finding("W-PRESSURE", "", "text", severity=FAULT)
    for key, state in (("planet.fault[0]", "look"), ("", "bad")):
        findings = [pressure, Finding("W-EDGE", key, "text")]
        judged = judge_strength(ROOT, FLANK, StrengthSection(), "", findings, OF_ROOTS)
        assert judged.state == state and ("contact at the end of a flank" in judged.limit) == (state == "look")


def test_the_safety_over_the_life_counts_where_it_is_smaller():
    data = xr.Dataset({"root_spectrum_safety": ("root", [2.5, 1.24])}, {"root": ["sun", "planet, sun side"]})
    least = least_over_life(data, "root", ROOT)
    assert least == Least(1.24, "root of planet, sun side, over the life asked for", over_life=True)
    assert least_over_life(data, "root", Least(1.1, "root")) == Least(1.1, "root")
    assert least_over_life(data, "flank", FLANK) == FLANK and least_over_life(data, "root", None) == least
    nothing = xr.Dataset({"root_spectrum_safety": ("root", [math.nan])}, {"root": ["sun"]})
    assert least_over_life(nothing, "root", None) is None


def test_the_smallest_safety_is_that_of_its_flank():
    flanks = [
        SimpleNamespace(words="the sun", root_safety=2.0, contact_safety=math.nan),
        SimpleNamespace(words="gear 2", root_safety=1.5, contact_safety=math.nan),
    ]
    root, flank = least_of(SimpleNamespace(flanks=flanks))
    assert root == Least(1.5, "root of gear 2") and flank is None


@pytest.mark.parametrize(
    ("required", "state", "words"),
    (
        (None, "open", "It lives 7,605 h (bearing C fails first)"),
        (5000.0, "good", "It lives 7,605 h of the 5,000 h asked for (bearing C fails first)"),
        (20000.0, "bad", "It lives 7,605 h of the 20,000 h asked for (bearing C fails first)"),
    ),
)
def test_lives_are_judged_by_the_one_asked_for(required, state, words):
    lives = [("teeth", math.inf, "the root of gear 1"), ("bearings", 7605.0, "bearing C")]
    (judgement,) = judge_lives(lives, required)
    assert (judgement.state, judgement.sentence) == (state, words)
    assert judgement.answer == "teeth last without end, bearings 7,605 h"


def test_lives_without_end_hold_and_none_is_not_judged():
    (judgement,) = judge_lives([("teeth", math.inf, "the root of gear 1")], 100.0)
    assert judgement.state == "good" and judgement.sentence == "Its teeth last without end under these loads"
    everything = [("teeth", math.inf, ""), ("bearings", math.inf, ""), ("planets' bearings", math.inf, "")]
    assert next(judge_lives(everything, None)).sentence == "Its teeth and bearings last without end under these loads"
    assert not list(judge_lives([("bearings", math.nan, "")], 100.0))


def test_lives_deserve_a_look_where_some_are_unknown_or_doubtful():
    lives = [("teeth", 300.0, "the root of gear 1")]
    (part,) = judge_lives(lives, 100.0, unrated=["stage 1", "stage 2"])
    assert part.state == "look" and part.limit == "at least 100 h; the life of stage 1..2 is not known"
    assert part.sentence.endswith("; the life of stage 1..2 is not known")
    doubt = Finding("W-STIFFNESS", "", "text")
    (doubtful,) = judge_lives(lives, 100.0, [doubt, Finding("W-TAIL", "", "of a response")])
    assert (
        doubtful.state == "look" and "doubt: estimated stiffness" in doubtful.limit and "W-TAIL" not in doubtful.limit
    )
    assert [judgement.state for judgement in judge_lives(lives, 500.0, [doubt])] == ["bad"]
    # no rim of a gear concerns a bearing
    rim = [Finding("W-RIM", "", "text", severity=DOUBT)]
    assert [life.state for life in judge_lives(lives, 100.0, rim)] == ["look"]
    assert [life.state for life in judge_lives([("bearings", 300.0, "bearing A")], 100.0, rim)] == ["good"]
    names = xr.Dataset(coords={"root": ["gear 1", "planet, sun side"], "flank": ["planet, sun side", "gear 1, back"]})
    assert without_life(names, ["gear_1", "planet", "ring"]) == ["the ring"]


def test_lives_come_from_the_files():
    teeth: dict[str, Any] = {"root_life": ("root", [math.inf, 400.0]), "flank_life": ("flank", [900.0, math.inf])}
    for kind in ("root", "flank"):
        teeth[f"{kind}_stress_ratio"] = (("load_case", kind), [[0.8, 0.9]])
    gears = {"root": ["sun", "ring"], "flank": ["sun", "ring"]}
    assert list(lives_of_teeth(xr.Dataset(teeth, gears))) == [("teeth", 400.0, "the root of ring")]
    # a_ISO L10r stands for L10r where there is one
    bearings = {
        "spectrum_reference_life": ("bearing", [800.0, 500.0, math.nan]),
        "spectrum_modified_life": ("bearing", [300.0, math.nan, math.nan]),
        "planet_bearing_life": ("planet_bearing", [70.0]),
    }
    data = xr.Dataset(bearings, {"bearing": ["A", "B", "C"], "planet_bearing": ["planet 1"]})
    assert [(name, hours) for name, hours, _ in lives_of_bearings(data)] == [
        ("bearings", 300.0),
        ("planets' bearings", 70.0),
    ]


@pytest.mark.parametrize(("safety", "state"), ((math.nan, "open"), (2.0, "good"), (0.9, "bad")))
def test_heat_is_judged_by_scuffing(safety, state):
    losses = xr.Dataset({"efficiency": ("speed", [0.99, 0.985]), "loss": ("speed", [100.0, 250.0])})
    kinds = "speed", "mesh_kind"
    heat = xr.Dataset(
        {name: (kinds, [[value]]) for name, value in (("scuffing_safety", safety), ("film_safety", math.nan))}
        | {"highest_temperature": (kinds, [[113.0]])}
    )
    results = SimpleNamespace(stages=("losses", "heat"), losses=losses, heat=heat)
    (judgement,) = judge_heat(results)
    assert judgement.state == state and judgement.answer.startswith("efficiency 98.50 %, losses 250 W, contact 113 °C")
    assert not list(judge_heat(SimpleNamespace(stages=())))


def test_efficiency_and_losses_are_those_of_one_load_case():
    """That of the largest losses: coasting is less efficient, and loses less."""
    of_cases = {"efficiency": ("load_case", [0.9764, 0.9708]), "loss": ("load_case", [779.0, 226.6])}
    losses = xr.Dataset(of_cases, coords={"load_case": ["full torque", "coasting"]})
    (judgement,) = judge_heat(SimpleNamespace(stages=("losses",), losses=losses))
    assert judgement.answer == "efficiency 97.64 %, losses 779 W (full torque)"
    assert judgement.sentence == "It loses 779 W (full torque)"


def test_the_hottest_contact_and_the_least_safety_name_their_load_cases():
    cases, kinds = ["full torque", "coasting"], ("load_case", "mesh_kind")
    losses = xr.Dataset({"efficiency": ("load_case", [0.97, 0.96]), "loss": ("load_case", [779.0, 226.6])})
    values = {
        "scuffing_safety": [[2.0], [0.8]],
        "film_safety": [[1.5], [1.4]],
        "highest_temperature": [[130.0], [90.0]],
    }
    heat = xr.Dataset({name: (kinds, array) for name, array in values.items()})
    losses, heat = (data.assign_coords(load_case=cases) for data in (losses, heat))
    (judgement,) = judge_heat(SimpleNamespace(stages=("losses", "heat"), losses=losses, heat=heat))
    assert judgement.answer == (
        "efficiency 97.00 %, losses 779 W, contact 130 °C (full torque), S_B 0.80, S_lambda 1.40 (coasting)"
    )
    assert judgement.sentence == "It loses 779 W (full torque) and its oil fails: S_B 0.80 (coasting)"


class Files(dict):
    """Results of some stages."""

    stages = property(lambda self: tuple(self))
    findings: tuple = ()


SPEEDS = "operation.speeds gives it"


def test_a_run_is_smooth_unless_teeth_part_or_motions_grow():
    smooth = Files(dynamics=xr.Dataset({"drive_contact": ("speed", [1.0, 1.0]), "stable": ("speed", [1, 1])}))
    assert judge_smoothness("", smooth, ("dynamics",), SPEEDS).state == "good"
    still = judge_smoothness("", smooth, ("branch",), SPEEDS)
    assert (still.state, still.words, still.limit) == ("absent", "○ not computed", SPEEDS)
    resting = judge_smoothness("transmission error 6.2 µm", smooth, ("branch",), SPEEDS)
    assert resting.answer == "at rest: transmission error 6.2 µm"
    parted = Files(branch=xr.Dataset({"drive_contact": ("point", [1.0, 0.9]), "stable": ("point", [1, 0])}))
    judgement = judge_smoothness("K_v 1.2", parted, ("dynamics", "branch"), SPEEDS)
    assert judgement.state == "look" and judgement.limit == "teeth part, motions are not stable"
    # what is not determined is not judged
    assert (
        judge_smoothness("", Files(branch=xr.Dataset({"stable": ("point", [1, -1])})), ("branch",), SPEEDS).state
        == "good"
    )
    back = Files(branch=xr.Dataset({"back_contact": ("point", [0.0, 0.1])}))
    assert judge_smoothness("", back, ("branch",), SPEEDS).answer == "teeth press on their back flanks"
    pulled = Files(dynamics=xr.Dataset({"level": ("speed", np.ones(2))}))
    pulled.findings = (Finding("W-PULL", "", "it pulls"),)
    assert judge_smoothness("", pulled, ("dynamics",), SPEEDS).answer == "teeth part"
    pulled.findings = (Finding("W-TAIL", "", "it ends short", severity=DOUBT),)
    short = judge_smoothness("", pulled, ("dynamics",), SPEEDS)
    assert (short.state, short.answer) == (
        "look",
        "mesh forces may change: too few harmonics or side bands were taken",
    )
    pulled.findings = (Finding("W-OPEN", "", "planet 2 carries nothing"),)
    unloaded = judge_smoothness("", pulled, ("dynamics",), SPEEDS)
    assert (unloaded.state, unloaded.answer) == ("look", "a planet carries nothing at some positions")
    # of what was assumed motions rest on the damping, not on the place where they are heard
    pulled.findings = (
        Finding("W-ESTIMATED", "dynamics.damping_ratio", "left out", concerns="damping (0.05)"),
        Finding("W-ESTIMATED", "housing.microphone.distance", "left out", concerns="microphone distance (1 m)"),
    )
    rests_on = "teeth stay in contact; rests on estimated damping (0.05)"
    assert judge_smoothness("", pulled, ("dynamics",), SPEEDS).answer == rests_on
    # of motions whose stability nothing tells nothing is said
    pulled.findings = ()
    assert judge_smoothness("", pulled, ("dynamics",), SPEEDS).answer == "teeth stay in contact"


def of_weight(highest, response_back=0.0):
    """A planar run at one speed with a branch at 600, 1200, .. rpm whose teeth wedge at 1800 and 2400 rpm."""
    rpm = 600.0 * np.arange(1, 6)
    branch = {
        "carrier_speed": ("point", -rpm * np.pi / 30.0),
        "weight_frequency": ("point", rpm / 60.0),
        "back_contact": (("point", "mesh"), [[0.0, 0.0], [0.0, 0.0], [0.0, 0.2], [0.1, 0.2], [0.0, 0.0]]),
        "drive_contact": (("point", "mesh"), np.ones((5, 2))),
        "stable": ("point", [1, 1, 1, 0, 1]),
    }
    response = {
        "carrier_speed": ("speed", [highest * np.pi / 30.0]),
        "back_contact": (("speed", "mesh"), [[0.0, response_back]]),
    }
    run = Files(response=xr.Dataset(response), branch=xr.Dataset(branch))
    run.findings = (Finding("W-TAIL", "", "the branch ends short", severity=DOUBT, stage="branch"),)
    return judge_smoothness("", run, ("response", "branch"), SPEEDS)


def test_what_is_beyond_the_speeds_of_operation_is_said_and_leaves_the_run_smooth():
    span = "rom 30 to 40 Hz of the weight (1,800 to 2,400 rpm of the carrier)"
    doubt = " (doubt: too few harmonics)"
    troubles = f"teeth press on their back flanks and motions are not stable{doubt}"
    beyond = of_weight(1200.0)
    assert beyond.state == "good"
    assert beyond.answer == f"in operation teeth stay in contact; f{span} {troubles}"
    assert beyond.sentence == f"in operation teeth stay in contact. F{span} {troubles}"
    # up to the highest speed of operation a machine runs through it: 1800 rpm belongs to it, 2400 rpm not
    passed = of_weight(1800.0)
    assert passed.state == "look"
    there = "at 30 Hz of the weight (1,800 rpm of the carrier)"
    assert passed.sentence == f"{there} teeth press on their back flanks{doubt}"
    assert of_weight(9000.0).sentence == f"f{span} {troubles}"
    # at the only speed of operation no others are spoken of
    there = of_weight(1200.0, response_back=0.1)
    assert (there.state, there.sentence) == ("look", "teeth press on their back flanks")


def test_where_flanks_pull_in_a_run_up_is_said():
    lowest = np.array([[5.0, np.nan], [5.0, 4.0], [5.0, -3.0], [-1.0, 2.0]])
    speeds = {"speed": [500.0, 1000.0, 1500.0, 2000.0]}
    runup = xr.Dataset({"lowest_force": (("speed", "stage"), lowest)}, speeds)
    run = Files(dynamics=xr.Dataset({"level": ("speed", [1.0])}, {"speed": [1000.0]}), runup=runup)
    run.findings = (Finding("W-PULL", "", "it pulls", stage="runup"),)
    judgement = judge_smoothness("", run, ("dynamics", "runup"), SPEEDS)
    span = "1,500 to 2,000 rpm of the run-up"
    assert (judgement.state, judgement.sentence) == (
        "good",
        f"in operation teeth stay in contact. From {span} teeth part",
    )
    run["dynamics"] = run["dynamics"].assign_coords(speed=[2000.0])
    judgement = judge_smoothness("", run, ("dynamics", "runup"), SPEEDS)
    assert (judgement.state, judgement.sentence) == ("look", f"from {span} teeth part")
    # a pull at the speed of operation itself
    run.findings = (Finding("W-PULL", "", "it pulls", stage="dynamics"),)
    assert judge_smoothness("", run, ("dynamics", "runup"), SPEEDS).sentence == "teeth part"
    # one before the settling time alone is a note
    run.findings = (Finding("W-PULL", "", "it pulls", severity=NOTE, stage="transient"),)
    assert judge_smoothness("", run, ("dynamics", "runup"), SPEEDS).state == "good"


def test_teeth_that_part_in_the_motion_in_time_alone_are_said_to_do_so_there():
    """The response at a speed pulls nowhere: its forces stay above zero."""
    run = Files(dynamics=xr.Dataset({"lowest_force": ("speed", [5.0])}), transient=xr.Dataset())
    run.findings = (Finding("W-PULL", "", "it pulls for 2 % of the time", severity=DOUBT, stage="transient"),)
    stages = "dynamics", "transient"
    assert judge_smoothness("", run, stages, SPEEDS).sentence == "in the motion in time teeth part"
    run.findings = (*run.findings, Finding("W-PULL", "", "it pulls", severity=DOUBT, stage="dynamics"))
    assert judge_smoothness("", run, stages, SPEEDS).sentence == "teeth part"


@pytest.mark.parametrize(
    ("level", "words"),
    [
        (44.2, "quieter than a relaxed voice 1 m away"),
        (51.5, "as loud as a relaxed voice 1 m away"),
        (66.9, "as loud as a raised voice 1 m away"),
        (80.9, "as loud as a very loud voice 1 m away"),
        (95.0, "louder than a very loud voice 1 m away"),
    ],
)
def test_a_sound_pressure_level_is_compared_with_a_voice(level, words):
    assert voice_words(level) == words


def test_a_level_without_a_limit_is_judged_by_resonances_alone():
    assert judge_noise("1 m/s²", "so", "mode 3 meets mesh harmonic 2").state == "look"
    assert judge_noise("1 m/s²", "so").state == "open"
    unheard = judge_noise("no level", "", "", "a casing gives one", doubts="doubt: many", computed=False)
    assert (unheard.state, unheard.words, unheard.limit) == ("absent", "○ not computed", "a casing gives one")


def test_a_doubtful_level_deserves_a_look_with_and_without_a_limit():
    doubtful = judge_noise("> 9 m/s²", "so", open_words="no resonance", doubts="doubt: excitation falls short")
    assert (doubtful.state, doubtful.limit) == ("look", "no resonance; doubt: excitation falls short")


def test_a_line_beside_a_mode_is_the_resonance_of_a_level_of_which_it_makes_half():
    modes = np.array([0.0, 1200.0, 3780.0])
    words = resonance_of_line("mesh harmonic 1 at 3,750 Hz", 3750.0, modes, 0.98)
    # 3750/3780 - 1 = -0.79 %
    assert words == "mesh harmonic 1 at 3,750 Hz, 0.8 % below mode 3 at 3,780 Hz, makes 98 % of the power"
    assert "9.9 % above mode 2" in resonance_of_line("a line", 1319.0, modes, 0.25)
    # half of the level is a quarter of its power
    assert not resonance_of_line("a line", 3750.0, modes, 0.24)
    assert not resonance_of_line("a line", 1321.0, modes, 0.98) and not resonance_of_line("a line", 10.0, modes, 0.98)
    assert not resonance_of_line("a line", 3750.0, np.zeros(0), 0.98)


def test_a_level_is_judged_by_the_worst_of_its_limits():
    speed = np.array([1000.0, 2000.0, 3000.0])
    every = ([-9.0, -3.0, -5.0], [-2.0, 1.5, 0])
    (below,), (over,) = (tuple(margins_of_levels(speed, np.array(values), "foot")) for values in every)
    holds = judge_noise("1 m/s²", "so", margins=(below,))
    assert (holds.state, holds.limit) == ("good", "3.0 dB below the limit of the case at foot, 2,000 rpm")
    met = judge_noise("1 m/s²", "so", "mode 3 meets mesh harmonic 2", margins=(below,))
    assert (met.state, met.limit) == ("look", f"mode 3 meets mesh harmonic 2; {holds.limit}")
    doubtful = judge_noise("1 m/s²†", "so", margins=(below,), doubts="† it ends short")
    assert (doubtful.state, doubtful.limit) == ("look", f"{holds.limit}; † it ends short")
    fails = judge_noise("1 m/s²", "so", "mode 3 meets mesh harmonic 2", margins=(below, over))
    assert (fails.state, fails.limit) == ("bad", "1.5 dB over the limit of the case at foot, 2,000 rpm")
    assert fails.sentence == "so. Too loud: 1.5 dB over the limit of the case at foot, 2,000 rpm"


def test_numbers_are_judged_by_the_findings():
    note, doubt, fault = (
        Finding(code, "", "text", severity=severity)
        for code, severity in (("W-TIP", NOTE), ("W-TAIL", DOUBT), ("W-LIFE", FAULT))
    )
    assert judge_numbers([note], complete=True).state == "good"
    assert judge_numbers([note, doubt], complete=True).state == "look"
    judged = judge_numbers([doubt, fault, doubt], complete=True)
    assert (judged.state, judged.answer, judged.limit) == (
        "look",
        "2 doubts",
        "too few harmonics (W-TAIL) twice",
    )
    # gears that fail say nothing against their numbers
    assert judge_numbers([fault], complete=True).state == "good"
    assert judge_numbers([], complete=False).state == "bad"


def test_deflections_far_beyond_small_ones_make_the_numbers_bad():
    far = Finding("W-DEFLECTION", "", "tilts by 4430 mrad", severity=FAULT)
    judged = judge_numbers([far], complete=True)
    assert judged.state == "bad" and "W-DEFLECTION" in judged.limit
