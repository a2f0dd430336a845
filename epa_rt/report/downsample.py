"""Fewer points for a picture, with every spike kept: the lowest and the highest of each bin."""

import numpy as np

MOST_POINTS = 4000


def envelope_indices(values: np.ndarray, most: int = MOST_POINTS) -> np.ndarray:
    """Which of the values to draw: all where they are few, else first, last, and each bin's lowest
    and highest.

    At most ``most`` indices (at least 8 are needed), in order. A bin with a NaN in it keeps one, so
    that a gap stays.
    """
    n = len(values)
    if n <= most:
        return np.arange(n)
    has_gaps = bool(np.isnan(values).any())
    size = -(-n // ((most - 2) // (3 if has_gaps else 2)))
    bins = -(-n // size)
    padded = np.full(bins * size, values[-1])
    padded[:n] = values
    padded = padded.reshape(bins, size)
    gaps = np.isnan(padded)
    lowest = np.where(gaps, np.inf, padded).argmin(axis=1)
    highest = np.where(gaps, -np.inf, padded).argmax(axis=1)
    begins = np.arange(bins) * size
    chosen = [
        [0, n - 1],
        begins + lowest,
        begins + highest,
        (begins + gaps.argmax(axis=1))[gaps.any(axis=1)],
    ]
    return np.unique(np.minimum(np.concatenate(chosen), n - 1))


def envelope(
    times: np.ndarray, values: np.ndarray, most: int = MOST_POINTS
) -> tuple[np.ndarray, np.ndarray]:
    """Times and values to draw."""
    chosen = envelope_indices(values, most)
    return times[chosen], values[chosen]


def path_stretches(
    x: np.ndarray, y: np.ndarray, samples: int, count: int, most: int = MOST_POINTS
) -> tuple[np.ndarray, np.ndarray]:
    """A path in the plane to draw: whole where it is short, else ``count`` stretches of so many
    samples, evenly spread.

    The stretches are set apart by NaN, the first and the last sample among them. Of each, the
    envelopes of both coordinates are kept, so that a loop keeps its shape and a stretch its spikes.
    """
    begins = (
        [0]
        if len(x) <= samples * count
        else np.linspace(0, len(x) - samples, count).round().astype(int).tolist()
    )
    samples, each = (len(x), most) if len(begins) == 1 else (samples, most // count)
    xs, ys = [], []
    for begin in begins:
        part = slice(begin, begin + samples)
        chosen = np.union1d(
            envelope_indices(x[part], each // 2), envelope_indices(y[part], each // 2)
        )
        xs += [x[part][chosen], [np.nan]]
        ys += [y[part][chosen], [np.nan]]
    return np.concatenate(xs[:-1]), np.concatenate(ys[:-1])
