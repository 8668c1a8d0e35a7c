"""One BLAS thread for work on small matrices."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """One BLAS thread for a block of code, or as ``@one_blas_thread()`` for a function.

    Several threads gain nothing on matrices of a few hundred rows, and wait for one another for many times
    the work as soon as other processes want the same cores.
    """
    # only libraries that are loaded can be limited, and SciPy brings a BLAS of its own
    import scipy.linalg  # noqa: F401
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):
        yield
