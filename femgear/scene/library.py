"""PyVista, loaded late and only where it can draw."""

from __future__ import annotations

import ctypes
import os
import sys

from femgear.errors import FemgearError


def load_pyvista():
    """PyVista, ready to draw without a screen.

    Returns
    -------
    module

    Raises
    ------
    FemgearError
        ``E-SYSTEM-LIBRARY`` where the machine lacks the OpenGL library that drawing needs: VTK would
        end the process without a word.
    """
    if sys.platform.startswith("linux"):
        if _loads("libEGL.so.1"):
            os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
        else:
            raise FemgearError(
                "pictures of grids need the system library libEGL.so.1, which is not installed",
                code="E-SYSTEM-LIBRARY",
                value="libEGL.so.1",
                remedy="apt-get install -y --no-install-recommends libegl1 libgl1 (Debian, Ubuntu)",
            )
    import pyvista

    return pyvista


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True
