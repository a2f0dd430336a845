"""The stop operator: an elastic element that slips at its limits, the simplest thing with a memory
of its path.
"""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def stop_over_log(place: np.ndarray, limit: float) -> np.ndarray:
    """Deflection (n,) of an elastic slider of break-away ``limit`` along ``place`` (n,); NaN is
    passed over.
    """
    out = np.full(place.shape[0], np.nan)
    deflection, before = 0.0, np.nan
    for k in range(place.shape[0]):
        here = place[k]
        if np.isnan(here):
            continue
        if not np.isnan(before):
            deflection = min(max(deflection + here - before, -limit), limit)
        before = here
        out[k] = deflection
    return out
