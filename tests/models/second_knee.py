"""Loads of the second simulator, written from docs/plant.md: the knee with its lever, springs and
dry friction, and the mass on a line.
"""

import math


def lever(w, place):
    """Load coordinate q and how much of it a step of the load's place makes."""
    if w["kind_code"] != 2:
        return place, 1.0
    r, slope, curve = w["lever_m"], w["lever_slope_per_rad"], w["lever_curve_per_rad2"]
    return (
        r * (place + slope * (1 - math.cos(place)) + curve * (place - math.sin(place))),
        r * (1 + slope * math.sin(place) + curve * (1 - math.cos(place))),
    )


def stops(w, place, speed, low, high):
    push = 0.0
    for depth, sign in ((low - place, 1.0), (place - high, -1.0)):
        if depth > 0:
            push += sign * max(
                w["stop_stiffness_nm_rad"] * depth
                - sign * w["stop_viscous_nm_s_rad"] * speed * min(1e3 * depth, 1),
                0.0,
            )
    return push


def dry(w, speed, bent):
    """Dry friction of the load, and the rate of its spring's deflection."""
    knee = w["kind_code"] == 2
    stiffness, limit, tau = (
        w["knee_stiffness_nm_rad" if knee else "guide_stiffness_n_m"],
        w["knee_coulomb_nm" if knee else "coulomb_n"],
        w["presliding_time_s"],
    )
    if limit == 0:
        return 0.0, 0.0
    if knee and w["knee_bend_ratio"]:
        speed_bent = speed * max(
            1 - w["knee_bend_ratio"] * stiffness * bent * math.copysign(1.0, speed) / limit, 0.0
        )
    else:
        speed_bent = speed
    if knee and w["knee_friction_speed_rad_s"]:
        limit *= abs(speed) / (abs(speed) + w["knee_friction_speed_rad_s"])
    force = min(max(stiffness * (bent + tau * speed_bent), -limit), limit)
    return force, (force / stiffness - bent) / tau


def acceleration(w, place, speed, force):
    """Of the load under a force along q, without its dry friction; and its inertia."""
    if w["kind_code"] == 1:
        mass = max(w["mass_kg"] + w["payload_kg"], 0.1 * w["mass_kg"])
        push = (
            w["bias_n"]
            + force
            - w["viscous_n_s_m"] * speed
            + stops(w, place, speed, w["low_m"], w["high_m"])
        )
        return push / mass, mass
    hung = w["payload_kg"] * w["payload_lever_ratio"]
    weight = (
        (w["mass_kg"] + hung)
        * w["gravity_m_s2"]
        * w["mass_lever_m"]
        * math.sin(w["hang_rad"] + w["misalignment_rad"] + place)
    )
    inertia = max(
        w["inertia_kg_m2"] + hung * w["payload_lever_ratio"] * w["mass_lever_m"] ** 2,
        0.1 * w["inertia_kg_m2"],
    )
    torque = (
        lever(w, place)[1] * force
        - weight
        - w["viscous_nm_s_rad"] * speed
        - w["knee_spring_nm_rad"] * place
    )
    return (torque + stops(w, place, speed, w["low_rad"], w["high_rad"])) / inertia, inertia


def rest_place(w, force_at):
    """Where the load lies at rest, under `force_at(place)` along q."""
    if w["kind_code"] == 0:
        return 0.0
    low, high = (
        (w["low_m"] - 1, w["high_m"] + 1)
        if w["kind_code"] == 1
        else (w["low_rad"] - 1, w["high_rad"] + 1)
    )
    for _ in range(80):
        middle = (low + high) / 2
        if acceleration(w, middle, 0.0, force_at(middle))[0] > 0:
            low = middle
        else:
            high = middle
    return (low + high) / 2
