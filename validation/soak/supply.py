"""Licences of what is installed for femgear, and known holes in it: ``python validation/soak/supply.py``."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib import metadata

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

# seconds that the look-up of known holes may take
_LIMIT = 120.0


def requirements(root: str = "femgear") -> list[str]:
    """List the distributions that one needs, with those that they need, as far as they are installed."""
    requirements, seen, pending = {}, set(), [Requirement(root)]
    while pending:
        wanted = pending.pop()
        key = canonicalize_name(wanted.name), frozenset(wanted.extras)
        if key in seen:
            continue
        seen.add(key)
        try:
            distribution = metadata.distribution(wanted.name)
        except metadata.PackageNotFoundError:
            continue
        requirements[key[0]] = distribution.metadata["Name"]
        for requirement in map(Requirement, distribution.requires or ()):
            extras = wanted.extras or {""}
            if requirement.marker is None or any(requirement.marker.evaluate({"extra": extra}) for extra in extras):
                pending.append(requirement)
    return sorted(requirements.values(), key=str.lower)


def licence(name: str) -> str:
    """Say the licence of an installed distribution in a few words, as its metadata do."""
    fields = metadata.metadata(name)
    classified = [
        classifier.rsplit(" :: ", 1)[-1]
        for classifier in fields.get_all("Classifier") or ()
        if classifier.startswith("License ::")
    ]
    for words in (fields.json.get("license_expression"), ", ".join(classified), fields.json.get("license")):
        if isinstance(words, str) and words.strip():
            return words.strip().splitlines()[0][:60]
    return "not stated"


def known_holes() -> str:
    """Ask pip-audit, where it is installed and reaches its data; say so where it does not."""
    command = [sys.executable, "-m", "pip_audit", "--local", "--progress-spinner", "off", "--format", "json"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_LIMIT, check=False)
        dependencies = json.loads(done.stdout)["dependencies"]
    except subprocess.TimeoutExpired:
        return f"known holes: not looked up, no answer within {_LIMIT:g} s"
    except (ValueError, KeyError, TypeError):
        return "known holes: not looked up, " + (done.stderr.strip().splitlines() or ["no answer"])[-1][:200]
    holes = [
        f"  {dependency['name']} {dependency['version']}: {hole['id']}"
        for dependency in dependencies
        for hole in dependency.get("vulns", ())
    ]
    unknown = sum("skip_reason" in dependency for dependency in dependencies)
    words = f"known holes of {len(dependencies) - unknown} packages: {len(holes)}"
    return "\n".join([words + (f"; {unknown} others could not be looked up" if unknown else ""), *holes])


def main() -> int:
    """Print the table of licences and what pip-audit says."""
    for name in requirements():
        print(f"{name:24} {metadata.version(name):14} {licence(name)}")
    print(known_holes())
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
