"""Points of a sensor that is known, for the tests."""

import numpy as np

from epa_rt.calibrate.point import Point
from epa_rt.calibrate.refusals import Scale

SCALE = Scale("muscle_force_n", "N", "V", 50.0, 0.0, (-10.0, 10.0), (-0.8, 9.8), 10.0 / 2048)
UP_DOWN = np.array([0, 50, 100, 150, 200, 250, 300, 250, 200, 150, 100, 50, 0], float)
READING_U, SCATTER = 0.0005, 0.006


def points(
    gain=50.0, offset=0.0, u=0.1, seed=0, references=UP_DOWN, bend=0.0, hysteresis=0.0
) -> list[Point]:
    """Points with drawn errors in reference and reading. ``bend``: N in the middle of the span;
    ``hysteresis``: N between up and down.
    """
    noise = np.random.default_rng(seed)
    y = np.asarray(references, float)
    truth = y + u * noise.normal(size=len(y))
    t = 2.0 * (truth - y.min()) / np.ptp(y) - 1.0
    way = np.concatenate(([1.0], np.sign(np.diff(y))))
    felt = truth + bend * (1.0 - t**2) - 0.5 * hysteresis * way * (1.0 - t**2)
    x = (felt - offset) / gain + READING_U * noise.normal(size=len(y))
    return [
        Point(float(a), u, float(b), READING_U, SCATTER, 0.0, f"point {i + 1}")
        for i, (a, b) in enumerate(zip(y, x, strict=True))
    ]
