"""Gas of the stand-in, with pressure and mass as states. Equations: docs/plant.md (Gas); hidden
ones said here.
"""

import math

from sim_backend.stand_in.compiled import compiled

WARM_PA, WARM = (
    4e5,
    0.1,
    # absolute pressure and excess of temperature at which the wall cools the gas within
    # ``gas_time_s``
)


@compiled
def nozzle(conductance, b, kelvin, up, down):
    """ISO 6358 mass flow (kg/s) from ``up`` to ``down``, negative when it runs back."""
    sign = 1.0
    if up < down:
        up, down, sign = down, up, -1.0
    ratio = down / up
    if ratio <= b:
        part = 1.0
    elif ratio < 0.999:
        part = math.sqrt(1.0 - ((ratio - b) / (1.0 - b)) ** 2)
    else:
        part = math.sqrt(1.0 - ((0.999 - b) / (1.0 - b)) ** 2) * (1.0 - ratio) * 1000.0
    return sign * conductance * 1.185 * up * math.sqrt(293.15 / kelvin) * part


@compiled
def laminar(conductance, up, down):
    """Hidden: flow through a narrow gap, proportional to the difference of the squared
    pressures.
    """
    return conductance * 1.185 * (up * up - down * down) / (2.0 * up)


@compiled
def walls(warmer):
    """Hidden: pressure lost per ``gas_time_s`` to walls by natural convection, over temperature as
    a share above theirs.
    """
    return WARM_PA * warmer * (abs(warmer) / WARM) ** 0.25


@compiled
def rates(g, h, pressure, mass, volume, volume_rate, supply, inlet, exhaust):
    """Rates of pressure and mass, and the flow drawn from the supply.

    Hidden: a leak that follows the squared pressures, seats that leak through laminar gaps, and an
    energy balance: the gas warms when compressed and gives its heat to the walls, some 30 K of it
    at 4 bar within ``gas_time_s`` (0: at once, the nominal gas), faster while gas that flows stirs
    it.
    """
    around = g.atmosphere_pa
    drawn, lost = 0.0, 0.0
    if inlet > 0.0:
        drawn = inlet * nozzle(
            g.inlet_conductance_m3_s_pa, g.critical_ratio, g.temperature_k, supply, pressure
        )
    if exhaust > 0.0:
        lost = exhaust * nozzle(
            g.exhaust_conductance_m3_s_pa, g.critical_ratio, g.temperature_k, pressure, around
        )
    if h.seat_in_ratio != 0.0:
        drawn += (1.0 - inlet) * laminar(
            h.seat_in_ratio * g.inlet_conductance_m3_s_pa, supply, pressure
        )
    if h.seat_out_ratio != 0.0:
        lost += (1.0 - exhaust) * laminar(
            h.seat_out_ratio * g.exhaust_conductance_m3_s_pa, pressure, around
        )
    swell = h.swell_per_pa * g.dead_volume_m3  # hidden: tubes that widen under pressure
    volume += swell * (pressure - around)
    warm = g.gas_constant_j_kg_k * g.temperature_k
    if h.leak_per_s != 0.0:
        lost += (
            h.leak_per_s * (pressure * pressure - around * around) / (7.0 * around) * volume / warm
        )
    if h.gas_time_s == 0.0:
        rate = warm * (drawn - lost) / volume - g.polytropic_ratio * pressure * volume_rate / volume
    else:
        own = pressure * volume / mass
        enthalpy = (warm if drawn > 0.0 else own) * drawn - (own if lost > 0.0 else warm) * lost
        stirred = 1.0 + h.stir_s * (abs(drawn) + abs(lost)) / mass
        rate = (
            1.4 * (enthalpy - pressure * volume_rate) / volume
            - stirred * walls(own / warm - 1.0) / h.gas_time_s
        )
    return rate / (1.0 + pressure * swell / volume), drawn - lost, drawn


@compiled
def supply(g, h, flow):
    """Absolute supply pressure; hidden: it gives way to the flow that ``regulator`` has
    followed.
    """
    return (
        g.atmosphere_pa
        + g.supply_gauge_pa
        - h.regulator_pa_s_kg * flow * (1.0 + h.regulator_curve_s_kg * abs(flow))
    )


@compiled
def regulator(h, drawn, flow, flow_rate):
    """Hidden: a regulator of second order. Returns the rates of the flow that it follows."""
    if h.regulator_pa_s_kg == 0.0:
        return 0.0, 0.0
    w = 2.0 * math.pi * h.regulator_hz
    return flow_rate, w * w * (drawn - flow) - 2.0 * h.regulator_damping * w * flow_rate
