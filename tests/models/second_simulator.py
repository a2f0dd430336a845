"""A second simulator, written from docs/plant.md in plain Python and scipy; shares no physics code with the blocks.

Covers what the nominal plants and bench_physical use: all drive loops, wiring, McKibben law, slip friction, leak,
polytropic gas, valves, mass-less load cell and knee, pressure lag, encoder hold. Effects: second_effects.py.
"""

import math

import numpy as np
from scipy.integrate import solve_ivp

PERIOD_S = 1e-3
ANGLE, SPEED, CURRENT, INTEGRAL, STUCK, PLACE, RATE = range(7)
FIRST_MUSCLE, PER_MUSCLE = 7, 8  # c, mass, inlet opening, exhaust opening, four slip deflections


class SecondSimulator:
    def __init__(self, params, place: float):
        p = params[0]
        self.p = {name: p[name] for name in p.dtype.names}
        self.muscles = [i for i in (0, 1) if p["muscle"][i]["present"] > 0.5]
        self.y = np.zeros(FIRST_MUSCLE + PER_MUSCLE * len(self.muscles) + self.more_states())
        self.y[PLACE] = place
        gear = self.p["transmission"]
        self.metres_per_rad = float(gear["spool_radius_m"] / gear["gear_ratio"])
        self.y[ANGLE] = float(self.p["load"]["start_travel_m"]) / self.metres_per_rad
        for j, i in enumerate(self.muscles):
            gas = self.p["gas"][i]
            volume, _ = self.shape(i, self.length(i, self.y)[0])
            at = FIRST_MUSCLE + PER_MUSCLE * j
            self.y[at] = gas["atmosphere_pa"] * volume ** gas["polytropic_ratio"]
            self.y[at + 1] = gas["atmosphere_pa"] * volume / (gas["gas_constant_j_kg_k"] * gas["temperature_k"])

    def more_states(self):
        return 0

    def settled(self):
        """After a cycle: memory that is no smooth state."""

    def travel(self, y):
        """Travel of the strap, its speed, and how much load torque a newton makes."""
        return self.metres_per_rad * y[ANGLE], self.metres_per_rad * y[SPEED], self.metres_per_rad

    def length(self, i, y):
        w = self.p["load"]
        arm = w["lever_m"] if w["kind_code"] == 2 else 1.0
        a, b = w[f"travel{i}_ratio"], w[f"load{i}_ratio"]
        travel, speed, _ = self.travel(y)
        return w[f"rest{i}_m"] + a * travel + b * arm * y[PLACE], a * speed + b * arm * y[RATE]

    def shape(self, i, length):
        m = self.p["muscle"][i]
        b, n = m["braid_length_m"], m["braid_turns_ratio"]
        braid = max(length, b / math.sqrt(3))
        return ((b**2 - braid**2) * braid / (4 * math.pi * n**2) + self.p["gas"][i]["dead_volume_m3"],
                (3 * braid**2 - b**2) / (4 * math.pi * n**2))

    def pull(self, j, i, y):
        m, g = self.p["muscle"][i], self.p["gas"][i]
        at = FIRST_MUSCLE + PER_MUSCLE * j
        length, speed = self.length(i, y)
        volume, slope = self.shape(i, length)
        pressure = y[at] / volume ** g["polytropic_ratio"]
        gauge = pressure - g["atmosphere_pa"]
        stretch = length + m["end_length_m"] - m["braid_length_m"] / math.sqrt(3)
        if stretch <= 0:
            return volume, pressure, speed, 0.0
        slip = sum(m[f"slip{k}_ratio"] * y[at + 3 + k] / m[f"slip{k}_m"] for k in (1, 2, 3, 4)) * m["slip_ratio"]
        acting, ratio = self.more_friction(m, gauge, speed)
        reference = max(acting, 0.0) * self.reference_slope(i)
        grip = min(stretch / m["take_up_m"], 1.0)
        force = acting * slope + grip * (m["viscous_n_s_m"] * speed + (slip + ratio) * reference + self.relaxing(i, y)) + self.held(m, length, stretch, speed)
        return volume, pressure, speed, max(force, 0.0)

    def reference_slope(self, i):
        return self.shape(i, self.p["muscle"][i]["slip_reference_length_m"])[1]

    def more_friction(self, m, gauge, speed):
        """Pressure that acts, and friction of the braid beside its slip over the reference force."""
        return gauge, 0.0

    def relaxing(self, i, y):
        return 0.0

    def held(self, m, length, stretch, speed):
        """What pulls beside the braid."""
        return 0.0

    def orifice(self, conductance, g, from_pa, to_pa):
        if from_pa < to_pa:
            return -self.orifice(conductance, g, to_pa, from_pa)
        ratio, critical = to_pa / from_pa, g["critical_ratio"]
        inside = min(max((ratio - critical) / (1 - critical), 0.0), (0.999 - critical) / (1 - critical))
        phi = math.sqrt(1 - inside**2)
        if ratio > 0.999:
            phi *= (1 - ratio) / 0.001
        return conductance * 1.185 * from_pa * math.sqrt(293.15 / g["temperature_k"]) * phi

    def through(self, opening, seat, conductance, g, from_pa, to_pa):
        """A valve, or what its seat leaks where that is more."""
        if opening >= seat:
            return opening * self.orifice(conductance, g, from_pa, to_pa)
        part, high, low = g["leak_laminar_ratio"], max(from_pa, to_pa), min(from_pa, to_pa)
        narrow = math.copysign(seat * conductance * 1.185 * high * math.sqrt(293.15 / g["temperature_k"]) * (1 - (low / high) ** 2), from_pa - to_pa)
        return (1 - part) * seat * self.orifice(conductance, g, from_pa, to_pa) + part * narrow

    def rates(self, t, y, k, line, valves):
        dy = np.zeros_like(y)
        forces = [0.0, 0.0]
        for j, i in enumerate(self.muscles):
            g, m, at = self.p["gas"][i], self.p["muscle"][i], FIRST_MUSCLE + PER_MUSCLE * j
            volume, pressure, speed, forces[i] = self.pull(j, i, y)
            above = pressure - g["atmosphere_pa"]
            drawn = self.through(y[at + 2], g["inlet_seat_leak_ratio"], g["inlet_conductance_m3_s_pa"], g, g["atmosphere_pa"] + g["supply_gauge_pa"], pressure)
            lost = self.through(y[at + 3], g["exhaust_seat_leak_ratio"], g["exhaust_conductance_m3_s_pa"], g, pressure, g["atmosphere_pa"])
            thermal = g["gas_constant_j_kg_k"] * g["temperature_k"]
            lost += g["leak_per_s"] * above * (1 + g["leak_laminar_ratio"] * above / (2 * g["atmosphere_pa"])) * volume / thermal
            dy[at] = volume ** (g["polytropic_ratio"] - 1) * thermal * (drawn - lost)
            dy[at + 1] = drawn - lost
            dy[at + 2] = (valves[i] - y[at + 2]) / g["valve_lag_s"]
            dy[at + 3] = (valves[2 + i] - y[at + 3]) / g["valve_lag_s"]
            for s in (1, 2, 3, 4):
                limit, d = m[f"slip{s}_m"], y[at + 3 + s]
                dy[at + 3 + s] = 0.0 if (d >= limit and speed > 0) or (d <= -limit and speed < 0) else speed
        self._motor(dy, y, t / PERIOD_S - k, line, forces)
        if self.p["load"]["kind_code"] == 2:
            self._knee(dy, y, forces)
        return dy

    def _motor(self, dy, y, part, line, forces):
        d, w = self.p["drive"], self.p["load"]
        wanted, dy[INTEGRAL] = 0.0, 0.0
        if line["enabled"]:
            if line["mode"] == 9:
                speed = line["speed"][0] + part * (line["speed"][1] - line["speed"][0])
            else:
                target = line["angle"][0] + part * (line["angle"][1] - line["angle"][0])
                slope = line["slope"][0] + part * (line["slope"][1] - line["slope"][0])
                speed = d["position_gain_per_s"] * (target - y[ANGLE]) + d["feedforward_ratio"] * slope
            error = min(max(speed, -d["max_speed_rad_s"]), d["max_speed_rad_s"]) - y[SPEED]
            free = d["speed_gain_a_s_rad"] * error + y[INTEGRAL]
            wanted = min(max(free, -d["max_current_a"]), d["max_current_a"])
            dy[INTEGRAL] = d["speed_integral_a_rad"] * (error + (wanted - free) / d["speed_gain_a_s_rad"])
        kt = self.torque_constant(y)
        volt = d["supply_v"] - d["bus_sag_ohm"] * abs(y[CURRENT])
        wanted = min(max(wanted, (-volt - kt * y[SPEED]) / d["winding_ohm"]), (volt - kt * y[SPEED]) / d["winding_ohm"])
        dy[CURRENT] = (wanted - y[CURRENT]) / d["current_lag_s"]
        stiffness, tau = d["presliding_stiffness_nm_rad"], d["presliding_time_s"]
        load = self.travel(y)[2] * (forces[0] * w["travel0_ratio"] + forces[1] * w["travel1_ratio"])
        low, high, sliding = self.gear(load, y[SPEED])
        friction = min(max(stiffness * (y[STUCK] + tau * y[SPEED]), low - self.dry(y[SPEED])), high + self.dry(y[SPEED]))
        dy[STUCK] = (friction / stiffness - y[STUCK]) / tau
        torque = self.shaft_torque(kt, y) - load - friction - sliding - d["viscous_nm_s_rad"] * y[SPEED]
        dy[SPEED], dy[ANGLE] = torque / d["inertia_kg_m2"], y[SPEED]

    def dry(self, speed):
        """Limit of the motor's own dry friction."""
        return self.p["drive"]["coulomb_nm"]

    def gear(self, load, speed):
        """What the gear's friction adds to both limits, and what it takes of the torque in motion alone."""
        return 0.0, 0.0, 0.0

    def torque_constant(self, y):
        return self.p["drive"]["torque_constant_nm_a"]

    def shaft_torque(self, kt, y):
        return kt * y[CURRENT]

    def _knee(self, dy, y, forces):
        w, th, speed = self.p["load"], y[PLACE], y[RATE]
        pull = -w["lever_m"] * (forces[0] * w["load0_ratio"] + forces[1] * w["load1_ratio"])
        stop = 0.0
        for depth, sign in ((w["low_rad"] - th, 1.0), (th - w["high_rad"], -1.0)):
            if depth > 0:
                push = w["stop_stiffness_nm_rad"] * depth - sign * w["stop_viscous_nm_s_rad"] * speed * min(1e3 * depth, 1)
                stop += sign * max(push, 0.0)
        hung = w["payload_kg"] * w["payload_lever_ratio"]
        weight = (w["mass_kg"] + hung) * w["gravity_m_s2"] * w["mass_lever_m"] * math.sin(w["hang_rad"] + th)
        inertia = max(w["inertia_kg_m2"] + hung * w["payload_lever_ratio"] * w["mass_lever_m"] ** 2, 0.1 * w["inertia_kg_m2"])
        dy[PLACE] = speed
        dy[RATE] = (pull - weight - w["viscous_nm_s_rad"] * speed + stop) / inertia

    def lines(self, commands):
        """Per cycle the straight lines of the targets: angle, slope and speed at start and end."""
        lines = []
        for k, command in enumerate(commands):
            enabled, mode = command["enabled"] > 0.5, int(command["mode"])
            last = lines[-1] if k else {"enabled": False, "mode": 0}
            target, speed = float(command["target_angle_rad"]), float(command["target_speed_rad_s"])
            running = enabled and last["enabled"]
            line = {"enabled": enabled, "mode": mode, "speed": (speed, speed), "fresh": not running}
            slope = last["speed"][1] if running and mode == 8 and last["mode"] == 9 else 0.0
            line["angle"], line["slope"] = (target - slope * PERIOD_S, target), (slope, slope)
            if running and mode == last["mode"] == 8:
                start = last["angle"][1]
                line["angle"], line["slope"] = (start, target), (last["slope"][1], (target - start) / PERIOD_S)
            if running and mode == last["mode"] == 9:
                line["speed"] = (last["speed"][1], speed)
            lines.append(line)
        return lines

    def run(self, commands):
        """Noise-free readings, one dict of lists over the log."""
        out = {name: [] for name in ("motor_angle_rad", "motor_speed_rad_s", "motor_current_a", "motor_torque_nm",
                                     "muscle0_gauge_pa", "muscle1_gauge_pa", "force_n", "joint_angle_rad", "joint_speed_rad_s")}
        hold = max(int(self.p["sensors"]["encoder_hold_s"] / PERIOD_S + 0.5), 1)
        read, before = [0.0, 0.0], [0.0, 0.0]
        lag = float(self.p["sensors"]["pressure_lag_s"])
        scale = np.ones_like(self.y)
        for j in range(len(self.muscles)):
            at = FIRST_MUSCLE + PER_MUSCLE * j
            scale[at:at + 2] = self.y[at:at + 2]
        for k, line in enumerate(self.lines(commands)):
            valves = (*commands["inlet"][k], *commands["exhaust"][k])
            if line["fresh"]:
                self.y[INTEGRAL] = self.y[CURRENT] if line["enabled"] else 0.0
            solved = solve_ivp(self.rates, (k * PERIOD_S, (k + 1) * PERIOD_S), self.y, args=(k, line, valves),
                               method="RK45", rtol=1e-6, atol=1e-8 * scale, first_step=1.5e-4)
            self.y = solved.y[:, -1]
            self.settled()
            gauge, force = [0.0, 0.0], [0.0, 0.0]
            for j, i in enumerate(self.muscles):
                _, pressure, _, force[i] = self.pull(j, i, self.y)
                gauge[i] = pressure - self.p["gas"][i]["atmosphere_pa"]
            for i in (0, 1):
                behind = (gauge[i] - before[i]) / PERIOD_S * lag
                read[i] = gauge[i] - behind + (read[i] - before[i] + behind) * math.exp(-PERIOD_S / lag)
                before[i] = gauge[i]
            fresh = k % hold == 0
            out["motor_angle_rad"].append(self.y[ANGLE] if fresh else out["motor_angle_rad"][-1])
            out["motor_speed_rad_s"].append(self.y[SPEED] if fresh else out["motor_speed_rad_s"][-1])
            out["motor_current_a"].append(self.y[CURRENT])
            out["motor_torque_nm"].append(self.p["drive"]["torque_constant_nm_a"] * self.y[CURRENT])
            out["muscle0_gauge_pa"].append(read[0])
            out["muscle1_gauge_pa"].append(read[1])
            out["force_n"].append(force[0])
            knee = self.p["load"]["kind_code"] == 2
            out["joint_angle_rad"].append(self.y[PLACE] if knee else 0.0)
            out["joint_speed_rad_s"].append(self.y[RATE] if knee else 0.0)
        return out
