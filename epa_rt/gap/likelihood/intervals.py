"""How far numbers can be trusted: their 95 % intervals, from the scatter of blocks.

A block's contributions are summed as they are, so that neither colour nor missing physics makes an
interval look surer than it is.
"""

from collections.abc import Sequence

import numpy as np

from epa_rt.gap.likelihood.point import Normal

TWO_SIDED_95 = 1.96


def intervals(
    normal: Normal, keys: Sequence[str], astray: np.ndarray | None = None
) -> dict[str, float]:
    """Half width of each key's 95 % interval in spreads: sandwich covariance over blocks, the
    priors believed.

    ``astray`` (n, k): how far fits of twins went from what is true of them (astray.py). What shifts
    all blocks alike no scatter of blocks shows: where the twins' mean square is more than the
    blocks give, it takes their place.
    """
    free = normal.uncertain
    blocks = normal.vector.sum(axis=0)[:, free]
    blocks = blocks[np.any(blocks != 0.0, axis=1)] if blocks.size else blocks
    inverse = normal.covariance()
    few = len(blocks) / max(len(blocks) - int(free.sum()), 1)
    noise = np.einsum("ij,ij->i", inverse @ (few * blocks.T @ blocks), inverse)
    if astray is not None:
        noise = np.maximum(noise, np.mean(astray[:, free] ** 2, axis=0))
    belief = np.einsum("ij,j,ij->i", inverse, normal.prior[free], inverse)
    width = dict.fromkeys(keys, np.inf)
    for i, square in zip(np.flatnonzero(free), noise + belief, strict=True):
        if normal.keys[i] in width:
            width[normal.keys[i]] = TWO_SIDED_95 * float(np.sqrt(max(square, 0.0)))
    return width
