"""The program that commands belong to, and the kinds of options that several of them have."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from cyclopts import App, Parameter

import femgear
from femgear.errors import CaseError


def shown_default(value: Any) -> Any:
    """Write the default of an option for its help; None for flags that are off and empty lists, which show none."""
    if isinstance(value, tuple):
        return ", ".join(str(entry) for entry in value) or None
    return None if value is None or value is False else str(value)


app = App(
    name="femgear",
    default_parameter=Parameter(show_default=shown_default),
    version=lambda: femgear.__version__,
    help="Gear sets and gearboxes: from tooth geometry to the vibration and the sound at the housing.",
    help_format="plaintext",
    suppress_keyboard_interrupt=False,
)


def examples(*lines: str) -> str:
    """Write whole commands to be copied, for the end of the help of a command; a line that begins with # explains."""
    return "\n".join(["Examples:", *(f"  {line}" for line in lines)])


Quantity = Annotated[str, Parameter(allow_leading_hyphen=True)]
"""A number with its unit, which may be negative."""


def whole_number(text: str, key: str) -> int:
    """Read a whole number; 27.5 is none, and is not rounded (CaseError, E-TYPE)."""
    if re.fullmatch(r"\s*[+-]?\d+(\.0*)?\s*", text):
        return int(text.partition(".")[0])
    raise CaseError(f"{text!r} is no whole number", code="E-TYPE", key=key, value=text, limit="whole numbers")


def _convert_whole(_: Any, tokens: Sequence[Any]) -> int:
    """Whole number of an option; what cyclopts would round is refused."""
    return whole_number(tokens[0].value, tokens[0].keyword or "")


Whole = Annotated[int, Parameter(converter=_convert_whole)]
"""A whole number; 27.5 is refused, not rounded."""


@Parameter(name="*")
@dataclass(frozen=True)
class Tasks:
    """What computes the tasks of a command.

    Parameters
    ----------
    workers
        Processes of this machine that compute.
    cluster
        Dask scheduler whose workers compute: tcp://host:port or tls://host:port (docs/cluster.md).
    """

    workers: Whole = 1
    cluster: str | None = None
