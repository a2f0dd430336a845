"""What swings over an angle: ripple, cogging, an encoder's error."""

import math

from epa_rt.models.compiled import compiled


@compiled
def wave(turn, twice_sine, twice_cosine):
    """A sine of unit amplitude at ``turn`` (rad) with its second harmonic, in phase and a quarter
    of its period ahead.
    """
    return math.sin(turn) + twice_sine * math.sin(2.0 * turn) + twice_cosine * math.cos(2.0 * turn)
