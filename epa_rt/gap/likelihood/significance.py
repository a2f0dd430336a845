"""How sure it is that a whitened residual is more than noise."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

USUAL = 3.0  # deviations by which chi-squares of twins differ anyway


def significance(white: np.ndarray) -> float:
    """z of a whitened residual's chi-square against that of as many samples of noise."""
    if white.size == 0:
        return 0.0
    return float((np.sum(white**2) - white.size) / np.sqrt(2.0 * white.size))


def scatter(
    whiten: Callable[[np.ndarray], np.ndarray],
    bias: Mapping[str, np.ndarray],
    twins: Mapping[str, Sequence[np.ndarray]],
) -> float:
    """By how much twins' significances differ, in USUAL ones, at least 1: where no noise dithers an
    instrument's steps, twins of one plant differ by far more than noise does. ``twins``: recording
    name to a link's residuals, twin by twin.
    """
    found = []
    for made in zip(*twins.values(), strict=True):
        white = np.concatenate(
            [whiten(twin - bias.get(name, 0.0)) for name, twin in zip(twins, made, strict=True)]
        )
        found.append(significance(white[np.isfinite(white)]))
    return max(float(np.std(found)) / USUAL, 1.0) if len(found) > 1 else 1.0
