"""A muscle's gas behind two valves, for the valve tests only: independent of the plant in
models/.
"""

import math
import random
from collections import deque
from dataclasses import dataclass, field

ATMOSPHERE_PA = 101325.0
WALL_K = 293.15
R = 287.0
GAMMA = 1.4


def flow_kg_s(conductance, upstream_pa, downstream_pa, critical_ratio):
    """ISO 6358: conductance in m3/(s Pa)."""
    if upstream_pa <= downstream_pa:
        return 0.0
    choked = conductance * upstream_pa * 1.185
    ratio = downstream_pa / upstream_pa
    if ratio <= critical_ratio:
        return choked
    part = (ratio - critical_ratio) / (1.0 - critical_ratio)
    return choked * math.sqrt(1.0 - part * part)


class Valve:
    """Dead time, first-order lag, and an opening below which nothing flows."""

    def __init__(self, dead_s, lag_s, dead_band=0.0):
        self.delay_s, self.lag_s, self.dead_band = dead_s, lag_s, dead_band
        self.opening = 0.0
        self.queue = None
        self.stuck = None

    def step(self, wanted, dt_s):
        if self.queue is None:
            n = round(self.delay_s / dt_s)
            self.queue = deque([0.0] * n)
        self.queue.append(float(wanted))
        self.opening += (1.0 - math.exp(-dt_s / self.lag_s)) * (self.queue.popleft() - self.opening)
        if self.stuck is not None:
            return self.stuck
        return max(0.0, (self.opening - self.dead_band) / (1.0 - self.dead_band))


@dataclass
class Gas:
    """Mass and temperature in a closed volume; heat_s is the time constant to the wall (0:
    isothermal).
    """

    volume_m3: float = 50e-6
    inlet_conductance: float = 1e-9
    exhaust_conductance: float = 1e-9
    supply_pa: float = 950e3
    dead_s: float = 0.01
    lag_s: float = 0.005
    dead_band: float = 0.0
    heat_s: float = 0.0
    leak_1_s: float = 0.0
    critical_ratio: float = 0.35
    noise_pa: float = 600.0
    adc_step_pa: float = 1200.0
    start_pa: float = ATMOSPHERE_PA
    tank_kg: float = math.inf  # of supply; finite runs empty
    seed: int = 0
    pressure_pa: float = field(init=False)

    def __post_init__(self):
        self.pressure_pa = self.start_pa
        self.temperature_k = WALL_K
        self.inlet = Valve(self.dead_s, self.lag_s, self.dead_band)
        self.exhaust = Valve(self.dead_s, self.lag_s, self.dead_band)
        self.noise = random.Random(self.seed)

    def step(self, inlet, exhaust, dt_s):
        """Explicit Euler; fine at 1 ms against time constants of a second."""
        a_in = self.inlet.step(inlet, dt_s)
        a_out = self.exhaust.step(exhaust, dt_s)
        p, t = self.pressure_pa, self.temperature_k
        m_in = a_in * flow_kg_s(self.inlet_conductance, self.supply_pa, p, self.critical_ratio)
        m_out = a_out * flow_kg_s(self.exhaust_conductance, p, ATMOSPHERE_PA, self.critical_ratio)
        mass = p * self.volume_m3 / (R * t)
        m_leak = self.leak_1_s * mass * max(0.0, 1.0 - ATMOSPHERE_PA / p)
        self.tank_kg -= m_in * dt_s
        if self.tank_kg <= 0.0:
            self.supply_pa = 150e3
        new_mass = mass + dt_s * (m_in - m_out - m_leak)
        if self.heat_s > 0.0:
            heating = (GAMMA * WALL_K - t) * m_in - (GAMMA - 1.0) * t * (m_out + m_leak)
            t += dt_s * (heating / mass - (t - WALL_K) / self.heat_s)
        self.temperature_k = t
        self.pressure_pa = new_mass * R * t / self.volume_m3

    def read_pa(self):
        noisy = self.pressure_pa + self.noise.gauss(0.0, self.noise_pa)
        if self.adc_step_pa == 0.0:
            return noisy
        return math.floor(noisy / self.adc_step_pa + 0.5) * self.adc_step_pa
