"""Flow through valves: ISO 6358 orifices, held back where there is much of it, and what a shut one
leaks.
"""

import math

from epa_rt.models.compiled import compiled

REFERENCE_DENSITY = 1.185  # kg/m^3, ISO 8778
REFERENCE_TEMPERATURE = 293.15
LAMINAR_RATIO = (
    0.999  # above it flow is linear in the pressure ratio, so that its slope stays finite
)


@compiled
def flow_ratio(ratio, critical):
    """Mass flow over choked flow at a downstream-to-upstream pressure ratio in [0, 1] (ISO
    6358).
    """
    if ratio <= critical:
        return 1.0
    if ratio < LAMINAR_RATIO:
        return math.sqrt(1.0 - ((ratio - critical) / (1.0 - critical)) ** 2)
    edge = math.sqrt(1.0 - ((LAMINAR_RATIO - critical) / (1.0 - critical)) ** 2)
    return edge * (1.0 - ratio) / (1.0 - LAMINAR_RATIO)


@compiled
def orifice(conductance, critical, temperature, from_pa, to_pa):
    """Mass flow (kg/s) from one absolute pressure to another; negative when it runs back."""
    scale = conductance * REFERENCE_DENSITY * math.sqrt(REFERENCE_TEMPERATURE / temperature)
    if from_pa >= to_pa:
        return scale * from_pa * flow_ratio(to_pa / from_pa, critical)
    return -scale * to_pa * flow_ratio(from_pa / to_pa, critical)


@compiled
def valve_flow(p, opening, conductance, from_pa, to_pa):
    """Mass flow (kg/s) of a valve, held back the more the larger it is."""
    flow = opening * orifice(conductance, p.critical_ratio, p.temperature_k, from_pa, to_pa)
    return flow if p.flow_limit_s_kg == 0.0 else flow / (1.0 + p.flow_limit_s_kg * abs(flow))


@compiled
def laminar_part(p, opening, seat_leak):
    """Part of a valve's flow that is laminar: of what a shut one leaks."""
    return p.leak_laminar_ratio if opening < seat_leak else 0.0


@compiled
def seat_flow(p, laminar, opening, conductance, from_pa, to_pa):
    """Mass flow (kg/s) of a valve of which a part is laminar, which goes with the difference of the
    squared pressures; into a vacuum both are alike.
    """
    flow = valve_flow(p, opening, conductance, from_pa, to_pa)
    if laminar == 0.0:
        return flow
    high, low = max(from_pa, to_pa), min(from_pa, to_pa)
    narrow = math.copysign(
        opening * orifice(conductance, 1.0, p.temperature_k, high, 0.0) * (1.0 - (low / high) ** 2),
        from_pa - to_pa,
    )
    return (1.0 - laminar) * flow + laminar * narrow
