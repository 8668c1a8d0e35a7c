"""Names that stay apart where two stages join the same bodies."""

from __future__ import annotations

from collections.abc import Sequence


def numbered(names: Sequence[str]) -> list[str]:
    """Names in their order; one that was there before gets the next free number: ``a-b``, ``a-b 2``."""
    found: list[str] = []
    for name in names:
        number, text = 1, name
        while text in found:
            number += 1
            text = f"{name} {number}"
        found.append(text)
    return found
