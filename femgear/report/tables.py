"""A titled table, for the terminal and the report."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Block:
    """A titled table with notes under it.

    Parameters
    ----------
    title : str
    header : tuple of str
        Names of the columns, or empty.
    rows : tuple of tuple of str
    notes : tuple of str
    """

    title: str
    header: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()
    notes: tuple[str, ...] = ()
