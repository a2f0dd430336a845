"""Gas of the second simulator, written from docs/plant.md: valves, their seats and limits, the
regulator, and what the gas's heat does.
"""

import math

RHO0, T0 = 1.185, 293.15


def exponent(g):
    """Of p V^n."""
    return g["polytropic_ratio"] + g["compression_heating_ratio"] + 0.4 * g["adiabatic_ratio"]


def supply(g, drawn):
    """Absolute pressure behind the regulator."""
    return (
        g["atmosphere_pa"]
        + g["supply_gauge_pa"]
        - g["supply_droop_pa_s_kg"] * drawn * (1 + (g["droop_bend_s_kg"] * drawn) ** 2)
    )


def regulator(g, drawn, rate, flow):
    """Rates of the lagged supply flow and of its rate."""
    tau, second = g["droop_time_s"], g["droop_ring_ratio"] * g["droop_time_s"]
    pulled = (flow - drawn) / tau
    return (pulled, 0.0) if second < 1e-3 else (rate, (pulled - rate) / second)


def orifice(conductance, g, from_pa, to_pa):
    if from_pa < to_pa:
        return -orifice(conductance, g, to_pa, from_pa)
    ratio, critical = to_pa / from_pa, g["critical_ratio"]
    inside = min(max((ratio - critical) / (1 - critical), 0.0), (0.999 - critical) / (1 - critical))
    phi = math.sqrt(1 - inside**2)
    if ratio > 0.999:
        phi *= (1 - ratio) / 0.001
    return conductance * RHO0 * from_pa * math.sqrt(T0 / g["temperature_k"]) * phi


def limited(g, flow):
    return flow / (1 + g["flow_limit_s_kg"] * abs(flow))


def through(opening, which, g, from_pa, to_pa):
    """A valve as far as it is not stuck, or what its seat leaks where that is more."""
    opening, seat, conductance = (
        opening * (1 - g[f"{which}_stuck_ratio"]),
        g[f"{which}_seat_leak_ratio"],
        g[f"{which}_conductance_m3_s_pa"],
    )
    if opening >= seat:
        return limited(g, opening * orifice(conductance, g, from_pa, to_pa))
    part, high, low = g["leak_laminar_ratio"], max(from_pa, to_pa), min(from_pa, to_pa)
    narrow = math.copysign(
        seat
        * conductance
        * RHO0
        * high
        * math.sqrt(T0 / g["temperature_k"])
        * (1 - (low / high) ** 2),
        from_pa - to_pa,
    )
    return (1 - part) * limited(g, seat * orifice(conductance, g, from_pa, to_pa)) + part * narrow


def flows(g, inlet, exhaust, drawn_w, pressure, volume):
    """What comes from the supply, and what leaves."""
    above = pressure - g["atmosphere_pa"]
    drawn = through(inlet, "inlet", g, supply(g, drawn_w), pressure)
    lost = through(exhaust, "exhaust", g, pressure, g["atmosphere_pa"])
    leak = (
        g["leak_per_s"] * above * (1 + g["leak_laminar_ratio"] * above / (2 * g["atmosphere_pa"]))
    )
    return drawn, lost + leak * volume / (g["gas_constant_j_kg_k"] * g["temperature_k"])


def cooling(g, mass, warmth, volume, drawn, lost):
    """Rate k at which the gas returns to the temperature around it; its own is `warmth` times
    that.
    """
    k = 0.0
    if g["fill_heating_ratio"] != 1:
        k += g["heat_exchange_per_s"]
    if g["compression_heating_ratio"] > 0:
        k += g["compression_cooling_per_s"]
    if g["adiabatic_ratio"] > 0:
        stir = g["wall_exchange_stir_s"]
        dense = 4e5 * volume / (mass * g["gas_constant_j_kg_k"] * g["temperature_k"])
        wall = (
            g["wall_exchange_per_s"]
            * dense ** g["wall_exchange_fall_ratio"]
            * (10 * abs(warmth - 1)) ** g["wall_exchange_rise_ratio"]
        )
        wall *= (1 + stir * (abs(drawn) + abs(lost)) / mass) ** 0.67
        k += min(wall, 1e3) if stir > 0 else wall
    return k


def rates(g, mass, pressure, volume, drawn, lost):
    """Rates of c = p V^n and of the mass."""
    thermal, a = g["gas_constant_j_kg_k"] * g["temperature_k"], g["adiabatic_ratio"]
    warmth = pressure * volume / (mass * thermal)
    carried_in = carried_out = 1.0
    if a != 0:
        carried_in = (1 + 0.4 * a) * (warmth if drawn < 0 else 1)
        carried_out = (1 + 0.4 * a) * (warmth if lost > 0 else 1)
    heating = g["fill_heating_ratio"] if drawn > 0 else 1.0
    push = thermal * (heating * carried_in * drawn - carried_out * lost) / volume
    back = cooling(g, mass, warmth, volume, drawn, lost) * (mass * thermal / volume - pressure)
    return volume ** exponent(g) * (push + back), drawn - lost
