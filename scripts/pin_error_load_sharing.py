#!/usr/bin/env python3
"""Distribution of the load sharing factor over random errors of the planet pins."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Annotated, Literal

import numpy as np
from cyclopts import Parameter
from script_tools import REFERENCE_CASE, Progress, print_table, ready_folder, run_script, say_files, write_csv

from femgear.errors import CaseError
from femgear.findings import percent

FILES = ("load_sharing_samples.csv", "load_sharing_histogram.png")
QUANTILES = (0.5, 0.9, 0.99)
_POSITIONS = 16
"""Of one mesh period."""
Length = Annotated[str, Parameter(allow_leading_hyphen=True)]


def main(
    case: Path = REFERENCE_CASE,
    /,
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/pin_error_load_sharing"),
    tangential: Length = "3 um",
    radial: Length = "3 um",
    tolerance: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    support: Annotated[
        tuple[Literal["fixed", "floating", "case"], ...], Parameter(negative="", consume_multiple=True)
    ] = ("fixed", "floating", "case"),
    samples: int = 10000,
    seed: int = 1,
    position: float = 0.0,
) -> None:
    """Draw pin errors and solve the load sharing of each sample: tables, a histogram and a CSV file.

    A second table has the linear sensitivity of the shares to single pins, and the spread of the shares that
    follows from it beside that of the samples; they part where planets open.

    Parameters
    ----------
    case
        TOML case file; the reference set when left out. The errors add to those of the case.
    output
        Folder of the results.
    tangential, radial
        Standard deviations of the normally distributed errors of every pin, with their unit; three of them
        at most 0.2 modules.
    tolerance
        Tolerance of the pins in both directions, plus or minus: three standard deviations, at most 0.2
        modules.
    support
        All members fixed, the sun floating with all others fixed, or the stiffnesses of the case.
    samples
        Number of samples.
    seed
        Of the random numbers; the same seed draws the same errors.
    position
        In mesh periods, 0 to 1, rounded to a sixteenth.
    """
    from femgear.case.gear_set import need_set, planetary_set
    from femgear.case.quantities import LENGTH, to_si
    from femgear.report.style import save_figure
    from femgear.run import grid_cache
    from femgear.study.relief import design_basis, sun_torque
    from femgear.study.samples import checked
    from femgear.trains.reading import read_case

    data = read_case(case)
    need_set(data)
    gears = planetary_set(data)
    torque = sun_torque(data, gears)
    given = {"--radial": radial, "--tangential": tangential}
    given = given if tolerance is None else {"--tolerance": tolerance}
    parts = 1 if tolerance is None else 3
    _check(given, {key: to_si(text, LENGTH) for key, text in given.items()}, parts, data.sun.module)
    _check_place(seed, position)
    sigma = [to_si(text, LENGTH) / parts for text in given.values()] * (2 // len(given))
    checked(samples, "--samples", 1, 1_000_000)
    place = round(position * _POSITIONS) % _POSITIONS
    folder = ready_folder(output, FILES)
    with Progress() as progress:
        progress("compliance", 0, 1)
        basis = replace(design_basis(data, cache=grid_cache()), positions=_POSITIONS)
        progress("compliance", 1, 1)
        results = []
        for kind in dict.fromkeys(support):
            progress(kind, 0, 1)
            pins, *results_of_kind = _solve(data, basis, kind, torque, place, sigma, samples, seed)
            results.append((kind, *results_of_kind))
            progress(kind, 1, 1)
    names = {"fixed": "all members fixed", "floating": "floating sun", "case": "supports of the case"}
    _print_summary(results, names, pins, sigma, seed)
    _print_sensitivities(results, names, sigma)
    write_csv(folder / "load_sharing_samples.csv", _header(results, gears.n_planets), _records(results, pins))
    factors = [sharing.factor for _, sharing, _ in results]
    figure = sharing_histogram(factors, [names[kind] for kind, *_ in results], gears.n_planets)
    save_figure(figure, folder / "load_sharing_histogram.png")
    say_files(folder, FILES)


def _check(texts, lengths, parts: int, module: float) -> None:
    """Refuse lengths that are negative or put three standard deviations over what a case file takes.

    ``parts`` is the number of standard deviations in a length.
    """
    from femgear.gears.modifications import LARGEST_DEVIATION

    most = LARGEST_DEVIATION * module * parts / 3
    for key, length in lengths.items():
        if not 0 <= length <= most:
            wrong = "cannot be negative" if length < 0 else "is not plausible"
            raise CaseError(
                f"the spread of the pins {wrong}",
                code="E-RANGE",
                key=key,
                value=texts[key],
                limit=f"0 to {most * 1e6:.6g} um (three standard deviations: {LARGEST_DEVIATION} modules)",
                remedy="give a manufacturing tolerance, a few micrometres",
            )


def _check_place(seed: int, position: float) -> None:
    if seed < 0:
        raise CaseError("a seed cannot be negative", code="E-RANGE", key="--seed", value=seed)
    if not 0 <= position <= 1:
        raise CaseError("no such position", code="E-RANGE", key="--position", value=position, limit="0 to 1")


@dataclass(frozen=True)
class Sharing:
    """Shares (S, N) of the planets in the torque of every sample."""

    share: np.ndarray

    @property
    def factor(self) -> np.ndarray:
        """Load sharing factor K_gamma = N max share (mesh load factor of ISO 6336-1), (S,)."""
        return self.share.shape[1] * self.share.max(axis=1)

    @property
    def open_planets(self) -> np.ndarray:
        """Planets without load, (S, N)."""
        return self.share <= 0.0


def _solve(data, basis, kind, torque, place, sigma, samples, seed):
    """Pins (S, N, 2) [m] and load sharing of all samples, how some differ exactly, sensitivities."""
    from femgear.contact.supports import RIGID, Supports
    from femgear.stages.static import case_supports
    from femgear.study.samples import Tolerances, exact_numbers, sample_model, spring_numbers
    from femgear.study.sensitivity import linearise, pin_differences, pin_sensitivities

    supports = {"fixed": RIGID, "floating": Supports(sun=0.0), "case": case_supports(data)}[kind]
    basis = replace(basis, supports=supports)
    laws = [{"distribution": "normal", "sigma": f"{value!r} m"} for value in sigma]
    tolerances = Tolerances.model_validate({"pin_errors": dict(zip(("radial", "tangential"), laws))})
    begin = perf_counter()
    at = np.array([place / _POSITIONS])
    model = sample_model(basis, tolerances, sun_torque=torque, positions=at)
    curves = perf_counter()
    errors = model.draw(seed, 0, samples)
    solve = exact_numbers if model.walked else spring_numbers
    sharing = Sharing(solve(model, errors)["planet_share"])
    solved = perf_counter()
    # a few of the first, the middle and the worst
    order = np.argsort(sharing.factor)
    chosen = np.unique([0, samples // 3, order[samples // 2], order[-1]])
    whole = exact_numbers(model, errors[chosen])["planet_share"]
    difference = np.abs(whole - sharing.share[chosen]).max()
    if basis.over or model.walked:  # derivatives are those of the plane contact of drive flanks
        slopes = pin_differences(basis, sun_torque=torque, position=float(at[0]))
    else:
        slopes = pin_sensitivities(linearise(basis, sun_torque=torque, only=[place]))[..., 0]
    facts = {
        "curves": curves - begin,
        "samples": solved - curves,
        "difference": difference,
        "checked": len(chosen),
        "sensitivity": slopes,
    }
    return np.moveaxis(errors.reshape(samples, 2, -1), 1, 2), sharing, facts


def _header(results, n_planets):
    pins = [f"{way} error of pin {n + 1} [m]" for n in range(n_planets) for way in ("radial", "tangential")]
    factors = [f"load sharing factor, {kind} [1]" for kind, *_ in results]
    shares = [f"share of planet {n + 1}, {kind} [1]" for kind, *_ in results for n in range(n_planets)]
    return ("sample", *pins, *factors, *shares)


def _records(results, pins):
    flat = pins.reshape(len(pins), -1)
    factors = np.column_stack([sharing.factor for _, sharing, _ in results])
    shares = np.hstack([sharing.share for _, sharing, _ in results])
    for i, row in enumerate(np.hstack([flat, factors, shares]).tolist()):
        yield i + 1, *row


def _print_summary(results, names, pins, sigma, seed):
    rows, notes = [], []
    for kind, sharing, facts in results:
        factor = sharing.factor
        numbers = [factor.mean(), *np.quantile(factor, QUANTILES), factor.max()]
        opened = sharing.open_planets.any(axis=1).mean()
        rows.append((names[kind], *(f"{v:.4f}" for v in numbers), percent(opened, 2)))
        notes.append(
            f"{names[kind]}: curves {facts['curves']:.2f} s, samples {facts['samples']:.2f} s; "
            f"{facts['checked']} samples by the whole contact problem differ by {facts['difference']:.1e} of "
            "the torque"
        )
    header = ("supports", "mean", *(percent(q) for q in QUANTILES), "largest", "a planet opens")
    title = (
        f"Load sharing factor, {len(pins)} samples, seed {seed}; standard deviations {sigma[0] * 1e6:g} um "
        f"radial, {sigma[1] * 1e6:g} um tangential"
    )
    print_table(title, header, rows)
    for note in notes:
        print(note)


def _print_sensitivities(results, names, sigma):
    """Change of shares per micrometre at single pins, and the spread they give to the shares."""
    rows = []
    for kind, sharing, facts in results:
        slopes = facts["sensitivity"]
        own_pin = slopes[np.arange(len(slopes)), np.arange(len(slopes))]
        others = slopes[~np.eye(len(slopes), dtype=bool)]
        mean = [own_pin[:, 1].mean(), own_pin[:, 0].mean()]
        mean += [others[:, 1].mean(), others[:, 0].mean()] if len(others) else [0.0, 0.0]
        spread = np.sqrt(((slopes * sigma) ** 2).sum(axis=(1, 2))).mean(), sharing.share.std(axis=0).mean()
        values = [f"{round(1e-4 * m, 4) + 0.0:+.4f}" for m in mean] + [f"{100 * s:.3f}" for s in spread]
        rows.append((names[kind], *values))
    header = (
        "supports",
        "own pin tangential",
        "radial",
        "another pin tangential",
        "radial",
        "spread, linear [%]",
        "of the samples [%]",
    )
    print_table("Linear sensitivity of a planet's share, in % of the torque per um, mean of all planets", header, rows)


def sharing_histogram(factors, names, n_planets: int):
    """Distribution of the load sharing factor, one step curve a support.

    Parameters
    ----------
    factors : sequence of (S,) arrays
        K_gamma of every sample.
    names : sequence of str
    n_planets : int
        The largest factor there can be.
    """
    from femgear.report.style import label, legend_below, line_style, new_figure

    figure, (left, right) = new_figure(columns=2, width=10.0, height=4.4)
    top = min(max(float(np.max(f)) for f in factors) * 1.02 + 0.02, float(n_planets) + 0.02)
    edges = np.linspace(0.99, max(top, 1.05), 80)
    for i, (factor, name) in enumerate(zip(factors, names)):
        share, name = 100.0 / len(factor), f"{name}: 95 % below {np.quantile(factor, 0.95):.3f}"
        left.hist(factor, edges, weights=np.full(len(factor), share), histtype="step", label=name, **line_style(i))
        ordered = np.sort(factor)
        beyond = 100.0 * (1.0 - np.arange(1, len(ordered) + 1) / len(ordered))
        right.step(ordered, beyond, where="post", **line_style(i))
    label(left, "load sharing factor $K_\\gamma$ [1]", "samples [%]", "distribution")
    label(right, "load sharing factor $K_\\gamma$ [1]", "samples beyond [%]", "probability to exceed")
    for ax in (left, right):
        ax.set_xlim(edges[0], edges[-1])
    # narrow and wide distributions side by side
    left.set_yscale("log")
    right.set_ylim(bottom=0)
    legend_below(figure)
    return figure


if __name__ == "__main__":
    sys.exit(run_script(main))
