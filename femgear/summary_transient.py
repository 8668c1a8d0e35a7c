"""What the motion of a drivetrain says against itself."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

# The step rule keeps energy and momentum exactly: more is rounding that grew, or a motion that runs away.
_BALANCE = 1e-6
# Linear meshes: a free motion that grows by more than this over a run is no longer small.
GROWN = 10.0
# The same between any two instants of it.
_GAINED = 1e3
# A force that is rounding [N].
_NOTHING = 1e-6


def transient_warnings(data: xr.Dataset) -> Iterator[str]:
    """What transient.nc says against itself."""
    pulling, least = data["pulling"].values, data["least_force"].values
    for v, variant in enumerate(data["variant"].values):
        if pulling[v].any() and least[v].min() < -_NOTHING and not separating(data):
            worst, lowest = int(np.argmax(pulling[v])), int(np.argmin(least[v]))
            beside = "" if lowest == worst else f" {data['mesh'].values[lowest]}"
            yield (
                f"[W-PULL] {variant}: {data['mesh'].values[worst]} pulls for {pulling[v, worst]:.2%} of the "
                f"time,{beside} with up to "
                f"{-1e-3 * least[v, lowest]:.4g} kN: real teeth would part (simulation.contact_loss)"
            )
    yield from _parted_warnings(data)
    yield from _growth_warnings(data)
    for name, words in (("energy_error", "energy"), ("momentum_error", "angular momentum")):
        if not (error := float(data[name].max())) <= _BALANCE:
            yield f"[W-BALANCE] the balance of {words} misses {error:.1e} of its largest term"


def _parted_warnings(data: xr.Dataset) -> Iterator[str]:
    """Meshes whose flanks are apart at every step."""
    if not separating(data):
        return
    meshes = data["mesh"].values
    for variant, lost in zip(data["variant"].values, data["lost"].values):
        if names := [str(mesh) for mesh, share in zip(meshes, lost) if share >= 1.0]:
            yield (
                f"[W-PARTED] {variant}: the teeth of {', '.join(names)} never touch and transmit nothing; "
                "give torques or a start that close the flanks"
            )


def _growth_warnings(data: xr.Dataset) -> Iterator[str]:
    if separating(data):
        yield from _chaos_warnings(data)
        return
    duration, gains = float(data.attrs["steps"]) * float(data.attrs["step"]), largest_gains(data)
    pulls = data["least_force"].values.min(axis=1, initial=0.0) < -_NOTHING
    for (variant, rate), pulled in zip(growth_rates(data), pulls):
        gain = gains.get(variant, math.nan)
        if rate * duration > math.log(GROWN):
            times = shown_factor(rate * duration / math.log(10.0))
            found = f"grows with {rate:.4g} 1/s, {times} times over the run"
        elif gain > _GAINED:
            way = "grows slowly" if rate > 0.0 else "decays"
            found = f"{way} in the mean, but grows {shown_factor(math.log10(gain))} times on the way"
        else:
            continue
        senseless = gain > _GAINED and pulled
        yield (
            f"[W-GROWTH] {variant}: the free motion {found}: a parametric resonance"
            f"{'; these forces mean nothing: real teeth part long before' if senseless else ''}; give more "
            "damping or another speed, or contact_loss = true"
        )


def _chaos_warnings(data: xr.Dataset) -> Iterator[str]:
    """Motions with contact loss that depend on every detail, steps included."""
    duration = float(data.attrs["steps"]) * float(data.attrs["step"])
    for variant, rate in growth_rates(data):
        if rate * duration > math.log(GROWN):
            yield (
                f"[W-CHAOS] {variant}: neighbouring motions move apart with {rate:.4g} 1/s: times of contact "
                "and peaks depend on every detail, the steps included; compare two values of simulation.rate"
            )


def separating(data: xr.Dataset) -> bool:
    """Whether the meshes of transient.nc lose contact."""
    return data.attrs.get("contact", "linear") == "separating"


def growth_rates(data: xr.Dataset) -> Iterator[tuple[str, float]]:
    """Variants and the rates of their free motions [1/s]; results of earlier runs have none."""
    if "growth" in data:
        yield from zip(map(str, data["variant"].values), map(float, data["growth"].values))


def largest_gains(data: xr.Dataset) -> dict[str, float]:
    """Largest growth of the free motion within the run, by variant; results of earlier runs have none."""
    if "gain" not in data:
        return {}
    return dict(zip(map(str, data["variant"].values), map(float, data["gain"].values)))


def shown_factor(power: float) -> str:
    """Ten to a power that may be beyond all numbers."""
    return f"{10.0**power:.3g}" if power < 300.0 else f"1e{power:.0f}" if math.isfinite(power) else "1e308"
