"""Braid of the second simulator, written from docs/plant.md: its elements with memory, the strap,
and the force laws 1 and 2.
"""

import math

SLIP, DAHL, LUGRE, BOUC_WEN, PREISACH, WAY, ELEMENTS = 0, 4, 5, 6, 7, 10, 11


def turned(value, limit, part):
    """An element that turns over towards ±`limit`, after `part` of its displacement."""
    goal = math.copysign(limit, part)
    return goal + (value - goal) * math.exp(-abs(part))


def bouc_wen(m, value, part):
    sign, exponent, unload = (
        math.copysign(1.0, part),
        m["bouc_wen_exponent_ratio"],
        1 - 2 * m["bouc_wen_unload_ratio"],
    )

    def slope(b):
        return 1 - abs(b) ** exponent * (1.0 if b * sign > 0 else unload)

    k1 = slope(value)
    k2 = slope(value + part / 2 * k1)
    k3 = slope(value + part / 2 * k2)
    k4 = slope(value + part * k3)
    return min(max(value + part / 6 * (k1 + 2 * k2 + 2 * k3 + k4), -1.0), 1.0)


def displaced(m, elements, way, speed):
    """The elements once the braid has come `way` further."""
    out = list(elements)
    out[SLIP : SLIP + 4] = [
        min(max(elements[k] + way, -m[f"slip{k + 1}_m"]), m[f"slip{k + 1}_m"]) for k in range(4)
    ]
    if m["dahl_ratio"]:
        out[DAHL] = turned(elements[DAHL], 1.0, way / m["dahl_m"])
    if m["lugre_ratio"]:
        limit = 1 + m["lugre_extra_ratio"] * math.exp(-((speed / m["lugre_speed_m_s"]) ** 2))
        out[LUGRE] = turned(elements[LUGRE], limit, way / (m["lugre_m"] * limit))
    if m["bouc_wen_ratio"]:
        out[BOUC_WEN] = bouc_wen(m, elements[BOUC_WEN], way / m["bouc_wen_m"])
    for j in range(3):
        reach = m["preisach_m"] / 2**j
        out[PREISACH + j] = min(max(elements[PREISACH + j] + way, -reach), reach)
    return out


def friction(m, elements, length):
    """Friction of the elements over the reference force; the way travelled counts as it was when
    they settled.
    """
    slip = sum(m[f"slip{k + 1}_ratio"] * elements[k] / m[f"slip{k + 1}_m"] for k in range(4))
    total = (m["slip_ratio"] + m["run_in_ratio"] * math.exp(-elements[WAY] / m["run_in_m"])) * slip
    total += (
        m["dahl_ratio"] * elements[DAHL]
        + m["lugre_ratio"] * elements[LUGRE]
        + m["bouc_wen_ratio"] * elements[BOUC_WEN]
    )
    if m["preisach_ratio"]:
        for j in range(3):
            q = elements[PREISACH + j]
            strength = min(
                max(
                    1 + m["preisach_slope_per_m"] * (length - q - m["slip_reference_length_m"]),
                    0.25,
                ),
                4.0,
            )
            total += m["preisach_ratio"] * strength * q / (m["preisach_m"] / 2**j) / 3
    return total


def strap(m, force):
    """How far the strap stretches."""
    return m["strap_compliance_m_n"] * force / (1 + m["strap_stiffening_per_n"] * abs(force))


def law(m, acting, slope, stretch, speed):
    """Force of the law that the muscle follows, from the pressure that acts."""
    if m["law_code"] == 1:
        x, rate = -stretch, -speed
        sign = min(max(rate / m["tang_sign_m_s"], -1.0), 1.0)
        force = (
            acting * (m["tang_k2_ratio"] * x**2 + m["tang_k1_m"] * x + m["tang_k0_m2"])
            + m["tang_s2_n_m2"] * x**2
            + m["tang_s1_n_m"] * x
            + m["tang_s0_n"]
        )
        force -= acting * (m["tang_d2_n_s2_m2_pa"] * rate + m["tang_d1_n_s_m_pa"]) * rate
        return (
            force
            - (acting - m["tang_phi_pa"])
            * (m["tang_n2_ratio"] * x**2 + m["tang_n1_m"] * x + m["tang_n0_m2"])
            * sign
        )
    if m["law_code"] == 2:
        most = m["poly_speed_max_ratio"]
        pressure = min(max(acting / m["poly_pressure_pa"], 0.0), m["poly_pressure_max_ratio"])
        long, rate = (
            min(stretch / m["poly_length_m"], m["poly_length_max_ratio"]),
            min(max(-speed / m["poly_speed_m_s"], -most), most),
        )
        part = (
            m["poly_c1_ratio"] * long * pressure
            + m["poly_c2_ratio"] * rate * pressure
            + m["poly_c3_ratio"] * rate**2
            + m["poly_c4_ratio"] * rate * pressure**2
            + m["poly_c5_ratio"]
        )
        return part * m["poly_force_n"]
    return acting * slope
