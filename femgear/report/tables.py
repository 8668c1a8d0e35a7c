"""Titled tables for the terminal and the page, and those of modes and periodic responses."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.findings import CATALOGUE, NOTE, Finding, by_severity, findings_in, percent
from femgear.report.response import some_at_a_time, stored_harmonics
from femgear.report.style import NOTICEABLE
from femgear.system.fourier import fluctuation, sample

if TYPE_CHECKING:
    import xarray as xr

MANY = 8
"""Rows of a table that shows the speeds, and speeds that a warning names."""
WARNINGS = "Warnings"
"""Title of the table of findings."""
MARKS = "†‡§¶‖◊"
"""Marks of doubtful numbers, in the order of the findings that they stand for."""
RESPONSE_DOUBTS = "W-PULL", "W-CONVERGENCE", "W-UNSTABLE"
"""Findings of a periodic response that concern the numbers of the speeds at which they are."""
_MODES = 16
"""Rows of the table of modes."""
_NUMBERED = re.compile(r"(.*?)((?<![\d.])\d{1,9}(?![\d.]))?(\D*)", re.DOTALL)
"""A name with its last whole number."""
_WITHOUT_DIGITS = dict.fromkeys(map(ord, "0123456789"))
_NOTHING = 1e-3
"""Pull that is no more than the end of the harmonics, in mean mesh forces."""


@dataclass(frozen=True)
class Block:
    """A table under its ``title``, with notes.

    ``header`` names the columns, or is empty; ``rows`` are the cells as text, ``notes`` the lines under the table. One
    ``beside`` the point is printed where it is asked for alone.
    """

    title: str
    header: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()
    notes: tuple[str, ...] = ()
    beside: bool = False


def merged(rows: Sequence[Sequence[str]]) -> list[tuple[str, ...]]:
    """Join rows in succession that differ in a running number of their name alone: "sun-planet 1..3"."""
    groups = list[tuple[tuple[str, ...], str, int, int, str]]()
    for row in map(tuple, rows):
        head, number, tail = _NUMBERED.fullmatch(row[0] if row else "").groups()  # type: ignore[union-attr]
        last, value = groups[-1] if groups else None, int(number or -1)
        if last and number and last[1:] == (head, last[2], value - 1, tail) and last[0][1:] == row[1:]:
            groups[-1] = (*last[:3], value, tail)
        else:
            groups.append((row, head, value, value, tail))
    return [
        row if first == last else (f"{head}{first}..{last}{tail}", *row[1:]) for row, head, first, last, tail in groups
    ]


def merged_names(names: Iterable[str]) -> str:
    """List names, once those that differ in a running number alone: "sun-planet 1..3, planet 1..3-ring"."""
    groups = dict[str, list[str]]()
    for name in names:
        groups.setdefault(name.translate(_WITHOUT_DIGITS), []).append(name)
    return ", ".join(words for group in groups.values() for words in _with_ranges(group))


def _with_ranges(names: Sequence[str]) -> list[str]:
    """Join names of one form: by a number that stands several times in each, "short planet 1..3-long planet 1..3"."""
    numbers = [{int(digits) for digits in re.findall(r"\d+", name)} for name in names]
    first = min(min(inside, default=0) for inside in numbers)
    if len(names) > 1 and numbers == [{first + n} for n in range(len(names))]:
        return [re.sub(r"\d+", f"{first}..{first + len(names) - 1}", names[0])]
    return [words for (words,) in merged([(name,) for name in names])]


def tabulate(
    title: str,
    items: Iterable,
    columns: Mapping[str, Callable[[Any], str]],
    notes: Iterable[str] = (),
    marks: Marks | None = None,
) -> Block:
    """Make a table with a row for every item, its text in every column by the name of the column.

    What the marks mean that the columns have used stands under the table.
    """
    rows = tuple(tuple(text(item) for text in columns.values()) for item in items)
    return Block(title, tuple(columns), rows, (*notes, *(marks.notes if marks else ())))


def listed(findings: Iterable[Finding]) -> tuple[Block, ...]:
    """Tabulate which findings a run has, from the most severe, with their meanings; none without findings.

    Their texts, with the numbers, stand on standard error and on the page.
    """
    columns = {
        "": lambda finding: f"{finding.severity} {finding.code}".strip(),
        "of": lambda finding: finding.stage or "the case",
        "meaning": lambda finding: CATALOGUE[finding.code].sentence if finding.code else finding.text,
    }
    block = tabulate(WARNINGS, by_severity(findings), columns)
    return (replace(block, rows=tuple(dict.fromkeys(block.rows))),) if block.rows else ()


class Marks:
    """Marks of the numbers of a table that findings of severity doubt or fault concern.

    ``marks(text, "W-PRESSURE")`` is the text of a number with a mark where the finding was raised, as in
    "4573.4†". The mark of a code follows from its place among the findings, so that one stands for the same in all
    texts and tables of the same findings. `notes` tells under the table what the marks mean. A number of which only
    a bound is known, or none at all, is written so by who writes it: ``marks.raised`` tells whether there is such a
    finding.

    Parameters
    ----------
    findings : iterable of Finding
        Of the stages that the numbers come from, and of the case.
    run : iterable of Finding
        Of the whole run, in whose order the marks are, so that those of all its tables are the same.
    """

    def __init__(self, findings: Iterable[Finding], run: Iterable[Finding] = ()) -> None:
        severe = [finding for finding in findings if finding.severity != NOTE]
        of_run = [finding.code for finding in run if finding.severity != NOTE]
        self._known = dict[str, list[Finding]]((code, []) for code in (*of_run, *(each.code for each in severe)))
        for finding in severe:
            self._known[finding.code].append(finding)
        self._marks = {code: MARKS[n % len(MARKS)] * (n // len(MARKS) + 1) for n, code in enumerate(self._known)}
        self._used = set[str]()

    def raised(self, *codes: str, of: tuple[str, ...] = ()) -> bool:
        """Tell whether one of some findings was raised, by the case, or by the stages ``of`` if given."""
        findings = (finding for code in codes for finding in self._known.get(code, ()))
        return any(not of or finding.stage in ("", *of) for finding in findings)

    def __call__(self, text: str, *codes: str, of: tuple[str, ...] = ()) -> str:
        """Mark the text of a number that findings of these codes concern; a dash needs no mark.

        ``of`` are the stages whose findings concern it, beside those of the case, where not all do.
        """
        if not text.strip("-"):
            return text
        raised = [code for code in self._known if code in codes and self.raised(code, of=of)]
        self._used.update(raised)
        return text + "".join(self._marks[code] for code in raised)

    @property
    def words(self) -> tuple[str, ...]:
        """The marks that were used with few words, where there is no room for `notes`."""
        return tuple(f"{mark} {CATALOGUE[code].words}" for code, mark in self._marks.items() if code in self._used)

    @property
    def notes(self) -> tuple[str, ...]:
        """What the marks that were used mean."""
        return tuple(
            f"{mark} {code}, {self._known[code][0].severity}: {CATALOGUE[code].sentence}"
            for code, mark in self._marks.items()
            if code in self._used
        )


def significant(value: float, places: int) -> str:
    """Write a number with so many decimal places, and with four digits where these would not show it."""
    return f"{value:.4g}" if 0.0 < abs(value) < 10.0 ** (1 - places) else f"{value:.{places}f}"


def lower_bound(value: float) -> str:
    """Write a positive number of which only a lower bound is known, with one digit: "> 0.005" of 0.0053."""
    unit = 10.0 ** np.floor(np.log10(value)) if value > 0.0 else 1.0
    digit = np.floor(value / unit * (1.0 + 1e-12)) * unit
    # %g has exponents from ten on where one digit is asked for
    return f"> {digit:.1g}" if digit < 10.0 else f"> {digit:.0f}"


def level_change_at(data: xr.Dataset, speed) -> np.ndarray:
    """Find what a longer excitation changes the level of runup.nc [dB] at speeds (...) [rpm], NaN unknown.

    Between the speeds that were looked at on a straight line.
    """
    change = data["level_change"].values if "level_change" in data else np.full(data.sizes["speed"], np.nan)
    finite = np.isfinite(change)
    if not finite.any():
        return np.full(np.shape(speed), np.nan)
    return np.interp(speed, data["speed"].values[finite], change[finite])


def shown_level(
    value: float, change: float, marks: Marks, *codes: str, of: tuple[str, ...] = (), digits: int = 4
) -> str:
    """Write a level, a bound where a longer excitation raises it by much, marked where it is doubtful.

    ``codes`` are those of further findings that concern it, ``of`` the stages whose findings do.
    """
    if change >= NOTICEABLE:
        return marks(lower_bound(value), *(code for code in codes if code != "W-EXCITATION"), of=of)
    text = f"{value:,.0f}" if value >= 10.0**digits else f"{value:.{digits}g}"  # no exponents
    return marks(text, *doubtful_excitation(change), *codes, of=of)


def doubtful_excitation(change: float) -> tuple[str, ...]:
    """Codes of the findings that concern numbers at a speed whose level a longer excitation changes [dB]."""
    return () if abs(change) < NOTICEABLE else ("W-EXCITATION",)


def in_decibels(change: float) -> str:
    """Write how far a level is from another [dB], to a tenth."""
    return "below 0.05 dB" if abs(change) < 0.05 else f"{change:+.1f} dB"


def is_bound(text: str) -> bool:
    """Tell whether the text of a number is that of `lower_bound`."""
    return text.startswith("> ")


def unmarked(text: str) -> str:
    """Take the marks of `Marks`, and that of a lower bound, off the text of a number."""
    return text.rstrip(MARKS).removeprefix("> ")


def describe_modes(
    data: xr.Dataset,
    more: Mapping[str, Callable[[xr.Dataset], str]] | None = None,
    *,
    digits: int = 2,
    note: str = "",
) -> Block:
    """Tabulate natural frequencies and kinds of the first modes of modes.nc.

    The file has ``frequency`` [Hz], written with so many digits behind the point, and ``kind`` (mode,). The
    further columns, nodal diameters when not given, make the text of a mode from its part of the file; the
    note stands behind the number of modes.
    """
    count, shown = data.sizes["mode"], min(data.sizes["mode"], _MODES)
    columns = {
        "mode": lambda i: str(i + 1),
        "frequency [Hz]": lambda i: f"{float(data.frequency[i]):.{digits}f}",
        "kind": lambda i: str(data.kind.values[i]),
    }
    for name, text in (more or {"nodal diameters": _nodal_diameters}).items():
        columns[name] = lambda i, text=text: text(data.isel(mode=i))
    note_ = f"{count} modes up to {float(data.frequency.max()):.0f} Hz, the first {shown} shown"
    return tabulate("Modes", range(shown), columns, (note_ + note,))


def _nodal_diameters(mode: xr.Dataset) -> str:
    """Write the nodal diameters of the ring in a mode, a dash where it is rigid."""
    return "-" if mode.nodal_diameter < 0 else str(int(mode.nodal_diameter))


def describe_response(data: xr.Dataset, run: Iterable[Finding] = ()) -> Block:
    """Tabulate transmission error [um], convergence and stability at the speeds [rpm] of dynamics.nc.

    The file has ``dte_real`` and ``dte_imag`` (speed, mesh, harmonic) [m] and, for every speed, what
    `femgear.storage.results.response_variables` lists; of many speeds the first and the last are shown. The findings
    of the whole ``run`` give the order of the marks.
    """
    largest, marks = np.abs(data.floquet_multiplier.values), Marks(findings_in(data.attrs), run)

    def dte(i: int) -> str:
        of_speed = data.isel(speed=i)
        doubts = response_doubts(of_speed) if marks.raised(*RESPONSE_DOUBTS) else ()
        return marks(
            f"{fluctuation(stored_harmonics(of_speed, 'dte')).max() * 1e6:.4f}", *doubts, "W-DAMPING", "W-FRICTION"
        )

    stable = data.stable.values.astype(bool)
    columns = {
        "speed [rpm]": lambda i: f"{float(data.speed[i]):.2f}",
        "mesh [Hz]": lambda i: f"{float(data.mesh_frequency[i]):.2f}",
        "excited up to [kHz]": lambda i: f"{data.excitation_limit.values[i] / 1e3:.2f}",
        "DTE rms [um]": dte,
        "method": lambda i: str(data.method.values[i]),
        "iterations": lambda i: str(int(data.iterations[i])),
        "radius": lambda i: f"{float(data.spectral_radius[i]):.4f}",
        "Floquet": lambda i: f"{largest[i]:.4f}",
        "converged": lambda i: "yes" if bool(data.converged[i]) else "NO",
    }
    if "excitation_limit" not in data:
        # helical cases are excited by a number of harmonics
        del columns["excited up to [kHz]"]
    notes = [
        "DTE rms: dynamic transmission error about its mean, largest of all meshes; radius: by what a step "
        "of the fixed point multiplies the error (iterations: number of steps), which contracts below 1; "
        "direct solutions (method) need no contraction",
        "Floquet: largest growth of a disturbance in a period, stable up to 1 (exactly 1 without damping)",
        f"{int(data.converged.sum())} of {len(stable)} speeds converged, {int(stable.sum())} stable",
    ]
    if "level_change" in data:
        change = np.abs(data.level_change.values)
        notes.append(
            f"level of the housing with excitation up to {data.attrs['compared_to'] / 1e3:.4g} kHz: "
            f"{np.nanmax(change):.2g} dB away at most, at {int(np.isfinite(change).sum())} speeds looked at"
        )
    return tabulate("Dynamics", chosen(data.sizes["speed"]), columns, notes, marks)


def response_doubts(data: xr.Dataset) -> tuple[str, ...]:
    """Codes of the findings that concern the response at one speed, of dynamics.nc."""
    pulling = pulls_of(stored_harmonics(data, "mesh_force")[None])[1].any()
    doubts = zip(RESPONSE_DOUBTS, (pulling, not data["converged"], not data["stable"]))
    return tuple(code for code, doubtful in doubts if doubtful)


def chosen(count: int) -> Iterator[int]:
    """Choose all indices of a short list, the first and last of a long one."""
    return (i for i in range(count) if count <= MANY or i < MANY // 2 or i >= count - MANY // 2)


def response_warnings(data: xr.Dataset) -> Iterator[Finding]:
    """Name the speeds [rpm] of dynamics.nc at which meshes pull, and those not converged or not stable."""
    speed = data["speed"].values
    pulls = [pulls_of(stored_harmonics(block, "mesh_force")) for block in some_at_a_time(data)]
    yield from pulling_meshes(speed, data["mesh"].values, pulls)
    for code, bad, text in (
        ("W-CONVERGENCE", ~data["converged"].values.astype(bool), "did not converge at"),
        ("W-UNSTABLE", ~data["stable"].values.astype(bool), "is unstable at"),
    ):
        if bad.any():
            rest = np.count_nonzero(bad) - MANY
            more = f" and {rest} more speeds" if rest > 0 else ""
            yield Finding(code, "operation.speeds", f"the periodic solution {text} {first_speeds(speed[bad])}{more}")


def pulls_of(forces: np.ndarray) -> np.ndarray:
    """Find the lowest force [N] and the share of the time with a pull, (2, n_speeds, n_meshes).

    Of harmonics (n_speeds, n_meshes, H + 1) of mesh forces [N], whose springs know no contact loss.
    """
    record = sample(forces, 4 * forces.shape[-1])
    nothing = _NOTHING * np.abs(forces[..., 0]).max(axis=1)[:, None, None]
    return np.stack([record.min(axis=-1), (record < -nothing).mean(axis=-1)])


def pulling_meshes(rpm, names, pulls: Sequence[np.ndarray]) -> Iterator[Finding]:
    """Warn where the force of a mesh turns into a pull.

    Of speeds of the input (n_speeds,) [rpm] the first ones are known: ``pulls``, from `pulls_of`, are those
    of some speeds after the other.
    """
    least, share = np.concatenate(pulls, axis=1)
    pulling, rpm = share.any(axis=1), rpm[: len(share)]
    if pulling.any():
        s = int(np.nanargmin(least.min(axis=1)))
        more = f"; meshes pull at {pulling.sum()} of the {len(rpm)} speeds: {first_speeds(rpm[pulling])}"
        remedy = "raise the damping, leave these speeds out, or let meshes lose contact in a section [planar]"
        yield pull(f"at {rpm[s]:.6g} rpm", names, least[s], share[s], more=more, remedy=remedy)


def pull(where: str, names, least, share, *, more: str = "", remedy: str) -> Finding:
    """Make the warning of forces of linear meshes that turn into pulls (W-PULL), with the largest of them.

    Parameters
    ----------
    where : str
        Speed or variant at which they do.
    names, least, share : (n_meshes,) arrays
        Names of the meshes, their lowest forces [N] and shares of the time with a pull.
    more : str
        What else is to be said of it.
    """
    mesh = int(np.argmin(least))
    text = (
        f"{where}: {names[mesh]} pulls for {percent(share[mesh], 2)} of the time, with up to "
        f"{-1e-3 * least[mesh]:.4g} kN: real teeth would part{more}"
    )
    return Finding("W-PULL", "", text, remedy=remedy)


def first_speeds(speeds: np.ndarray) -> str:
    """Write the first of some speeds (p,) [rpm], as many as a warning names."""
    return ", ".join(f"{value:.6g}" for value in speeds[:MANY]) + " rpm"
