"""One line of the validation tables, and its verdict."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal

# Below this relative (or, for a zero reference, absolute) size an error is rounding and is not printed.
ROUNDING = 1e-12
# computes references again that stand as printed numbers in the functions of the tables
REPEATED = "tests/validation/test_printed_references.py"


@dataclass(frozen=True)
class Row:
    """A number that femgear computed beside one that it did not.

    Parameters
    ----------
    case : str
        Short identifier, such as ``"D2"``.
    source : str
        Where the reference comes from.
    quantity : str
        What is compared, with its unit.
    reference : float or None
        The reference; None when the row states an upper limit of a quantity that should vanish.
    ours : float
        The value computed now.
    gate : float or None
        Largest error that passes; None when the row is only information.
    relative : bool
        Whether error and gate are relative to the reference.
    shown : str
        The reference as its source prints it; empty to print the number.
    note : str
        Remark.
    explanation : str
        Why the reference is expected to differ; turns a failed gate into the verdict ``"differs"``.
    """

    case: str
    source: str
    quantity: str
    reference: float | None
    ours: float
    gate: float | None
    relative: bool = True
    shown: str = ""
    note: str = ""
    explanation: str = ""

    @property
    def error(self) -> float:
        """Signed error, relative when `relative` is set and the reference is not zero."""
        if self.reference is None:
            return float(self.ours)
        difference = float(self.ours) - float(self.reference)
        return difference / abs(self.reference) if self.relative and self.reference else difference

    @property
    def verdict(self) -> str:
        """``"passes"``, ``"FAILS"``, ``"differs"`` (fails, with an explanation) or ``"information"``."""
        if self.gate is None:
            return "information"
        if abs(self.error) <= self.gate:
            return "passes"
        return "differs" if self.explanation else "FAILS"


def printed(
    case: str,
    source: str,
    quantity: str,
    reference: str,
    ours: float,
    *,
    digits: float = 1.0,
    note: str = "",
    explanation: str = "",
) -> Row:
    """Compare with a number as printed: the gate is `digits` half units of its last place.

    Parameters
    ----------
    case, source, quantity : str
        See `Row`.
    reference : str
        The number as its source prints it, such as ``"1.5507"`` or ``"2.1e-4"``.
    ours : float
        The value computed now.
    digits : float
        How many half units of the last printed place are allowed; rounding of double precision
        (4e-15 relative) is always allowed.
    note, explanation : str
        See `Row`.

    Returns
    -------
    Row
    """
    value = float(reference)
    half_unit = 0.5 * 10.0 ** int(Decimal(reference).as_tuple().exponent)
    gate = max(digits * half_unit * (1 + 1e-9), 4e-15 * abs(value))
    return Row(case, source, quantity, value, float(ours), gate, False, reference, note, explanation)


def within(
    case: str,
    source: str,
    quantity: str,
    reference: float,
    ours: float,
    gate: float,
    *,
    relative: bool = True,
    note: str = "",
    explanation: str = "",
) -> Row:
    """Compare with a reference within a gate, relative unless said otherwise; see `Row`."""
    return Row(case, source, quantity, float(reference), float(ours), gate, relative, "", note, explanation)


def at_most(
    case: str, source: str, quantity: str, limit: float, ours: float, *, note: str = "", explanation: str = ""
) -> Row:
    """State that the size of a quantity stays below a limit; see `Row`."""
    return Row(case, source, quantity, None, float(ours), limit, False, "", note, explanation)


def counted(
    case: str, source: str, quantity: str, reference: int, ours: int, *, note: str = "", explanation: str = ""
) -> Row:
    """Compare whole numbers (or yes as 1 and no as 0), exactly; see `Row`."""
    return Row(case, source, quantity, int(reference), int(ours), 0.0, False, "", note, explanation)


def information(case: str, source: str, quantity: str, reference: float | None, ours: float, *, note: str = "") -> Row:
    """Show two numbers side by side without a gate; see `Row`."""
    return Row(case, source, quantity, reference, float(ours), None, True, "", note)
