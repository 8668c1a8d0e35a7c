"""Former names of modules and of what is in them, until the next minor release, with a DeprecationWarning.

`FormerNames` finds modules, `former_names` gives a module those of its functions and classes, `former_keywords` those
of the parameters of one.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Mapping
from functools import wraps
from importlib import import_module
from importlib.util import spec_from_loader
from typing import Any, TypeVar

MOVED = {
    "femgear.trains.protocol": "femgear.stages.protocol",
    "femgear.trains.static.stages": "femgear.stages.static",
    "femgear.trains.static.results": "femgear.stages.static_results",
    "femgear.trains.static.figures": "femgear.stages.static_figures",
    "femgear.trains.rigid": "femgear.stages.lumped_set",
    "femgear.trains.gear_pair": "femgear.trains.impacts",
    "femgear.housing.structure": "femgear.housing.two_way.structure",
    "femgear.housing.carrier_orders": "femgear.housing.two_way.carrier_orders",
    "femgear.housing.harmonic_blocks": "femgear.housing.two_way.harmonic_blocks",
    "femgear.housing.mesh_fluctuation": "femgear.housing.two_way.mesh_fluctuation",
    "femgear.housing.damping_passes": "femgear.housing.two_way.damping_passes",
    "femgear.housing.set_damping": "femgear.housing.two_way.set_damping",
    "femgear.housing.turn_stability": "femgear.housing.two_way.turn_stability",
    "femgear.housing.casing_files": "femgear.exchange.casing_files",
    "femgear.case.mistakes": "femgear.case.messages",
}
"""Former and new names; of a folder all its modules."""


_Callable = TypeVar("_Callable", bound=Callable)


class FormerNames:
    """Finder and loader of modules by their former names, for `sys.meta_path`."""

    @classmethod
    def find_spec(cls, name: str, path=None, target=None) -> Any:
        """Find a module by its former name."""
        if not name.startswith("femgear.") or (name not in _FOLDERS and _new_name(name) is None):
            return None
        return spec_from_loader(name, cls, is_package=name in _FOLDERS)  # type: ignore[arg-type]

    @classmethod
    def create_module(cls, spec) -> None:
        """Leave that to the machinery of imports."""

    @classmethod
    def exec_module(cls, module) -> None:
        """Put the module by its new name in the place of the former one."""
        former = module.__name__
        new = _new_name(former)
        if new is None:
            return
        warnings.warn(f"{former} is called {new} now", DeprecationWarning, stacklevel=2)
        sys.modules[former] = import_module(new)


def former_names(module: str, renamed: Mapping[str, object]) -> Callable[[str], object]:
    """Make the ``__getattr__`` of a module whose functions or classes had other names: what they are now by those."""

    def find(name: str) -> object:
        if name not in renamed:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        new = renamed[name]
        warnings.warn(f"{module}.{name} is called {new.__name__} now", DeprecationWarning, stacklevel=2)  # type: ignore[attr-defined]
        return new

    return find


def former_keywords(**renamed: str) -> Callable[[_Callable], _Callable]:
    """Decorate a function or a dataclass whose parameters had other names: it takes them by those too.

    ``renamed`` are the new names by the former ones.
    """

    def decorate(target: Any) -> Any:
        call: Any = target.__init__ if isinstance(target, type) else target

        @wraps(call)
        def with_new_names(*arguments: Any, **keywords: Any) -> Any:
            for former in renamed.keys() & keywords.keys():
                text = f"{former} of {target.__name__} is called {renamed[former]} now"
                warnings.warn(text, DeprecationWarning, stacklevel=2)
                keywords[renamed[former]] = keywords.pop(former)
            return call(*arguments, **keywords)

        if not isinstance(target, type):
            return with_new_names
        target.__init__ = with_new_names
        return target

    return decorate


def _new_name(former: str) -> str | None:
    """Find the new name of a module."""
    for old, new in MOVED.items():
        if former == old or former.startswith(f"{old}."):
            return new + former.removeprefix(old)
    return None


_FOLDERS = {name.rpartition(".")[0] for name in MOVED} - {"femgear.trains", "femgear.housing", "femgear.case"}
"""Folders that are no more."""
