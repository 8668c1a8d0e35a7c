#!/usr/bin/env python3
"""Bring pictures of a run into docs/images, made small."""

from __future__ import annotations

import io
import sys
from pathlib import Path

from script_tools import ready_folder, run_script

IMAGES = (
    "deformed_set.png",
    "mesh_stiffness.png",
    "mode_shapes.png",
    "microphone_spectrum_3100_rpm.png",
    "modulation_250_rpm.png",
    "order_spectrum_250_rpm.png",
)
FOLDER = Path(__file__).resolve().parents[1] / "docs" / "images"
LARGEST = 300_000


def main(results: Path, /, *, output: Path = FOLDER) -> None:
    """Write the pictures that the README and docs/ show, in 256 colours, each below 300 kB.

    Parameters
    ----------
    results
        Folder that femgear run wrote.
    output
        Folder of the pictures.
    """
    from PIL import Image

    from femgear.errors import StorageError
    from femgear.storage.files import write_bytes
    from femgear.trains.reading import open_results

    folder = open_results(results).folder
    # the pictures of docs/images are under version control
    place = FOLDER if output.resolve() == FOLDER else ready_folder(output, IMAGES)
    for name in ready_images(folder):
        with Image.open(folder / name) as picture:
            small = picture.convert("RGB").quantize(256)
        stream = io.BytesIO()
        small.save(stream, format="png", optimize=True)
        data = stream.getvalue()
        if len(data) > LARGEST:
            raise StorageError(f"{name} takes {len(data)} bytes", code="E-RANGE", limit=f"{LARGEST} bytes")
        write_bytes(data, place / name)
        print(f"{name}: {len(data) / 1e3:.0f} kB")


def ready_images(folder: Path) -> tuple[str, ...]:
    """Names of the pictures, all of which the run must have written."""
    from femgear.errors import StorageError

    missing = [name for name in IMAGES if not (folder / name).is_file()]
    if missing:
        raise StorageError(
            f"the run has no {', '.join(missing)}",
            file=str(folder),
            remedy="run the reference case with pictures",
        )
    return IMAGES


if __name__ == "__main__":
    sys.exit(run_script(main))
