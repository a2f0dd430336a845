"""Whole numbers in and out of a process image, little-endian, compiled."""

import numpy as np

from sim_backend.compiled import compiled


@compiled
def get(image: np.ndarray, byte: int, size: int) -> int:
    """A signed number of ``size`` bytes; zero where the drive has not mapped the entry."""
    if byte < 0:
        return 0
    value = 0
    for i in range(size):
        value |= np.int64(image[byte + i]) << (8 * i)
    half = np.int64(1) << (8 * size - 1)
    return value - 2 * half if value & half else value


@compiled
def put(image: np.ndarray, byte: int, size: int, value: float) -> None:
    """A signed number of ``size`` bytes, held at the ends of what they can hold; not where it is
    not mapped.
    """
    if byte < 0:
        return
    limit = 2.0 ** (8 * size - 1)
    counts = np.int64(min(max(value, -limit), limit - 1.0))
    for i in range(size):
        image[byte + i] = (counts >> (8 * i)) & 0xFF


@compiled
def put_counts(image: np.ndarray, byte: int, size: int, counts: float) -> None:
    """A number of ``size`` bytes that is known to fit, with its sign or without."""
    whole = np.int64(counts)
    for i in range(size):
        image[byte + i] = (whole >> (8 * i)) & 0xFF


@compiled
def put_word(image: np.ndarray, byte: int, word: int) -> None:
    """An unsigned number of two bytes; not where it is not mapped."""
    if byte >= 0:
        image[byte] = word & 0xFF
        image[byte + 1] = (word >> 8) & 0xFF
