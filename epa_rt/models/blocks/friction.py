"""Dry friction as a spring and damper in series with a slider: sticks at rest, slips at its limits,
gives no energy.
"""

from epa_rt.models.compiled import compiled


@compiled
def slider(stiffness, time_s, deflection, speed, low, high):
    """Friction force against the motion, and the rate of its deflection.

    While the slider sticks the rate is exactly ``speed``; while it slips the spring relaxes towards
    the limit with ``time_s``. A spring, a damper and a slider, each passive, so the element is
    passive whatever the limits do.
    """
    force = stiffness * (deflection + time_s * speed)
    if force > high:
        force = high
    elif force < low:
        force = low
    else:
        return force, speed
    return force, (force / stiffness - deflection) / time_s
