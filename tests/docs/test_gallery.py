"""The gallery: every case and script is on it, every picture of docs/ comes from it, and it is made anew."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest

from femgear.errors import CaseError, StorageError

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGE = (DOCS / "gallery.md").read_text(encoding="utf-8")


@pytest.fixture
def gallery(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    import readme_images

    yield readme_images
    sys.modules.pop("readme_images", None)


def linked(text: str) -> set[str]:
    return set(re.findall(r"(?:docs/)?(images/[\w/.-]+)", text))


def test_every_case_and_script_that_draws_is_run(gallery):
    commands = " ".join(run.command for run in gallery.RUNS.values())
    for path in (ROOT / "cases").glob("*.toml"):
        assert f"cases/{path.name}" in commands
    for path in (ROOT / "scripts").glob("*.py"):
        text = path.read_text(encoding="utf-8")
        if ".png" in text and "run_script(main)" in text and path.name != "readme_images.py":
            assert f"scripts/{path.name}" in commands


def test_every_run_is_on_the_page_with_its_command(gallery):
    titles = re.findall(r"(?m)^## (.+)$", PAGE)
    assert titles == [run.title for run in gallery.RUNS.values()]
    assert all(f"`{run.command} -o out/{name}`" in PAGE for name, run in gallery.RUNS.items())


def test_every_image_is_shown_and_made_by_a_run(gallery):
    images = {str(path.relative_to(DOCS)) for path in (DOCS / "images").rglob("*") if path.is_file()}
    assert images == linked(PAGE) and len(images) > 100
    assert {name.split("/")[1] for name in images} <= set(gallery.RUNS)
    pages = [ROOT / "README.md", *DOCS.glob("*.md")]
    assert set.union(*(linked(page.read_text(encoding="utf-8")) for page in pages)) <= images


def test_every_image_has_a_name_and_a_sentence():
    shown = re.findall(r"(?m)^!\[([^\]]*)\]\(images/([\w/.-]+)\)\n\n\*(.+)\.\*$", PAGE)
    assert len(shown) == len(linked(PAGE))
    for name, link, words in shown:
        assert len(words.split()) >= 3 and words not in name, link
        assert Path(link).stem.replace("_", " ") in name, link


@pytest.mark.slow
def test_the_page_and_its_images_are_made_anew(gallery, tmp_path, capsys):
    docs, only = tmp_path / "docs", ("published_four_stages",)
    stale = docs / "images" / only[0] / "stage_forces.png"
    stale.parent.mkdir(parents=True)
    stale.write_bytes(b"old")
    (docs / "gallery.md").write_text("# Gallery\n\n## Harris map\n\nkept\n", encoding="utf-8")
    gallery.main(docs, output=tmp_path / "runs", only=only)
    text = (docs / "gallery.md").read_text(encoding="utf-8")
    assert "kept" in text and "kinetic energy of the modes" in text
    assert linked(text) == {"images/published_four_stages/stage_energy.png"} and not stale.exists()
    image = docs / "images" / only[0] / "stage_energy.png"
    before = image.read_bytes()
    assert len(before) < (tmp_path / "runs" / only[0] / "stage_energy.png").stat().st_size
    # results that are there are taken as they are
    manifest = tmp_path / "runs" / only[0] / "manifest.json"
    written = manifest.stat().st_mtime_ns
    gallery.main(docs, output=tmp_path / "runs", only=only, keep=True)
    assert image.read_bytes() == before and manifest.stat().st_mtime_ns == written
    assert (docs / "gallery.md").read_text(encoding="utf-8") == text
    assert "1 pictures" in capsys.readouterr().out


def test_what_two_runs_draw_alike_stands_once(gallery, tmp_path):
    from PIL import Image

    for name in ("nrel_pgb", "nrel_pgb_static"):
        folder = tmp_path / "runs" / name
        folder.mkdir(parents=True)
        Image.new("RGB", (60, 40), "white").save(folder / "mode_shapes.png")
    gallery.main(tmp_path, output=tmp_path / "runs", only=("nrel_pgb", "nrel_pgb_static"), keep=True)
    assert [path.parent.name for path in tmp_path.glob("images/*/*.png")] == ["nrel_pgb"]
    assert (tmp_path / "gallery.md").read_text(encoding="utf-8").count("Its pictures stand above.") == 1


def test_names_and_sizes_are_checked(gallery, tmp_path, monkeypatch):
    from PIL import Image

    with pytest.raises(CaseError, match="no run nothing") as found:
        gallery.main(tmp_path, only=("nothing",))
    assert found.value.code == "E-CHOICE" and not list(tmp_path.iterdir())
    assert gallery.LARGEST == 110_000
    monkeypatch.setattr(gallery, "LARGEST", 1_100)
    noise = np.random.default_rng(1).integers(0, 256, (40, 50, 3), dtype=np.uint8)
    Image.fromarray(noise).save(tmp_path / "noise.png")
    with pytest.raises(StorageError, match=r"noise\.png takes"):
        gallery.small(tmp_path / "noise.png")
