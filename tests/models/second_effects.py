"""Effects of the second simulator, written from docs/plant.md like the rest: heat, sag, waves of
the torque, a spool that is not round, play, creep, low-speed and dry friction of motor, gear and
braid, drag, threshold, bladder, end fittings, lock. All absent at their neutral values.
"""

import math

from second_simulator import (
    ANGLE,
    BRANCHES,
    CREEP,
    CURRENT,
    FIRST_MUSCLE,
    HEAT,
    PER_MUSCLE,
    SLOW_HEAT,
    SPEED,
    SecondSimulator,
)


def wave(x, sine, cosine):
    return math.sin(x) + sine * math.sin(2 * x) + cosine * math.cos(2 * x)


class WithEffects(SecondSimulator):
    """Beside the nominal ones; the play's memory stands beside the states."""

    def __init__(self, params):
        self.play = None
        super().__init__(params)
        spool, start = self.p["transmission"], self.p["load"]["start_travel_m"]
        self.half = (
            0.5 * (spool["backlash_rad"] + spool["uneven_backlash_rad"]) * spool["spool_radius_m"]
        )  # on the mean
        self.play = (start, start)  # travel before and behind the play when the cycle began

    def wound_up(self, travel):
        angle = super().wound_up(travel)
        for _ in range(40):
            angle -= (self.wound(angle)[0] - travel) / self.wound(angle)[1]
        return angle

    def wound(self, angle):
        """Travel before the play and its slope over the motor's angle."""
        t = self.p["transmission"]
        turn, e, phase, g = (
            angle / t["gear_ratio"],
            t["eccentricity_ratio"],
            t["eccentricity_phase_rad"],
            t["wind_up_per_rad"],
        )
        return (
            t["spool_radius_m"]
            * (turn + g * turn**2 / 2 - e * (math.cos(turn + phase) - math.cos(phase))),
            t["spool_radius_m"] * (1 + g * turn + e * math.sin(turn + phase)) / t["gear_ratio"],
        )

    def travel(self, y):
        geared, slope = self.wound(y[ANGLE])
        if self.play is None or self.half == 0.0:
            return geared, slope * y[SPEED], slope
        behind, carried = self.behind_play(geared, y[SPEED])
        return behind, slope * carried * y[SPEED], slope

    def behind_play(self, geared, speed):
        """Travel behind the play, and its slope over the travel before it."""
        was, held = self.play
        spool = self.p["transmission"]
        moved, b = geared - was, spool["backlash_roundness_ratio"]
        swing = (
            1
            + math.sin(
                spool["backlash_per_turn_ratio"] * geared / spool["spool_radius_m"]
                + spool["backlash_phase_rad"]
            )
        ) / 2
        swing = 2 * swing ** spool["backlash_narrowness_ratio"] - 1
        half = (
            self.half
            + 0.5
            * spool["uneven_backlash_rad"]
            * spool["spool_radius_m"]
            * spool["backlash_wave_ratio"]
            * swing
        )
        sign = math.copysign(1.0, moved if moved != 0.0 else speed)
        gap, way = sign * (was - held), abs(moved)
        if b == 0.0:
            behind = min(max(held, geared - half), geared + half)
            at_flank = gap + way >= half * (1 - 1e-12)
            return behind, 1.0 if at_flank else 0.0
        if gap < 0.0:  # towards x, which stays
            if way <= -gap:
                return held, 0.0
            gap, way = 0.0, way + gap
        y = (-math.log1p(-((gap / half) ** (1 / b)))) if gap < half else math.inf
        after = ((half * y**b + way) / half) ** (1 / b)
        q = -math.expm1(-after)
        slope = 1.0 if q == 1.0 else 0.0 if q == 0.0 else 1 - (1 - q) * (after / q) ** (1 - b)
        return geared - sign * half * q**b, slope

    def rates(self, t, y, a, b, line, valves):
        dy, y, d = super().rates(t, y, a, b, line, valves), y.tolist(), self.p["drive"]
        steady = d["winding_thermal_k_w"] * d["winding_ohm"] * y[CURRENT] ** 2
        dy[HEAT] = (steady - y[HEAT]) / d["winding_time_s"]
        dy[SLOW_HEAT] = (steady - y[SLOW_HEAT]) / d["housing_time_s"]
        for j, i in enumerate(self.muscles):
            m = self.p["muscle"][i]
            speed = self.length(i, y)[1] if m["creep_stiffness_n_m"] else 0.0
            for branch in range(BRANCHES):
                n = FIRST_MUSCLE + PER_MUSCLE * j + CREEP + branch
                dy[n] = m["creep_slow_ratio"] ** branch * m["creep_stiffness_n_m"] * speed - y[
                    n
                ] / (10**branch * m["creep_time_s"])
        return dy

    def settled(self):
        super().settled()
        geared = self.wound(self.y[ANGLE])[0]
        if self.half:
            self.play = (geared, self.behind_play(geared, self.y[SPEED])[0])

    def torque_constant(self, y):
        d = self.p["drive"]
        return d["torque_constant_nm_a"] * max(
            1 - d["torque_loss_per_k"] * (y[HEAT] + d["housing_heat_ratio"] * y[SLOW_HEAT]), 0.1
        )

    def shaft_torque(self, kt, y):
        d = self.p["drive"]
        ripple = wave(
            d["ripple_per_turn_ratio"] * y[ANGLE] + d["ripple_phase_rad"],
            d["ripple_twice_sine_ratio"],
            d["ripple_twice_cosine_ratio"],
        )
        cogs = wave(
            d["cogging_per_turn_ratio"] * y[ANGLE] + d["cogging_phase_rad"],
            d["cogging_twice_sine_ratio"],
            d["cogging_twice_cosine_ratio"],
        )
        current = y[CURRENT] / (1 + d["torque_saturation_per_a"] * abs(y[CURRENT]))
        return kt * current * (1 + d["torque_ripple_ratio"] * ripple) + d["cogging_nm"] * cogs

    def dry(self, y):
        d = self.p["drive"]
        swing = d["friction_wave_ratio"] * math.sin(
            d["friction_wave_per_turn_ratio"] * y[ANGLE] + d["friction_wave_phase_rad"]
        )
        extra = d["stribeck_ratio"] * math.exp(
            -(abs(y[SPEED] / d["stribeck_speed_rad_s"]) ** d["stribeck_exponent_ratio"])
        )
        return d["coulomb_nm"] * (1 + extra) * (1 + swing)

    def drag(self, speed):
        uneven = self.p["drive"]["viscous_asymmetry_ratio"]
        return super().drag(speed) * (1 + uneven if speed > 0 else 1 - uneven)

    def gear(self, load, speed):
        t, eta = self.p["transmission"], self.p["transmission"]["gear_efficiency_ratio"]
        dry = t["gear_friction_n"] * t["spool_radius_m"] / t["gear_ratio"]
        along, against = abs(load) * (1 - eta), abs(load) * (1 / eta - 1)
        low, high = (-dry - along, dry + against) if load >= 0 else (-dry - against, dry + along)
        part, built = t["gear_sliding_ratio"], t["gear_friction_speed_rad_s"]

        def there(at):
            s, e = abs(speed) / at, t["gear_friction_sharpness_ratio"]
            return s / (1 + s**e) ** (1 / e)

        beta = there(built) if built else 1.0
        least = max(built, 0.5, part * max(high, -low) * 7e-4 / self.p["drive"]["inertia_kg_m2"])
        sliding = part * there(least) * (high if speed >= 0 else low) if part else 0.0
        return (1 - part) * beta * low, (1 - part) * beta * high, sliding

    def shape(self, i, length):
        m = self.p["muscle"][i]
        return super().shape(i, min(length + m["end_length_m"], m["braid_length_m"]))

    def reference_slope(self, i):
        return super().shape(i, self.p["muscle"][i]["slip_reference_length_m"])[1]

    def acting(self, m, gauge):
        acting = max(gauge - m["threshold_pa"], 0.0) if gauge > 0 else gauge - m["threshold_pa"]
        return acting / (1 + m["softening_per_pa"] * acting) if acting > 0 else acting

    def rubbing(self, m, speed):
        s = math.copysign(
            (abs(speed) / m["stribeck_speed_m_s"]) ** (1 / m["stribeck_breadth_ratio"]), speed
        )
        q = m["stribeck_tail_ratio"]
        fall = math.exp((1 - s * s) / 2) if q == 0 else (2 / (2 - q + q * s * s)) ** (1 / q)
        dry = m["coulomb_ratio"] * speed / math.sqrt(speed**2 + m["coulomb_speed_m_s"] ** 2)
        return m["stribeck_ratio"] * s * fall + dry + m["pressure_viscous_s_m"] * speed

    def held(self, m, length, stretch, speed):
        past = length - m["lock_length_m"]
        lock = 0.0
        if past > 0:
            lock = m["lock_stiffness_n_m"] * past * (
                1 + (m["lock_hardening_per_m"] * past) ** 2
            ) ** m["lock_steepening_ratio"] + m["lock_viscous_n_s_m"] * speed * min(
                past / m["take_up_m"], 1
            )
        return (
            m["bladder_stiffness_n_m"]
            * stretch
            * (1 + (m["bladder_hardening_per_m"] * stretch) ** 2)
            + lock
        )
