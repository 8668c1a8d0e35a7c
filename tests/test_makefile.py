"""The commands of the Makefile and what they say when the system lacks something."""

import os
import shutil
import stat
import subprocess
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
SCRIPT = ROOT / "scripts" / "setup_environment.sh"
BASH = shutil.which("bash")

pytestmark = pytest.mark.skipif(BASH is None or shutil.which("make") is None, reason="needs make and bash")


def _program(folder, name, text):
    path = folder / name
    path.write_text("#!" + BASH + "\n" + text + "\n")
    path.chmod(path.stat().st_mode | stat.S_IEXEC)
    return path


def _setup(tmp_path, *, report, user=1000, arguments=("--check",)):
    """Run a copy of the set-up script where python3 reports `report`, in a folder of its own."""
    programs = tmp_path / "bin"
    programs.mkdir(exist_ok=True)
    (tmp_path / "scripts").mkdir(exist_ok=True)
    (tmp_path / "pyproject.toml").touch()
    script = shutil.copy(SCRIPT, tmp_path / "scripts" / SCRIPT.name)
    (tmp_path / "report").write_text(report)
    # The stand-in of python3 prints the report until the stand-in of apt-get empties it.
    _program(programs, "python3", f'cat "{tmp_path}/report"')
    _program(programs, "id", f"echo {user}")
    _program(programs, "apt-get", f'echo "$@" >> "{tmp_path}/apt.log"; : > "{tmp_path}/report"')
    environment = os.environ | {"PATH": f"{programs}:{os.environ['PATH']}"}
    environment.pop("PYTHON", None)
    return subprocess.run(
        [BASH, script, *arguments], env=environment, capture_output=True, text=True, timeout=60, check=False
    )


def test_missing_libraries_are_named_in_the_line_that_installs_them(tmp_path):
    done = _setup(tmp_path, report="libglu1-mesa\nlibegl1\n")
    assert done.returncode == 1
    assert "apt-get install -y --no-install-recommends libglu1-mesa libegl1\n" in done.stderr
    assert not (tmp_path / "apt.log").exists()


def test_a_user_without_rights_is_told_and_nothing_is_installed(tmp_path):
    done = _setup(tmp_path, report="python3-venv\n", arguments=())
    assert done.returncode == 1
    assert "apt-get install -y --no-install-recommends python3-venv\n" in done.stderr
    assert not (tmp_path / "apt.log").exists()
    assert not (tmp_path / ".venv").exists()


def test_root_gets_the_libraries_installed(tmp_path):
    _setup(tmp_path, report="libglu1-mesa\nlibgl1\n", user=0, arguments=())
    log = (tmp_path / "apt.log").read_text().splitlines()
    assert log == ["update -qq", "install -y --no-install-recommends libglu1-mesa libgl1"]


def test_old_python_is_named(tmp_path):
    done = _setup(tmp_path, report="old 3.9.2\n")
    assert done.returncode == 1
    assert "Python 3.9.2; femgear needs 3.11 or newer" in done.stderr


def test_an_unknown_argument_changes_nothing(tmp_path):
    done = _setup(tmp_path, report="", arguments=("--help",))
    assert done.returncode == 1
    assert "usage: setup_environment.sh [--check]" in done.stderr
    assert not (tmp_path / ".venv").exists()


def test_this_system_has_what_is_needed():
    done = subprocess.run([BASH, SCRIPT, "--check"], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("target", "expected"),
    [
        ("demo", "femgear run cases/planetary_27_40_108.toml -o out/demo"),
        ("test", "-m pytest"),
        ("lint", "-m ruff check"),
        ("docs", "-m sphinx -b html -j 2 -W --keep-going docs out/docs/html"),
        ("validate", "python validation -o docs/validation.md"),
        ("soak", "python validation/soak --minutes 60 --page docs/reliability.md"),
        ("bench", "-m pytest benchmarks"),
        ("mutants", "python validation/tools/mutation.py"),
        ("clean", "rm -rf out"),
    ],
)
def test_targets(target, expected):
    environment = {key: value for key, value in os.environ.items() if not key.startswith("MAKE")}
    done = subprocess.run(
        ["make", "-n", target],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    assert expected in done.stdout
    if target != "clean":
        assert done.stdout.index("setup_environment.sh") < done.stdout.index(expected)


@pytest.mark.skipif(shutil.which("git") is None, reason="needs git")
@pytest.mark.parametrize("checkout", [True, False])
def test_clean_keeps_the_grids_of_the_repository(tmp_path, checkout):
    shutil.copy(ROOT / "Makefile", tmp_path)
    grids = tmp_path / "meshes"
    grids.mkdir()
    for name in ("README.md", "tracked.msh", "generated.msh", "generated.vtu"):
        (grids / name).write_text(name)
    environment = {key: value for key, value in os.environ.items() if not key.startswith(("MAKE", "GIT"))}
    environment["GIT_CEILING_DIRECTORIES"] = str(tmp_path.parent)
    done = {"cwd": tmp_path, "env": environment, "capture_output": True, "timeout": 60, "check": True}
    if checkout:
        (tmp_path / ".gitignore").write_text("meshes/*.msh\nmeshes/*.vtu\n")
        subprocess.run(["git", "init", "-q"], **done)
        subprocess.run(["git", "add", "-f", "meshes/README.md", "meshes/tracked.msh"], **done)
    subprocess.run(["make", "clean"], **done)
    kept = {path.name for path in grids.iterdir()}
    assert kept == ({"README.md", "tracked.msh"} if checkout else {"README.md"})


def test_ci_runs_the_tests_and_stops_at_the_first_failure():
    lines = (ROOT / ".ci" / "run").read_text().splitlines()
    assert "set -euo pipefail" in lines
    assert {"make lint", "make test"} <= set(lines) and any(line.startswith("if command -v chromium") for line in lines)
    # once more in a folder with the name of the package, a blank and a letter beyond ASCII
    assert lines[-2:] == [
        'git clone --quiet . "$elsewhere/fem gear/femgear ü"',
        'make -C "$elsewhere/fem gear/femgear ü" test',
    ]
    assert os.access(ROOT / ".ci" / "run", os.X_OK)


def test_development_tools_that_make_uses_are_declared():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    names = {requirement.split(">")[0] for requirement in project["optional-dependencies"]["dev"]}
    assert {"pytest", "pytest-xdist", "pytest-benchmark", "ruff"} <= names
