"""The two fitted force laws of the paper: Tang and Liu (eqs. 4-7) and the authors' polynomial (eq.
8).
"""

from epa_rt.models.compiled import compiled


@compiled
def tang(p, gauge_pa, stretch, speed):
    """Force (N) of eqs. 4-7 with x = -stretch, the contraction from no-load length; the sign of eq.
    7 is a ramp.
    """
    x, contracting = -stretch, -speed
    static = (
        gauge_pa * ((p.tang_k2_ratio * x + p.tang_k1_m) * x + p.tang_k0_m2)
        + (p.tang_s2_n_m2 * x + p.tang_s1_n_m) * x
        + p.tang_s0_n
    )
    damping = gauge_pa * (p.tang_d2_n_s2_m2_pa * contracting + p.tang_d1_n_s_m_pa) * contracting
    sign = min(max(contracting / p.tang_sign_m_s, -1.0), 1.0)
    dry = (
        (gauge_pa - p.tang_phi_pa) * ((p.tang_n2_ratio * x + p.tang_n1_m) * x + p.tang_n0_m2) * sign
    )
    return static - damping - dry


@compiled
def polynomial(p, gauge_pa, stretch, speed):
    """Force (N) of eq. 8, normalised: L is elongation from no-load length, its rate is contraction
    speed.

    Held inside the identified range: outside it the damping changes its sign.
    """
    pressure = min(max(gauge_pa / p.poly_pressure_pa, 0.0), p.poly_pressure_max_ratio)
    length = min(stretch / p.poly_length_m, p.poly_length_max_ratio)
    rate = min(max(-speed / p.poly_speed_m_s, -p.poly_speed_max_ratio), p.poly_speed_max_ratio)
    return p.poly_force_n * (
        p.poly_c1_ratio * length * pressure
        + p.poly_c2_ratio * rate * pressure
        + p.poly_c3_ratio * rate * rate
        + p.poly_c4_ratio * rate * pressure * pressure
        + p.poly_c5_ratio
    )
