"""Every error code of the package has a meaning, and docs/errors.md is what is written from the source."""

import importlib.util
from pathlib import Path

import pytest

from femgear import errors

PATH = Path(__file__).parents[1] / "tools" / "error_page.py"
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
    assert page == error_page.page(errors.CODES), "run python tests/tools/error_page.py -o docs/errors.md"


def test_codes_on_the_other_pages_exist():
    for path in (*DOCS.glob("*.md"), DOCS.parent / "README.md"):
        found = {word.strip("`[]().,:;") for word in path.read_text(encoding="utf-8").split()}
        codes = {word for word in found if word.startswith("E-") and word[2:].replace("-", "").isupper()}
        assert codes <= set(errors.CODES), path.name
