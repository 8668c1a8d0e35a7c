"""The wheel: built from the sdist and installed without the repository, it runs a case of the user."""

import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

pytestmark = pytest.mark.slow


def run(*words, folder, **environment):
    kept = {name: value for name, value in os.environ.items() if name not in {"PYTHONPATH", "FEMGEAR_MESHES"}}
    done = subprocess.run(
        [*map(str, words)], cwd=folder, env=kept | environment, capture_output=True, text=True, timeout=1200
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def build(source, target, *options):
    run(sys.executable, "-m", "build", "--outdir", target, *options, source, folder=target.parent)
    return sorted(target.iterdir())


def tracked(folder: str) -> set[str]:
    return {*run("git", "ls-files", folder, folder=ROOT).split()}


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The sdist of this tree, and the wheel that is built from it."""
    return build(ROOT, tmp_path_factory.mktemp("built") / "dist")


@pytest.fixture(scope="module")
def installed(built, tmp_path_factory):
    """Programs of an environment that has the wheel and what it asks for, nothing else."""
    folder = tmp_path_factory.mktemp("installed")
    venv.create(folder / "env", with_pip=True)
    programs = folder / "env" / "bin"
    run(programs / "python", "-m", "pip", "install", "--quiet", *built[:1], folder=folder)
    return programs


def test_both_are_what_an_index_takes_and_hold_all_of_the_package(built):
    wheel, sdist = built
    assert wheel.suffix == ".whl" and sdist.suffix == ".gz" and wheel.stat().st_size < 2_000_000
    run(sys.executable, "-m", "twine", "check", "--strict", wheel, sdist, folder=ROOT)
    with zipfile.ZipFile(wheel) as archive:
        names = {*archive.namelist()}
        (metadata,) = (name for name in names if name.endswith(".dist-info/METADATA"))
        about = archive.read(metadata).decode()
    assert tracked("femgear") == {name for name in names if ".dist-info/" not in name}
    assert "femgear/py.typed" in names and metadata.replace("METADATA", "licenses/LICENSE") in names
    assert re.search(r"(?m)^License-Expression: BSD-3-Clause$", about)
    with tarfile.open(sdist) as archive:
        inside = {name.split("/", 1)[1] for name in archive.getnames()}
    assert tracked("femgear") | tracked("cases") | tracked("tests") <= inside


def test_it_is_built_without_tags_and_without_git(tmp_path):
    """A clone without tags and a copy without git have versions before the first release."""
    run(
        "git",
        "clone",
        "--quiet",
        "--no-tags",
        "--depth",
        1,
        f"file://{ROOT}",
        tmp_path / "copy",
        folder=tmp_path,
    )
    shutil.copy(ROOT / "pyproject.toml", tmp_path / "copy")
    (first,) = build(tmp_path / "copy", tmp_path / "clone", "--wheel")
    assert re.match(r"femgear-0\.1\.0\.dev1\+g[0-9a-f]+", first.name)
    shutil.rmtree(tmp_path / "copy" / ".git")
    (second,) = build(tmp_path / "copy", tmp_path / "bare", "--wheel")
    assert second.name.startswith("femgear-0.1.0.dev0-")


def test_a_case_of_the_user_is_checked_and_run(installed, built, tmp_path):
    """In a folder of the user, with a cache of grids of the user; nothing of the repository is there."""
    text = (ROOT / "cases" / "planetary_27_40_108.toml").read_text(encoding="utf-8")
    (tmp_path / "mine.toml").write_text(text.replace("positions = 64", "positions = 16"), encoding="utf-8")
    home = {"XDG_CACHE_HOME": str(tmp_path / "cache"), "HOME": str(tmp_path)}
    said = run(installed / "femgear", "check", "mine.toml", folder=tmp_path, **home)
    assert "27" in said and "108" in said
    run(installed / "femgear", "run", "mine.toml", "-o", "out", folder=tmp_path, **home)
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert manifest["complete"] and (tmp_path / "out" / "report.html").stat().st_size > 1e5
    program = "import femgear, sys; print(femgear.__version__, femgear.__file__, *sys.path)"
    version, file, *_ = run(installed / "python", "-c", program, folder=tmp_path).split()
    assert version in built[0].name and Path(file).is_relative_to(installed.parent)
    assert [*(tmp_path / "cache" / "femgear" / "meshes").glob("*.msh")]


def test_a_set_in_two_commands_without_an_option(installed, tmp_path):
    """In an empty folder a case is written and computed, and neither replaces what is there."""
    home = {"XDG_CACHE_HOME": str(tmp_path / "cache"), "HOME": str(tmp_path)}
    folder = tmp_path / "empty"
    folder.mkdir()
    said = run(installed / "femgear", "new", "planetary", folder=folder, **home)
    assert "Assumed: --teeth" in said and "femgear run planetary.toml" in said
    said = run(installed / "femgear", "run", folder=folder, **home)
    assert "planetary_results/report.html" in said
    assert {one.name for one in folder.iterdir()} == {"planetary.toml", "planetary_results"}
    manifest = json.loads((folder / "planetary_results" / "manifest.json").read_text())
    assert manifest["complete"] and "housing.nc" in manifest["files"]
    for again, code in ((["new", "planetary"], 2), (["run"], 4)):
        done = subprocess.run(
            [installed / "femgear", *again],
            cwd=folder,
            env=os.environ | home,
            capture_output=True,
            check=False,
        )
        assert done.returncode == code and b"--force" in done.stderr
