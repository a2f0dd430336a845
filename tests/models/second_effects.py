"""Effects of the second simulator, written from docs/plant.md like the rest: heat, sag, waves of the torque, a spool that is not round, play, creep,
low-speed and dry friction, drag, threshold, bladder, end fittings, lock. All absent at their neutral values.
"""

import math

from second_simulator import ANGLE, CURRENT, SPEED, SecondSimulator

BRANCHES = 5


def wave(x, sine, cosine):
    return math.sin(x) + sine * math.sin(2 * x) + cosine * math.cos(2 * x)


class WithEffects(SecondSimulator):
    """States beyond the nominal ones: winding heat, slow heat, five creep forces for each muscle; the play's memory stands beside them."""

    def __init__(self, params, place):
        self.play = None
        super().__init__(params, place)
        spool, start = self.p["transmission"], float(self.p["load"]["start_travel_m"])
        for _ in range(40):
            self.y[ANGLE] -= (self.wound(self.y[ANGLE])[0] - start) / self.wound(self.y[ANGLE])[1]
        self.half = 0.5 * float((spool["backlash_rad"] + spool["uneven_backlash_rad"]) * spool["spool_radius_m"])  # on the mean
        self.play = (start, start)  # travel before and behind the play when the cycle began

    def more_states(self):
        return 2 + BRANCHES * len(self.muscles)

    def wound(self, angle):
        """Travel before the play and its slope over the motor's angle."""
        t = self.p["transmission"]
        turn, e, phase, g = angle / t["gear_ratio"], t["eccentricity_ratio"], t["eccentricity_phase_rad"], t["wind_up_per_rad"]
        return (float(t["spool_radius_m"] * (turn + g * turn**2 / 2 - e * (math.cos(turn + phase) - math.cos(phase)))),
                float(t["spool_radius_m"] * (1 + g * turn + e * math.sin(turn + phase)) / t["gear_ratio"]))

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
        moved, b = geared - was, float(spool["backlash_roundness_ratio"])
        swing = (1 + math.sin(float(spool["backlash_per_turn_ratio"]) * geared / float(spool["spool_radius_m"]) + float(spool["backlash_phase_rad"]))) / 2
        swing = 2 * swing ** float(spool["backlash_narrowness_ratio"]) - 1
        half = self.half + 0.5 * float(spool["uneven_backlash_rad"] * spool["spool_radius_m"] * spool["backlash_wave_ratio"]) * swing
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

    def rates(self, t, y, k, line, valves):
        dy = super().rates(t, y, k, line, valves)
        d, at = self.p["drive"], len(y) - self.more_states()
        steady = d["winding_thermal_k_w"] * d["winding_ohm"] * y[CURRENT] ** 2
        dy[at] = (steady - y[at]) / d["winding_time_s"]
        dy[at + 1] = (steady - y[at + 1]) / d["housing_time_s"]
        for j, i in enumerate(self.muscles):
            m, speed = self.p["muscle"][i], self.length(i, y)[1]
            for branch in range(BRANCHES):
                n = at + 2 + BRANCHES * j + branch
                dy[n] = m["creep_slow_ratio"] ** branch * m["creep_stiffness_n_m"] * speed - y[n] / (10**branch * m["creep_time_s"])
        return dy

    def settled(self):
        geared = self.wound(self.y[ANGLE])[0]
        if self.half:
            self.play = (geared, self.behind_play(geared, self.y[SPEED])[0])

    def torque_constant(self, y):
        d, at = self.p["drive"], len(y) - self.more_states()
        return d["torque_constant_nm_a"] * max(1 - d["torque_loss_per_k"] * (y[at] + d["housing_heat_ratio"] * y[at + 1]), 0.1)

    def shaft_torque(self, kt, y):
        d = self.p["drive"]
        ripple = wave(d["ripple_per_turn_ratio"] * y[ANGLE] + d["ripple_phase_rad"], d["ripple_twice_sine_ratio"], d["ripple_twice_cosine_ratio"])
        cogs = wave(d["cogging_per_turn_ratio"] * y[ANGLE] + d["cogging_phase_rad"], d["cogging_twice_sine_ratio"], d["cogging_twice_cosine_ratio"])
        current = y[CURRENT] / (1 + d["torque_saturation_per_a"] * abs(y[CURRENT]))
        return kt * current * (1 + d["torque_ripple_ratio"] * ripple) + d["cogging_nm"] * cogs

    def dry(self, speed):
        d = self.p["drive"]
        return d["coulomb_nm"] * (1 + d["stribeck_ratio"] * math.exp(-abs(speed / d["stribeck_speed_rad_s"]) ** d["stribeck_exponent_ratio"]))

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

    def more_friction(self, m, gauge, speed):
        acting = max(gauge - m["threshold_pa"], 0.0) if gauge > 0 else gauge - m["threshold_pa"]
        acting = acting / (1 + m["softening_per_pa"] * acting) if acting > 0 else acting
        s = math.copysign((abs(speed) / m["stribeck_speed_m_s"]) ** (1 / m["stribeck_breadth_ratio"]), speed)
        q = m["stribeck_tail_ratio"]
        fall = math.exp((1 - s * s) / 2) if q == 0 else (2 / (2 - q + q * s * s)) ** (1 / q)
        dry = m["coulomb_ratio"] * speed / math.sqrt(speed**2 + m["coulomb_speed_m_s"] ** 2)
        return acting, m["stribeck_ratio"] * s * fall + dry + m["pressure_viscous_s_m"] * speed

    def relaxing(self, i, y):
        at = len(y) - self.more_states() + 2 + BRANCHES * self.muscles.index(i)
        return sum(y[at:at + BRANCHES])

    def held(self, m, length, stretch, speed):
        past = length - m["lock_length_m"]
        lock = 0.0
        if past > 0:
            lock = m["lock_stiffness_n_m"] * past * (1 + (m["lock_hardening_per_m"] * past) ** 2) ** m["lock_steepening_ratio"] + m["lock_viscous_n_s_m"] * speed * min(past / m["take_up_m"], 1)
        return m["bladder_stiffness_n_m"] * stretch * (1 + (m["bladder_hardening_per_m"] * stretch) ** 2) + lock
