"""A second simulator, written from docs/plant.md in plain Python and scipy; shares no physics code
with the blocks.

Here: time, drive, wiring and McKibben muscle. Beside it: bus, gas, braid, knee, sensors
(second_*.py); further effects: second_effects.py.
"""

import math

import numpy as np
import second_braid as braid
import second_bus as bus
import second_gas as gas
import second_knee as knee
import second_sensors as sensors
from scipy.integrate import solve_ivp

PERIOD_S = 1e-3
(
    ANGLE,
    SPEED,
    CURRENT,
    INTEGRAL,
    STUCK,
    PLACE,
    RATE,
    BENT,
    DRAWN,
    DRAWN_RATE,
    HEAT,
    SLOW_HEAT,
    FIRST_MUSCLE,
) = range(13)
CREEP, BRANCHES, PER_MUSCLE = (
    4,
    5,
    9,
)  # of a muscle: c, mass, inlet opening, exhaust opening, creep forces


def plain(record):
    """A record of one row as plain numbers, lists and dicts: numpy's own scalars take most of a
    run.
    """
    if record.dtype.names:
        return (
            {name: plain(record[name]) for name in record.dtype.names}
            if record.ndim == 0
            else [plain(row) for row in record]
        )
    return record.tolist()


class SecondSimulator:
    parts = 1  # of a cycle, after each of which elements with memory settle

    def __init__(self, params):
        self.p = plain(params[0])
        self.muscles = [i for i in (0, 1) if self.p["muscle"][i]["present"] > 0.5]
        self.y = np.zeros(FIRST_MUSCLE + PER_MUSCLE * len(self.muscles))
        spool, start = self.p["transmission"], self.p["load"]["start_travel_m"]
        self.metres_per_rad = spool["spool_radius_m"] / spool["gear_ratio"]
        self.y[ANGLE] = self.wound_up(start)
        self.stretched = [0.0, 0.0]  # straps
        self.y[PLACE] = knee.rest_place(self.p["load"], self.rest_force)
        for j, i in enumerate(self.muscles):
            g, at = self.p["gas"][i], FIRST_MUSCLE + PER_MUSCLE * j
            volume, _ = self.shape(i, self.length(i, self.y)[0])
            self.y[at] = g["atmosphere_pa"] * volume ** gas.exponent(g)
            self.y[at + 1] = (
                g["atmosphere_pa"] * volume / (g["gas_constant_j_kg_k"] * g["temperature_k"])
            )
        self.settled_at = [
            self.length(i, self.y)[0] for i in (0, 1)
        ]  # lengths of the braids when their elements settled
        self.elements = [[0.0] * braid.ELEMENTS for _ in (0, 1)]

    def wound_up(self, travel):
        """Motor angle at a travel."""
        return travel / self.metres_per_rad

    def rest_force(self, place):
        """Along q at rest: the muscles at gauge 0, without friction and without a slope of their
        volume.
        """
        y = np.zeros_like(self.y)
        y[ANGLE], y[PLACE] = self.y[ANGLE], place
        total = 0.0
        for i in self.muscles:
            m, length = self.p["muscle"][i], self.length(i, y)[0]
            stretch = length + m["end_length_m"] - m["braid_length_m"] / math.sqrt(3)
            if stretch > 0:
                force = braid.law(m, self.acting(m, 0.0), 0.0, stretch, 0.0) + self.held(
                    m, length, stretch, 0.0
                )
                total -= self.p["load"][f"load{i}_ratio"] * max(force, 0.0)
        return total

    def settled(self):
        """After a part of a cycle: memory that is no smooth state."""
        for j, i in enumerate(self.muscles):
            y = self.y.tolist()
            length, speed = self.length(i, y)
            now = length - self.stretched[i]
            force, way = self.pull(j, i, y)[3], now - self.settled_at[i]
            self.elements[i] = braid.displaced(self.p["muscle"][i], self.elements[i], way, speed)
            self.elements[i][braid.WAY] += abs(way)
            self.settled_at[i], self.stretched[i] = now, braid.strap(self.p["muscle"][i], force)

    def travel(self, y):
        """Travel of the strap, its speed, and how much load torque a newton makes."""
        return self.metres_per_rad * y[ANGLE], self.metres_per_rad * y[SPEED], self.metres_per_rad

    def length(self, i, y):
        w = self.p["load"]
        a, b, (q, arm), (travel, speed, _) = (
            w[f"travel{i}_ratio"],
            w[f"load{i}_ratio"],
            knee.lever(w, y[PLACE]),
            self.travel(y),
        )
        return w[f"rest{i}_m"] + a * travel + b * q, a * speed + b * arm * y[RATE]

    def shape(self, i, length):
        m = self.p["muscle"][i]
        b, n = m["braid_length_m"], m["braid_turns_ratio"]
        thread = max(length, b / math.sqrt(3))
        return (
            (b**2 - thread**2) * thread / (4 * math.pi * n**2) + self.p["gas"][i]["dead_volume_m3"],
            (3 * thread**2 - b**2) / (4 * math.pi * n**2),
        )

    def pull(self, j, i, y):
        m, g = self.p["muscle"][i], self.p["gas"][i]
        at = FIRST_MUSCLE + PER_MUSCLE * j
        line, speed = self.length(i, y)
        length = line - self.stretched[i]
        volume, slope = self.shape(i, length)
        pressure = y[at] / volume ** gas.exponent(g)
        stretch = length + m["end_length_m"] - m["braid_length_m"] / math.sqrt(3)
        if stretch <= 0:
            return volume, pressure, speed, 0.0
        acting = self.acting(m, pressure - g["atmosphere_pa"])
        elements = braid.displaced(m, self.elements[i], length - self.settled_at[i], speed)
        rubbing = (
            (braid.friction(m, elements, length) + self.rubbing(m, speed))
            * max(acting, 0.0)
            * self.reference_slope(i)
        )
        grip = min(stretch / m["take_up_m"], 1.0)
        force = braid.law(m, acting, slope, stretch, speed) + self.held(m, length, stretch, speed)
        force += grip * (
            m["viscous_n_s_m"] * speed + rubbing + sum(y[at + CREEP : at + CREEP + BRANCHES])
        )
        return volume, pressure, speed, max(force, 0.0)

    def reference_slope(self, i):
        return self.shape(i, self.p["muscle"][i]["slip_reference_length_m"])[1]

    def acting(self, m, gauge):
        """Pressure that acts."""
        return gauge

    def rubbing(self, m, speed):
        """Friction of the braid beside its elements with memory, over the reference force."""
        return 0.0

    def held(self, m, length, stretch, speed):
        """What pulls beside the braid."""
        return 0.0

    def rates(self, t, y, a, b, line, valves):
        """Rates of the smooth states in the part from a to b (cycles) of the run."""
        y, dy, forces, total = y.tolist(), [0.0] * len(y), [0.0, 0.0], 0.0
        for j, i in enumerate(self.muscles):
            g, at = self.p["gas"][i], FIRST_MUSCLE + PER_MUSCLE * j
            volume, pressure, _, forces[i] = self.pull(j, i, y)
            drawn, lost = gas.flows(g, y[at + 2], y[at + 3], y[DRAWN], pressure, volume)
            dy[at], dy[at + 1] = gas.rates(g, y[at + 1], pressure, volume, drawn, lost)
            dy[at + 2] = (valves[i] - y[at + 2]) / g["valve_lag_s"]
            dy[at + 3] = (valves[2 + i] - y[at + 3]) / g["valve_lag_s"]
            total += drawn
        dy[DRAWN], dy[DRAWN_RATE] = gas.regulator(self.p["gas"][0], y[DRAWN], y[DRAWN_RATE], total)
        self._motor(dy, y, (t / PERIOD_S - a) / (b - a), line, forces)
        w = self.p["load"]
        if w["kind_code"]:
            pushed, inertia = knee.acceleration(
                w, y[PLACE], y[RATE], -(forces[0] * w["load0_ratio"] + forces[1] * w["load1_ratio"])
            )
            friction, dy[BENT] = knee.dry(w, y[RATE], y[BENT])
            dy[PLACE], dy[RATE] = y[RATE], pushed - friction / inertia
        return dy

    def wanted(self, dy, y, part, line):
        """Current that the loops want; the speed loop's integral runs."""
        d = self.p["drive"]
        most = d["max_current_a"]
        if not line["enabled"]:
            return 0.0
        if line["mode"] == 10:
            return min(max(line["torque"] / d["torque_constant_nm_a"], -most), most)
        if line["mode"] == 9:
            speed = bus.along(line["speed"], part)
        else:
            speed = d["position_gain_per_s"] * (bus.along(line["angle"], part) - y[ANGLE]) + d[
                "feedforward_ratio"
            ] * bus.along(line["slope"], part)
        error = min(max(speed, -d["max_speed_rad_s"]), d["max_speed_rad_s"]) - y[SPEED]
        free = d["speed_gain_a_s_rad"] * error + y[INTEGRAL]
        cut = min(max(free, -most), most)
        dy[INTEGRAL] = d["speed_integral_a_rad"] * (error + (cut - free) / d["speed_gain_a_s_rad"])
        return cut

    def _motor(self, dy, y, part, line, forces):
        d, w = self.p["drive"], self.p["load"]
        kt, wanted = self.torque_constant(y), self.wanted(dy, y, part, line)
        volt = d["supply_v"] - d["bus_sag_ohm"] * abs(y[CURRENT])
        wanted = min(
            max(wanted, (-volt - kt * y[SPEED]) / d["winding_ohm"]),
            (volt - kt * y[SPEED]) / d["winding_ohm"],
        )
        dy[CURRENT] = (wanted - y[CURRENT]) / d["current_lag_s"]
        stiffness, tau = d["presliding_stiffness_nm_rad"], d["presliding_time_s"]
        load = self.travel(y)[2] * (forces[0] * w["travel0_ratio"] + forces[1] * w["travel1_ratio"])
        low, high, sliding = self.gear(load, y[SPEED])
        friction = min(
            max(stiffness * (y[STUCK] + tau * y[SPEED]), low - self.dry(y)), high + self.dry(y)
        )
        dy[STUCK] = (friction / stiffness - y[STUCK]) / tau
        torque = self.shaft_torque(kt, y) - load - friction - sliding - self.drag(y[SPEED])
        dy[SPEED], dy[ANGLE] = torque / d["inertia_kg_m2"], y[SPEED]

    def dry(self, y):
        """Limit of the motor's own dry friction."""
        return self.p["drive"]["coulomb_nm"]

    def drag(self, speed):
        return self.p["drive"]["viscous_nm_s_rad"] * speed

    def gear(self, load, speed):
        """What the gear's friction adds to both limits, and what it takes of the torque in motion
        alone.
        """
        return 0.0, 0.0, 0.0

    def torque_constant(self, y):
        return self.p["drive"]["torque_constant_nm_a"]

    def shaft_torque(self, kt, y):
        return kt * y[CURRENT]

    def run(self, commands):
        """Noise-free readings of a log."""
        return sensors.readings(self.p, self.truths(commands), PERIOD_S)

    def truths(self, commands):
        """Truths at rest and at every cycle's end, a list for each channel."""
        b, out, scale = self.p["bus"], {}, np.ones_like(self.y)
        scale[[SPEED, RATE]] = 1e3  # a load that sticks by its bristles trembles within less
        for j in range(len(self.muscles)):
            at = FIRST_MUSCLE + PER_MUSCLE * j
            scale[at : at + 2] = self.y[at : at + 2]
        rows, late, valve_late = (
            bus.lines(commands, PERIOD_S),
            b["command_delay_s"] / PERIOD_S,
            b["valve_delay_s"] / PERIOD_S,
        )
        self.write(out)
        for k in range(len(rows)):
            self.y[INTEGRAL] = bus.integral(rows, k, late, self.y[INTEGRAL], self.y[CURRENT])
            for start in (k + part / self.parts for part in range(self.parts)):
                end = start + 1 / self.parts
                seen = (
                    start,
                    end,
                    bus.seen(rows, start, end, late),
                    bus.valves(rows, start, end, valve_late, b["valve_skew_ratio"]),
                )
                self.y = solve_ivp(
                    self.rates,
                    (start * PERIOD_S, end * PERIOD_S),
                    self.y,
                    args=seen,
                    rtol=1e-6,
                    atol=1e-8 * scale,
                    first_step=1.5e-4,
                ).y[:, -1]
                self.settled()
            self.write(out)
        return out

    def write(self, out):
        """The truths as they are."""
        y, w, g = self.y.tolist(), self.p["load"], self.p["gas"]
        atmosphere, force, pressure = g[0]["atmosphere_pa"], [0.0, 0.0], [g[0]["atmosphere_pa"]] * 2
        for j, i in enumerate(self.muscles):
            _, pressure[i], _, force[i] = self.pull(j, i, y)
        turns = w["kind_code"] == 2
        truth = {
            "motor_angle_rad": y[ANGLE],
            "motor_speed_rad_s": y[SPEED],
            "motor_current_a": y[CURRENT],
            "muscle0_pa": pressure[0],
            "force_n": force[0],
            "muscle0_gauge_pa": pressure[0] - atmosphere,
            "muscle1_gauge_pa": pressure[1] - atmosphere,
            "supply_gauge_pa": gas.supply(g[0], y[DRAWN]) - atmosphere,
            "joint_angle_rad": y[PLACE] if turns else 0.0,
            "joint_speed_rad_s": y[RATE] if turns else 0.0,
            "load_position_m": knee.lever(w, y[PLACE])[0],
        }
        for name, value in truth.items():
            out.setdefault(name, []).append(value)
