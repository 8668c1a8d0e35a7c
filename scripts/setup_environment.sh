#!/usr/bin/env bash
# Make .venv and install femgear in it, once. System libraries are looked for before anything can fail on them.
# Usage: setup_environment.sh [--check]      (--check: only look, change nothing)
# Set PYTHON to use another interpreter than python3.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

python="${PYTHON:-python3}"
stamp=.venv/.femgear_installed
check_only=no

fail() {
    printf 'femgear: %s\n' "$@" >&2
    exit 1
}

case "${1:-}" in
    "") ;;
    --check) check_only=yes ;;
    *) fail "unknown argument '$1'; usage: setup_environment.sh [--check]" ;;
esac

# Prints "old <version>" or the Debian packages of what is missing, one a line; must run on any Python 3.
look() {
    "$python" - <<'PYTHON'
import ctypes
import importlib.util
import sys

LIBRARIES = (
    ("libGLU.so.1", "libglu1-mesa"),
    ("libGL.so.1", "libgl1"),
    ("libEGL.so.1", "libegl1"),
    ("libXrender.so.1", "libxrender1"),
    ("libXcursor.so.1", "libxcursor1"),
    ("libXft.so.2", "libxft2"),
    ("libXinerama.so.1", "libxinerama1"),
    ("libgomp.so.1", "libgomp1"),
)


def loads(name):
    try:
        ctypes.CDLL(name)
    except OSError:
        return False
    return True


if sys.version_info < (3, 11):
    print("old %d.%d.%d" % sys.version_info[:3])
    sys.exit(0)
if importlib.util.find_spec("venv") is None or importlib.util.find_spec("ensurepip") is None:
    print("python3-venv")
if sys.platform.startswith("linux"):
    for library, package in LIBRARIES:
        if not loads(library):
            print(package)
PYTHON
}

may_install() {
    [ "$check_only" = no ] && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null
}

require_system() {
    local missing line
    missing="$(look)" || fail "'$python' could not be run."
    case "$missing" in
        "") return 0 ;;
        old*) fail "'$python' is Python ${missing#old }; femgear needs 3.11 or newer." \
            "Install one and name it: make PYTHON=python3.11 ..." ;;
    esac
    missing="$(echo "$missing" | tr '\n' ' ' | sed 's/ *$//')"
    line="apt-get install -y --no-install-recommends $missing"
    if may_install; then
        echo "femgear: installing system libraries: $missing"
        export DEBIAN_FRONTEND=noninteractive
        if apt-get update -qq && $line && [ -z "$(look)" ]; then return 0; fi
    fi
    fail "these system libraries are missing: $missing" "Install them (Debian, Ubuntu) as root with" "  $line" \
        "and run the command again."
}

fresh() {
    [ -x .venv/bin/python ] && [ -f "$stamp" ] && [ "$(cat "$stamp")" = "$PWD" ] &&
        [ ! pyproject.toml -nt "$stamp" ] && [ ! scripts/setup_environment.sh -nt "$stamp" ]
}

install() {
    # An environment whose interpreter has gone or that was left half made is made again.
    if ! .venv/bin/python -m pip --version >/dev/null 2>&1; then "$python" -m venv --clear .venv; fi
    echo "femgear: installing the package and its dependencies into .venv (once; a minute or two)"
    .venv/bin/python -m pip install --quiet --disable-pip-version-check -e ".[dev]" ||
        fail "pip could not install the dependencies (network, proxy or disk space?); its message is above."
    echo "$PWD" >"$stamp"
}

command -v "$python" >/dev/null || fail "'$python' was not found; install Python 3.11 or newer."
require_system
if [ "$check_only" = no ] && ! fresh; then install; fi
