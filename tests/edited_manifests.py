"""Manifests of runs that came to their end, and those that somebody edited with care: their checksum fits."""

import json
from functools import partial
from pathlib import Path

from femgear.storage.results import MANIFEST, _seal, record

finish = partial(record, complete=True)
"""`record` of a run that came to its end."""


def edit_manifest(folder: Path, **changes: object) -> None:
    """Change entries of the manifest of a results folder."""
    data = json.loads((folder / MANIFEST).read_text(encoding="utf-8")) | changes
    data.pop("checksum", None)
    (folder / MANIFEST).write_text(json.dumps(data | {"checksum": _seal(data)}), encoding="utf-8")
