"""The HTML page: self-contained, valid, escaped, and with the numbers of the run."""

import importlib.util
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest
from edited_manifests import finish
from steels import NO_STEELS

from femgear.errors import StorageError
from femgear.report import style
from femgear.report.page import page as html
from femgear.stages import static_figures as static_figures
from femgear.storage.files import write_dataset, write_text
from femgear.storage.results import prepare_output
from femgear.trains.elastic.stages import ELASTIC
from femgear.trains.reading import open_results, parse_case, read_case, with_value, with_values

pytestmark = pytest.mark.usefixtures("pictures_undrawn", "coarse_states")

_HERE = Path(__file__).parents[1]
_SPEC = importlib.util.spec_from_file_location("synthetic_results", _HERE / "synthetic_results.py")
synthetic = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(synthetic)
CASE = _HERE.parent / "cases" / "planetary_27_40_108.toml"
VOID = {"meta", "img", "br", "hr", "link", "input"}


class Page(HTMLParser):
    """Collects what a page refers to and checks that its elements are nested."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.open, self.links, self.images, self.rows, self.ids, self.text = [], [], [], [], set(), []
        self.tags = set()
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.tags.add(tag)
        given = dict(attributes)
        if "id" in given:
            self.ids.add(given["id"])
        self.links += [value for key, value in attributes if key in ("href", "src", "data", "action")]
        if tag == "img":
            self.images.append(given)
        if tag == "tr":
            self.rows.append([])
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open and self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)
        if self.open and self.open[-1] in ("td", "th"):
            self.rows[-1].append(data)


def make_run(folder, *, case=None, stages=("static", "modes", "dynamics", "housing"), change=None):
    """A results folder from synthetic data, with two pictures."""
    case = read_case(CASE) if case is None else case
    prepare_output(folder)
    write_text(case.source, folder / "case.toml")
    names, findings = ["case.toml"], [*ELASTIC.case_warnings(case)]
    for stage in stages:
        data = getattr(synthetic, stage)()
        if change is not None:
            change(stage, data)
        findings += ELASTIC.stage(stage).findings(data)
        write_dataset(data, folder / f"{stage}.nc")
        names.append(f"{stage}.nc")
    style.save_figure(static_figures.load_sharing(synthetic.static()), folder / "load_sharing.png")
    style.save_figure(static_figures.tooth_loads(synthetic.static()), folder / "tooth_loads.png")
    names += ["tooth_loads.png", "load_sharing.png"]
    finish(folder, names, timings={"static": 1.25}, convergence={}, findings=findings)
    return folder


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return make_run(tmp_path_factory.mktemp("run") / "out")


@pytest.fixture(scope="module")
def text(run):
    return html(ELASTIC, open_results(run))


def test_page_is_nested_and_complete(text):
    page = Page(text)
    assert text.startswith("<!DOCTYPE html>")
    assert {"html", "head", "title", "body", "h1", "table", "figure", "img"} <= page.tags
    assert "script" not in page.tags


def test_page_loads_nothing(text):
    assert not re.search(r"https?://|//[a-z]|url\(|@import", text.split("base64,")[0])
    page = Page(text)
    for link in page.links:
        assert link.startswith(("data:image/", "#")), link
    for link in page.links:
        assert not link.startswith("#") or link[1:] in page.ids
    assert "http://" not in text and "https://" not in text
    assert "default-src 'none'" in text


def test_pictures_are_embedded_with_captions_in_reading_order(text):
    images = Page(text).images
    assert len(images) == 2
    assert all(image["src"].startswith("data:image/png;base64,iVBORw0KGgo") for image in images)
    assert images[0]["alt"].startswith("Share of every planet in the torque of the sun, and the planet load")
    assert images[1]["alt"].startswith("Load of one tooth pair")


def test_tables_hold_the_numbers(text):
    rows = Page(text).rows
    cells = {cell for row in rows for cell in row}
    assert any(cell.startswith("22.1995") for cell in cells)
    assert any(cell.startswith("1.5507") for cell in cells)
    assert any("90.0000" in cell for cell in cells)
    assert "1.25" in cells  # seconds of the static stage
    assert any("fixed point" in row for row in rows)


def test_bands_of_an_amplitude_modulated_signal(tmp_path):
    """(1 + 0.5 cos 6 theta) cos 216 theta: lines 216 (1), 210 and 222 (0.25), six lobes."""

    def change(stage, data):
        if stage == "housing":
            data.attrs["form"] = "exact"
            data["lines_real"].values[:], data["lines_imag"].values[:] = 0.0, 0.0
            for order, amplitude in ((210, 0.25), (216, 1.0), (222, 0.25)):
                speed = order * data["carrier_speed"].values
                data["lines_real"].values[:, order] = amplitude / speed**2

    page = Page(html(ELASTIC, open_results(make_run(tmp_path / "out", change=change))))
    row = next(row for row in page.rows if row[:3] == ["250", "2", "216"])
    assert row[3] == "216: 1"
    assert row[4] in ("210 = 216 − 6: 0.25", "222 = 216 + 6: 0.25")
    assert row[5:] == ["-12.0", "6", "3", "-"]
    assert "10 % of its largest value" in "".join(page.text)


def test_hostile_title_is_text(tmp_path):
    title = "<script>alert('x')</script> & \"quotes\" $\\frac{x_$"
    case = with_value(read_case(CASE), "title", title)
    page = Page(html(ELASTIC, open_results(make_run(tmp_path / "out", case=case))))
    assert "script" not in page.tags
    assert title in "".join(page.text)


def test_control_characters_are_escaped(tmp_path):
    """Of a manifest that somebody else has written, and of the text of the case."""
    case = parse_case(CASE.read_text(encoding="utf-8") + "# \u202eotfel\n")
    results = open_results(make_run(tmp_path / "out", case=case))
    results = replace(results, manifest=replace(results.manifest, versions={"femgear": "1\x1b[31m\x00\ud800"}))
    text = html(ELASTIC, results)
    assert r"1\x1b[31m\x00\ud800" in text and r"# \u202eotfel" in text
    assert all(one.isprintable() or one in "\n\u00a0" for one in text)


def test_verdicts_are_warnings(tmp_path):
    def change(stage, data):
        if stage == "dynamics":
            data["converged"].values[1] = False
            data["floquet_multiplier"].values[0] = 1.07
            data["stable"].values[0] = False

    text = html(ELASTIC, open_results(make_run(tmp_path / "out", change=change)))
    for code, state in (("W-CONVERGENCE", "did not converge at 3100"), ("W-UNSTABLE", "is unstable at 250")):
        words = f"[{code}] operation.speeds: the periodic solution {state} rpm</li>"
        assert f'<li class="doubt">doubt of dynamics: {words}' in text


def test_verdict_stands_before_the_stages_and_trust_is_folded_away_at_the_end(tmp_path):
    def change(stage, data):
        if stage == "dynamics":
            data["converged"].values[1] = False

    results = open_results(make_run(tmp_path / "out", change=change))
    for static in (False, True):
        text = html(ELASTIC, results, static=static)
        keys = (
            '<section class="front"',
            "<caption>Verdict",
            '<details id="gears"',
            *(f'id="{one}"' for one in ("static", "modes", "dynamics", "housing", "trust", "warnings")),
        )
        places = [text.index(key) for key in (*keys, "did not converge at 3100 rpm", "Case as run")]
        assert places == sorted(places) and text.count("did not converge at 3100 rpm") == 1
        assert 'href="#warnings">Warnings: ' in text[: places[1]]
        folded = 7  # the verdict, the gears, four stages, and what the results rest on
        # what is folded away is shown where no script opens it for paper
        assert text.count("<details") == folded and text.count(" open>") == folded
    titles = [stage.title for stage in ELASTIC.stages]
    assert titles == [
        "Static",
        "Stresses",
        "Losses",
        "Temperatures",
        "Life",
        "Modes",
        "Run-up",
        "Dynamics",
        "Housing",
        "What the level rests on",
    ]


def test_static_results_alone_make_a_page(tmp_path):
    page = Page(html(ELASTIC, open_results(make_run(tmp_path / "out", stages=("static",)))))
    assert "static" in page.ids and "housing" not in page.ids


def test_changed_pictures_are_named_and_not_shown(tmp_path):
    folder = make_run(tmp_path / "out")
    (folder / "tooth_loads.png").write_bytes(b"other")
    text = html(ELASTIC, open_results(folder))
    assert len(Page(text).images) == 1
    assert "tooth_loads.png is missing or was changed since the run, and is not shown" in text


def test_same_results_give_the_same_text(run):
    first = html(ELASTIC, open_results(run))
    assert html(ELASTIC, open_results(run)) == first


def test_no_results_no_page(tmp_path):
    with pytest.raises(StorageError):
        html(ELASTIC, open_results(tmp_path / "nothing"))
    with pytest.raises(StorageError):
        html(ELASTIC, open_results(tmp_path))
    assert list(tmp_path.iterdir()) == []


def test_page_one_answers_the_questions_of_a_set(tmp_path):
    """Without limits of the material strength has none either; no convergence makes the numbers doubtful."""

    def change(stage, data):
        if stage == "dynamics":
            data["converged"].values[1] = False

    unrated = with_values(read_case(CASE), NO_STEELS)
    text = html(ELASTIC, open_results(make_run(tmp_path / "out", case=unrated, change=change)))
    front = text[text.index('<section class="front') : text.index("</section>")]
    states = re.findall(r'<li class="card (\w+)"><p class="question">([^<?]*\?) <b>(.) ([^<]*)</b>', front)
    questions = {question: state for state, question, _, _ in states}
    assert questions["Is it strong enough?"] == "absent" and questions["Can the numbers be relied on?"] == "look"
    assert "give material.treatment and material.hardness" in front and "W-CONVERGENCE" in front
    signs = {"good": ("✓", "holds"), "look": ("▲", "look"), "open": ("○", "no limit"), "absent": ("○", "not computed")}
    assert [signs[state] for state, *_ in states] == [(sign, word) for _, _, sign, word in states]
    sentence = re.search(r'<p class="sentence">(.*?)</p>', front)[1]
    assert sentence.startswith(
        "Its strength is not rated: the case gives no treatment of its gears. At 3,100 rpm the housing has "
    )
    assert '<p class="duty">100 N m at 250 to 3,100 rpm (sun) make 500 N m' in front
