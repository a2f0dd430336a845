"""All parts of the stand-in joined: rates of the whole plant at a state, and the muscles'
forces.
"""

import math

from sim_backend.stand_in import gas, knee, motor, muscle
from sim_backend.stand_in.compiled import compiled
from sim_backend.stand_in.records import (
    ANGLE,
    APART,
    BOUC,
    CURRENT,
    FLOW,
    FLOW_RATE,
    FORCE_LAG,
    FRAME,
    FRAME_RATE,
    HEAT,
    HOUSING,
    INTEGRAL,
    KNEE_BRISTLE,
    LAG,
    LAG2,
    LUGRE,
    MASS,
    OPEN,
    PLACE,
    POWER,
    POWERS,
    PRESSURE,
    RATE,
    RELAX,
    SPEED,
    STUCK,
)

SPOTS = 5  # worn ones to a turn of the spool: a knee's trials turn it by less than a seventh


@compiled
def followed(wound, slope, before, half, widens, speed):
    """Travel behind one play and its rate: it stays until the play is used up, and then moves with
    the flank, which goes its own way where the play ``widens`` over the motor's angle. Without that
    the gas, whose pressure is a state, would not follow the muscle's volume.
    """
    if before >= wound + half - 1e-12:
        return min(before, wound + half), ((slope + widens) * speed if speed < 0.0 else 0.0)
    if before <= wound - half + 1e-12:
        return max(before, wound - half), ((slope - widens) * speed if speed > 0.0 else 0.0)
    return before, 0.0


@compiled
def half_play(p, y):
    """Half of the hidden play where the spool is, and its slope over the motor's angle: it may be
    wider on one side of the spool, or in five worn spots (bells over the turn).
    """
    h, ratio = p.hidden, p.transmission.gear_ratio
    turn = y[ANGLE] / ratio + h.play_phase_rad
    wide, slope = 1.0 + h.play_uneven_ratio * math.sin(turn), h.play_uneven_ratio * math.cos(turn)
    if h.play_worn_ratio != 0.0:
        worn = h.play_worn_ratio * math.exp(h.play_worn_sharpness * (math.cos(SPOTS * turn) - 1.0))
        wide, slope = (
            wide + worn,
            slope - worn * h.play_worn_sharpness * SPOTS * math.sin(SPOTS * turn),
        )
    return 0.5 * h.play_m * wide, 0.5 * h.play_m * slope / ratio


@compiled
def travel_of(p, s, y):
    """Travel of the strap and its speed; hidden: three plays of different width beside each other,
    so that flanks are round, not as wide everywhere on the spool.
    """
    wound, slope = motor.wound(p.transmission, p.hidden, y[ANGLE])
    if p.hidden.play_m == 0.0:
        return wound, slope * y[SPEED], slope
    (half, widens), spread = half_play(p, y), p.hidden.play_spread_ratio
    a, rate_a = followed(
        wound, slope, s.play_m[0], half * (1.0 - spread), widens * (1.0 - spread), y[SPEED]
    )
    b, rate_b = followed(wound, slope, s.play_m[1], half, widens, y[SPEED])
    c, rate_c = followed(
        wound, slope, s.play_m[2], half * (1.0 + spread), widens * (1.0 + spread), y[SPEED]
    )
    return (a + b + c) / 3.0, (rate_a + rate_b + rate_c) / 3.0, slope


@compiled
def tension(p, s, y, i, travel, travel_speed, q, q_speed):
    """Force of muscle i, its volume and rate of volume, the length of its braid and the speed of
    its line.
    """
    m, g, h, w = p.muscle[i], p.gas[i], p.hidden, p.load
    if i == 0:
        length = w.rest0_m + w.travel0_ratio * travel + w.load0_ratio * q
        speed = w.travel0_ratio * travel_speed + w.load0_ratio * q_speed
    else:
        length = w.rest1_m + w.travel1_ratio * travel + w.load1_ratio * q
        speed = w.travel1_ratio * travel_speed + w.load1_ratio * q_speed
    if i == 0 and h.frame_m_n != 0.0:
        length, speed = length - y[FRAME], speed - y[FRAME_RATE]
    braid = length - muscle.stretch_of_strap(h, s.pull_n[i])
    volume, slope, area = muscle.body(m, h, g.dead_volume_m3, braid)
    relaxed = y[RELAX + 3 * i] + y[RELAX + 3 * i + 1] + y[RELAX + 3 * i + 2]
    if h.power_n_m != 0.0:
        for k in range(POWERS):
            relaxed += y[POWER + POWERS * i + k]
    force = muscle.pull(
        m,
        h,
        area,
        y[PRESSURE + i] - g.atmosphere_pa,
        braid,
        speed,
        relaxed,
        s.slip_m[i],
        braid - s.length_m[i],
        y[BOUC + i],
        y[LUGRE + i],
    )
    return force, volume, slope * speed, braid, speed


@compiled
def _muscle_rates(p, s, y, dy, i, speed, volume, volume_rate):
    """Rates of a muscle's gas and inner friction; returns what it draws from the supply."""
    h, g = p.hidden, p.gas[i]
    dy[PRESSURE + i], dy[MASS + i], drawn = gas.rates(
        g,
        h,
        y[PRESSURE + i],
        y[MASS + i],
        volume,
        volume_rate,
        gas.supply(p.gas[0], h, y[FLOW]),
        y[OPEN + i],
        y[OPEN + 2 + i],
    )
    if h.relax_n_m != 0.0:  # hidden creep: three relaxations, a decade apart
        dy[RELAX + 3 * i] = 0.5 * h.relax_n_m * speed - y[RELAX + 3 * i] / (0.1 * h.relax_s)
        dy[RELAX + 3 * i + 1] = 0.3 * h.relax_n_m * speed - y[RELAX + 3 * i + 1] / h.relax_s
        dy[RELAX + 3 * i + 2] = 0.2 * h.relax_n_m * speed - y[RELAX + 3 * i + 2] / (
            10.0 * h.relax_s
        )
    if h.power_n_m != 0.0:  # hidden creep: relaxes with a power of time, from 10 ms to 100 s
        time_s = 0.01
        for k in range(POWERS):
            dy[POWER + POWERS * i + k] = (
                0.25 * h.power_n_m * time_s**-h.power_exponent * speed
                - y[POWER + POWERS * i + k] / time_s
            )
            time_s *= APART
    if h.bouc_ratio != 0.0:
        dy[BOUC + i] = muscle.bouc_rate(h, y[BOUC + i], speed)
    if h.lugre_ratio != 0.0:
        dy[LUGRE + i] = muscle.lugre_rate(h, y[LUGRE + i], speed)
    return drawn


@compiled
def rates(p, s, y, dy, target, slope, wanted_speed):
    """Rates at y; ``dy[CURRENT]`` is the current that the loops want and the voltage allows, not a
    rate.
    """
    h, d, t, w = p.hidden, p.drive, p.transmission, p.load
    travel, travel_speed, per_angle = travel_of(p, s, y)
    q, q_speed, _ = knee.coordinate(w, h, y[PLACE], y[RATE])
    spool, along, drawn = 0.0, 0.0, 0.0
    force0 = 0.0
    for i in range(2):
        if p.muscle[i].present > 0.5:
            force, volume, volume_rate, _, speed = tension(
                p, s, y, i, travel, travel_speed, q, q_speed
            )
            drawn += _muscle_rates(p, s, y, dy, i, speed, volume, volume_rate)
            spool += force * (w.travel0_ratio if i == 0 else w.travel1_ratio)
            along -= force * (w.load0_ratio if i == 0 else w.load1_ratio)
            if i == 0:
                force0 = force
        for v in (i, 2 + i):
            dy[OPEN + v] = (s.seen[v] - y[OPEN + v]) / p.gas[i].valve_lag_s
        _lags(
            p, y, dy, i, y[PRESSURE + i] - p.gas[i].atmosphere_pa + h.hose_pa_s_kg * dy[MASS + i]
        )  # hidden: the gauge sits before a hose, the valves see the muscle
    _lags(p, y, dy, 2, gas.supply(p.gas[0], h, y[FLOW]) - p.gas[0].atmosphere_pa)
    if h.force_time_s != 0.0:
        dy[FORCE_LAG] = (force0 - y[FORCE_LAG]) / h.force_time_s
    dy[FLOW], dy[FLOW_RATE] = gas.regulator(h, drawn, y[FLOW], y[FLOW_RATE])
    kt = motor.constant(d, h, y[HEAT], y[HOUSING])
    wanted, dy[INTEGRAL] = motor.loops(
        d, s.line, target, slope, wanted_speed, s.torque_nm, y[ANGLE], y[SPEED], y[INTEGRAL]
    )
    dy[CURRENT] = motor.reachable(d, h, kt, wanted, y[CURRENT], y[SPEED])
    lossy = d.winding_ohm * y[CURRENT] * y[CURRENT]
    dy[HEAT] = (d.winding_thermal_k_w * lossy - y[HEAT]) / d.winding_time_s
    cooling = (
        (max(y[HOUSING], 0.0) / h.convection_k) ** 0.25 if h.convection_k > 0.0 else 1.0
    )  # hidden: natural convection
    dy[HOUSING] = (h.housing_k_w * lossy - cooling * y[HOUSING]) / h.housing_time_s
    load_nm = per_angle * spool
    rub = (
        h.rub_nm * (1.0 + math.sin(y[ANGLE] / t.gear_ratio * 3.0 + h.rub_phase_rad))
        if h.rub_nm != 0.0
        else 0.0
    )
    dry, dy[STUCK] = motor.dry(d, h, y[STUCK], y[SPEED], y[ANGLE], rub)
    total = (
        motor.torque(h, kt, y[CURRENT], y[ANGLE])
        - load_nm
        - dry
        - motor.gear_loss(t, h, load_nm, y[SPEED])
        - d.viscous_nm_s_rad * y[SPEED]
        - h.windage_nm_s2 * y[SPEED] * abs(y[SPEED])
    )
    dy[SPEED], dy[ANGLE] = total / d.inertia_kg_m2, y[SPEED]
    dy[PLACE] = y[RATE]
    dy[RATE], dy[KNEE_BRISTLE] = knee.acceleration(w, h, y[PLACE], y[RATE], y[KNEE_BRISTLE], along)
    if h.frame_m_n != 0.0:  # hidden: the frame behind the load cell gives way and swings
        f = 2.0 * math.pi * h.frame_hz
        dy[FRAME] = y[FRAME_RATE]
        dy[FRAME_RATE] = (
            f * f * (h.frame_m_n * force0 - y[FRAME])
            - 2.0 * h.frame_damping_ratio * f * y[FRAME_RATE]
        )


@compiled
def _lags(p, y, dy, j, gauge):
    """The pressure sensor's first-order lag; hidden: a second one behind it."""
    if p.sensors.pressure_lag_s > 0.0:
        dy[LAG + j] = (gauge - y[LAG + j]) / p.sensors.pressure_lag_s
    if p.hidden.pressure_time_s != 0.0:
        dy[LAG2 + j] = (y[LAG + j] - y[LAG2 + j]) / p.hidden.pressure_time_s
