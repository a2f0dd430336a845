"""A spring that stiffens or softens with the cube of the way from its rest: Duffing's."""

import numpy as np

from epa_rt.gap.rig.foreign.component import Numbers
from epa_rt.gap.rig.foreign.law import Motion, law, number


def force_n(m: Motion, n: Numbers) -> np.ndarray:
    """N, (N,): the cube of the way from rest, beside whatever spring the plant has."""
    way_m = 0.5 * n["stroke"] * (m.place_ratio - n["friction.cubic_rest_ratio"])
    return n["friction.cubic_n_m3"] * way_m**3


LAW = law(
    name="cubic_spring",
    family="cubic_spring",  # beside a linear spring: of one family only one law is named
    says="a spring that stiffens (softens) with the cube of the way from its rest",
    equation="F = k ((X - X_0) stroke/2)^3",
    source="Duffing 1918",
    numbers=(
        number(
            "cubic_n_m3",
            "N/m^3",
            "cubic_spring",
            -50.0,
            50.0,
            1.0,
            scale="typical_force/stroke/stroke/stroke",
        ),
        number("cubic_rest_ratio", "1", "cubic_spring", -1.0, 1.0, 0.2, scale="", neutral=0.0),
    ),
    starts=((1.0, 0.0), (-1.0, 0.0)),
    force_n=force_n,
)
