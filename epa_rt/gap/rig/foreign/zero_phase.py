"""The low-pass that every residual passes, forwards and backwards. numba, one pass each way."""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def forth_and_back(
    sections: np.ndarray, steady: np.ndarray, values: np.ndarray, edge: int
) -> np.ndarray:
    """(N,) as scipy's ``sosfiltfilt``, to the bit, of two second-order ``sections``: ``values``
    turned about either end for ``edge`` rows. ``steady``: state after a constant of one.
    """
    count = len(values)
    rows = count + 2 * edge
    first, last = 2.0 * values[0], 2.0 * values[-1]
    longer = np.empty(rows)
    for i in range(edge):
        longer[i] = first - values[edge - i]
        longer[edge + count + i] = last - values[count - 2 - i]
    longer[edge : edge + count] = values
    _run(sections, steady, longer, 0, 1)
    _run(sections, steady, longer, rows - 1, -1)
    return longer[edge : edge + count].copy()


@njit(cache=True, nogil=True)
def _run(sections: np.ndarray, steady: np.ndarray, values: np.ndarray, begin: int, by: int) -> None:
    """Filters in place, from row ``begin`` on in steps of ``by``; settled on its value before."""
    a0, a1, a2, _, a4, a5 = sections[0]
    b0, b1, b2, _, b4, b5 = sections[1]
    (p, q), (r, s) = steady[0] * values[begin], steady[1] * values[begin]
    for i in range(len(values)):
        x = values[begin + by * i]
        y = a0 * x + p
        p = a1 * x - a4 * y + q
        q = a2 * x - a5 * y
        z = b0 * y + r
        r = b1 * y - b4 * z + s
        s = b2 * y - b5 * z
        values[begin + by * i] = z
