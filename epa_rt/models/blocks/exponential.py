"""Weights of an exponential Runge-Kutta step for one fast state that decays with a known lag.

Cox and Matthews' ETDRK4 for y' = -y/lag + push(y, t): exact for a constant push whatever the step,
of fourth order in its changes, and plain fourth-order Runge-Kutta for all states without a lag.
"""

import math

from epa_rt.models.compiled import compiled


@compiled
def lag_weights(step_s, lag_s):
    """Six weights: decay over half a step, over the step, stage weight, and the weights of the four
    pushes (a, b, c).

    The last are for the first push, for the sum of the two middle ones, and for the last push;
    times in seconds.
    """
    z = -step_s / lag_s
    half = math.exp(0.5 * z)
    whole = half * half
    if z < -0.5:
        phi1 = (whole - 1.0) / z
        phi2 = (phi1 - 1.0) / z
        phi3 = (phi2 - 0.5) / z
    else:  # the quotients above cancel for short steps: Taylor, exact to rounding here
        phi3 = 0.0
        for k in range(14, 2, -1):
            phi3 = phi3 * z / (k + 1.0) + 1.0
        phi3 /= 6.0
        phi2 = phi3 * z + 0.5
        phi1 = phi2 * z + 1.0
    return (
        half,
        whole,
        (1.0 - half) * lag_s,
        step_s * (phi1 - 3.0 * phi2 + 4.0 * phi3),
        step_s * (2.0 * phi2 - 4.0 * phi3),
        step_s * (4.0 * phi3 - phi2),
    )
