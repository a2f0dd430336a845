"""Dry friction that is higher over a part of the way: a dent, dirt, a worn ball, a dry patch."""

import numpy as np

from epa_rt.gap.rig.foreign.component import Numbers
from epa_rt.gap.rig.foreign.law import Motion, law, number

# parts of half the stroke: where fits begin, so far apart that each is within the width of one
PLACES = (0.0, 0.25, -0.25, 0.5, -0.5, 0.75, -0.75)
HALF_WIDTH = 0.15


def force_n(m: Motion, n: Numbers) -> np.ndarray:
    """N, (N,): against the motion, a bell curve of the place."""
    off = (m.place_ratio - n["friction.spot_at_ratio"]) / n["friction.spot_half_ratio"]
    return n["friction.spot_n"] * np.exp(-(off**2)) * m.sign


LAW = law(
    name="rough_spot",
    family="rough_spot",
    says="dry friction that is higher over a part of the way",
    equation="F = Fs exp(-((X - X_0)/w)^2) sgn(v)",
    source="pitting and dirt in guides and screws",
    numbers=(
        number(
            "spot_n", "N", of="rough_spot", low=-5.0, high=5.0, spread=0.2, scale="typical_force"
        ),
        number("spot_at_ratio", "1", "rough_spot", -1.1, 1.1, 0.3, scale=""),
        number("spot_half_ratio", "1", "rough_spot", 0.02, 0.5, 0.1, scale="", neutral=HALF_WIDTH),
    ),
    starts=tuple((0.2, at, HALF_WIDTH) for at in PLACES),
    force_n=force_n,
)
