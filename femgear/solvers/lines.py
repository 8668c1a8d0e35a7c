"""Lines of a spectrum over one or several base frequencies: the combinations ``orders . omega`` kept."""

from __future__ import annotations

import numpy as np

from femgear.errors import CaseError

# Fluctuation, relative to the mean, below which there is none.
_ROUNDING = 1e-12
# Difference of two line frequencies, relative to the highest one, below which they are one.
_COINCIDE = 1e-9


def harmonic_lines(harmonics: int, bases: int = 1) -> np.ndarray:
    """Mean and all combinations with ``sum_b |orders_b| <= harmonics``, no line twice.

    Parameters
    ----------
    harmonics : int
        Highest harmonic; with several bases the highest sum of orders.
    bases : int
        Number of base frequencies.

    Returns
    -------
    (L, bases) int array
        Line 0 is the mean; of a line and its mirror image only the one whose last order that is not zero is
        positive.
    """
    if int(harmonics) != harmonics or harmonics < 0 or bases < 1:
        raise CaseError(
            f"{harmonics} harmonics of {bases} base frequencies", code="E-HARMONICS",
            limit="whole numbers, at least one base frequency",
        )  # fmt: skip
    axes = np.meshgrid(*[np.arange(-harmonics, harmonics + 1)] * bases, indexing="ij")
    orders = np.stack([axis.ravel() for axis in axes], axis=1)
    return distinct_lines(orders[np.abs(orders).sum(axis=1) <= harmonics])


def side_bands(carrier: int, mesh: int, bands: int) -> np.ndarray:
    """Lines of the extended harmonic balance: carrier harmonics, mesh harmonics and their side bands.

    ``m omega_1`` (m <= carrier), ``n omega_2`` (n <= mesh) and ``n omega_2 +- q omega_1`` (q <= bands), with
    the carrier frequency first and the mesh frequency second (Guo, Keller and Parker, NREL/CP-5000-55355,
    Eqs. 2-13; Eur. J. Mech. A/Solids 47, 2014, 45-57).

    Returns
    -------
    (L, 2) int array
        Line 0 is the mean. Lines whose frequencies coincide because the mesh frequency is a multiple of the
        carrier frequency stay distinct: the phases are treated as independent.
    """
    for name, value in (("carrier harmonics", carrier), ("mesh harmonics", mesh), ("side bands", bands)):
        if int(value) != value or value < 0:
            raise CaseError(f"{value} {name}", code="E-HARMONICS", limit="whole numbers, 0 or more")
    low = [(m, 0) for m in range(carrier + 1)]
    high = [(q, n) for n in range(1, mesh + 1) for q in range(-bands, bands + 1)]
    return distinct_lines(np.array(low + high))


def distinct_lines(orders) -> np.ndarray:
    """The lines without mirror images and repetitions, the mean first, sorted by their size.

    Parameters
    ----------
    orders : (n, n_bases) int array

    Returns
    -------
    (L, n_bases) int array
    """
    orders = np.atleast_2d(np.array(orders, int))
    orders = np.vstack([np.zeros_like(orders[:1]), orders])
    orders = np.unique(orders * mirror_sign(orders)[:, None], axis=0)
    size = np.abs(orders).sum(axis=1)
    return orders[np.lexsort((*orders.T, size))]


def mirror_sign(orders: np.ndarray) -> np.ndarray:
    """Sign (L,) of the last order of every line that is not zero; 1 for the mean."""
    last = np.zeros(len(orders), int)
    for column in orders.T:
        last = np.where(column != 0, np.sign(column), last)
    return np.where(last == 0, 1, last)


def checked_lines(orders) -> np.ndarray:
    """The lines as an (L, n_bases) integer array.

    Raises
    ------
    CaseError
        Orders that are not whole numbers, a first line that is not the mean, a line that is there twice.
    """
    array = np.array(orders)
    array = array[:, None] if array.ndim == 1 else array
    if array.ndim != 2 or not array.size or np.any(array != np.round(array)):
        raise CaseError("lines must be an (L, n_bases) table of whole numbers", code="E-LINES")
    array = array.astype(int)
    if np.any(array[0]):
        raise CaseError(
            f"the first line has the orders {array[0].tolist()}", code="E-LINES", limit="zeros: the mean",
            remedy="build the lines with harmonic_lines, side_bands or distinct_lines",
        )  # fmt: skip
    unique, count = np.unique(array * mirror_sign(array)[:, None], axis=0, return_counts=True)
    if np.any(count > 1):
        raise CaseError(
            f"the line {unique[count > 1][0].tolist()} or its mirror image is there twice", code="E-LINES",
            remedy="pass the lines through distinct_lines",
        )  # fmt: skip
    return array


def line_tail(amplitudes: np.ndarray, orders: np.ndarray, *, rounding: float = _ROUNDING) -> float:
    """Share of the fluctuating amplitude in the upper half of the lines (root of the energy ratio).

    A line is in the upper half when ``sum_b |orders_b| / max |orders_b|`` is above half its largest value.
    With a single line the share is one: nothing is known about the truncation. A fluctuation below
    ``rounding`` of the mean is none, and its share is zero.
    """
    top = np.maximum(np.abs(orders).max(axis=0), 1)
    size = (np.abs(orders) / top).sum(axis=1)
    energy = np.sum(np.abs(amplitudes) ** 2, axis=0)
    still, energy[0] = rounding**2 * energy[0], 0.0
    total = energy.sum()
    return float(np.sqrt(energy[size > 0.5 * size.max()].sum() / total)) if total > still else 0.0


def coinciding_lines(orders: np.ndarray, frequency) -> tuple[int, int] | None:
    """The first two lines whose frequencies agree to 1e-9 of the highest line, or none.

    Parameters
    ----------
    orders : (L, n_bases) int array
    frequency : (n_bases,) array
        [rad/s]; with a single base frequency no two lines coincide.
    """
    if orders.shape[1] < 2:
        return None
    size = np.abs(orders @ np.asarray(frequency, float))
    along = np.argsort(size, kind="stable")
    near = np.flatnonzero(np.diff(size[along]) <= _COINCIDE * size.max())
    if not len(near):
        return None
    one, other = sorted(along[near[0] : near[0] + 2].tolist())
    return one, other


def coincidence_note(orders: np.ndarray, frequency) -> str:
    """What to know of a solution in which two lines have one frequency; empty where none have."""
    found = coinciding_lines(orders, frequency)
    if found is None:
        return ""
    one, other = (orders[line].tolist() for line in found)
    return (
        f" Lines {one} and {other} have one frequency: only their sum is an amplitude, and its split, as of "
        "phases that are independent, converges slowly; take one base frequency and multiply the orders."
    )
