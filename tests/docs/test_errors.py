"""Every error code of the package has a meaning, and docs/errors.md is what is written from the source."""

import importlib.util
from pathlib import Path

import pytest

from femgear import errors

PATH = Path(__file__).parents[2] / "validation" / "tools" / "error_page.py"
DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def error_page():
    spec = importlib.util.spec_from_file_location("error_page", PATH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_code_has_a_meaning_and_every_meaning_a_code(error_page):
    classes = (one for one in vars(errors).values() if isinstance(one, type))
    defaults = {one.default_code for one in classes if issubclass(one, errors.FemgearError)}
    assert error_page.named_codes() | defaults == set(errors.CODES)


def test_page_is_that_of_the_source(error_page):
    page = (DOCS / "errors.md").read_text(encoding="utf-8")
    assert page == error_page.page(errors.CODES), "run python validation/tools/error_page.py -o docs/errors.md"


def test_codes_on_the_other_pages_exist():
    for path in (*DOCS.glob("*.md"), DOCS.parent / "README.md"):
        found = {word.strip("`[]().,:;") for word in path.read_text(encoding="utf-8").split()}
        codes = {word for word in found if word.startswith("E-") and word[2:].replace("-", "").isupper()}
        assert codes <= set(errors.CODES), path.name


def refusals(error_page, folder):
    """File, code, words and message of the refusals of a folder."""
    for source in error_page.sources(error_page.ROOT / "femgear"):
        calls = source.calls if (error_page.ROOT / "femgear" / folder) in source.path.parents else ()
        for call in calls:
            if error_page._name(call.func).endswith("Error"):
                words = {word.arg: word.value for word in call.keywords}
                for code in error_page._codes(words.get("code")):
                    yield code, words.keys(), f"{source.path.name}:{call.lineno}: {error_page._text(call.args[0])}"


@pytest.mark.parametrize("folder", ["case", "gears", "trains", "study", "storage"])
def test_what_a_user_meets_says_what_is_allowed_or_what_to_do(error_page, folder):
    """Refusals of cases, trains and studies; what `checked_numbers` and the like refuse has both."""
    found = list(refusals(error_page, folder))
    assert found and not [place for _, words, place in found if not words & {"limit", "remedy"}]


def test_refusals_of_grids_say_what_to_do(error_page):
    found = [one for one in refusals(error_page, "fe") if one[0] in ("E-GRID", "E-GRID-FILE")]
    assert len(found) > 15 and not [place for _, words, place in found if "remedy" not in words]
