"""Residuals of the links of this house's rigs: instruments corrected where they go in, imitated where they come out."""

from collections.abc import Callable

import numpy as np

from epa_rt.gap.house import gas_link, load_link, motion, motor_link, smooth
from epa_rt.gap.house.prepared import Prepared
from epa_rt.models.ports import STATE
from epa_rt.models.tables_load import CHANNELS, split

_NONE = np.zeros(0)
_ROWS = {channel: ("{}_gain_ratio".format(split(channel)[0]), "{}_offset{}".format(*split(channel))) for channel, _ in CHANNELS}


class Bench:
    """One set of parameters against one prepared recording. Everything it makes is its own or only read."""

    def __init__(self, prepared: Prepared, params: np.ndarray) -> None:
        self.prepared, self.params = prepared, params
        self.sensors = params["sensors"][0]

    def gain_offset(self, port: str) -> tuple[float, float]:
        gain, offset = _ROWS[port]
        return float(self.sensors[gain]), float(self.sensors[offset])

    def true(self, port: str) -> np.ndarray:
        """(N,) what the instrument was shown, from its reading."""
        gain, offset = self.gain_offset(port)
        values = self.prepared.readings[port]
        return values if gain == 1.0 and offset == 0.0 else (values - offset) / gain

    def shown(self, port: str, truth: np.ndarray) -> np.ndarray:
        """(N,) what the instrument reads of a truth."""
        gain, offset = self.gain_offset(port)
        return truth if gain == 1.0 and offset == 0.0 else gain * truth + offset

    def kept(self, name: str, blocks: tuple[np.ndarray, ...], make: Callable[[], object]) -> object:
        """A result that depends on these parameter records alone, from the recording's small cache."""
        cache, key = self.prepared.cache, (name, *(block.tobytes() for block in blocks))
        found = cache.get(key)
        if found is None:
            found = make()
            if len(cache) > 24:
                for old in list(cache)[:12]:
                    cache.pop(old, None)
            cache[key] = found
        return found

    # --- motion -------------------------------------------------------------------------------------------------

    def motor(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Motor angle, speed and acceleration, (N,) each."""
        s = self.sensors
        names = ("motor_angle_gain_ratio", "motor_angle_offset_rad", "motor_speed_gain_ratio", "encoder_eccentricity_rad", "encoder_phase_rad")
        return self.kept("motor", tuple(np.asarray(s[name]) for name in names), self._motor)

    def _motor(self):
        p, s = self.prepared, self.sensors
        angle_gain, speed_gain = float(s["motor_angle_gain_ratio"]), float(s["motor_speed_gain_ratio"])
        angle = np.empty(p.count)
        motion.true_angle(s, p.angle[0], p.angle[1], speed_gain, angle)
        speed = p.speed[0] / angle_gain + p.speed[1] / speed_gain
        acceleration = p.acceleration[0] / angle_gain + p.acceleration[1] / speed_gain
        if s["encoder_eccentricity_rad"] != 0.0:
            plain = (p.angle[0] - float(s["motor_angle_offset_rad"])) / angle_gain + p.angle[1] / speed_gain
            taps = smooth.gaussian_taps(smooth.FUSE_CYCLES)
            error = smooth.slope(smooth.smoothed(angle - plain, taps), p.period_s)
            speed, acceleration = speed + error, acceleration + smooth.slope(error, p.period_s)
        return angle, speed, acceleration

    def place(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Position of the load (rad of a knee, m of a mass), its speed and acceleration; zeros where it is fixed."""
        p = self.prepared
        port = next((port for port in ("joint_angle_rad", "load_position_m") if port in p.readings), None)
        if port is None:
            zero = self.kept("zero", (), lambda: np.zeros(p.count))
            return zero, zero, zero
        gain, offset = self.gain_offset(port)
        return (p.smooth["place"] - offset) / gain, p.smooth["place_speed"] / gain, p.smooth["place_acceleration"] / gain

    def line(self, i: int) -> np.ndarray:
        """(2, N) length of muscle i's line and its speed."""
        s = self.sensors
        own = [np.asarray(s[n]) for n in self.params["sensors"].dtype.names if n.startswith(("motor_", "joint_", "load_", "encoder_")) and "noise" not in n]
        return self.kept(f"line{i}", (self.params["transmission"], self.params["load"], *own), lambda: self._line(i))

    def _line(self, i: int) -> np.ndarray:
        angle, speed, _ = self.motor()
        place, place_speed, _ = self.place()
        out = np.empty((2, len(angle)))
        motion.line_lengths(self.params, i, angle, speed, place, place_speed, out)
        return out

    # --- gas and muscle -----------------------------------------------------------------------------------------

    def gauge(self, i: int) -> np.ndarray:
        """(N,) gauge pressure of muscle i, the sensor's lag taken off."""
        port = f"muscle{i}_gauge_pa"
        gain, _ = self.gain_offset(port)
        return self.true(port) + float(self.sensors["pressure_lag_s"]) / gain * self.prepared.smooth[f"{port}_slope"]

    def force(self, i: int) -> np.ndarray:
        """(N,) force of muscle i: measured where there is a cell, else predicted from its measured pressure."""
        if i == 0 and "force_n" in self.prepared.readings:
            return self.true("force_n")
        if self.params["muscle"]["present"][0, i] < 0.5:
            return self.kept("zero", (), lambda: np.zeros(self.prepared.count))
        return self.predicted_force(i, _NONE)

    def predicted_force(self, i: int, held_n: np.ndarray) -> np.ndarray:
        line, out = self.line(i), np.empty(self.prepared.count)
        motion.pulls(self.params, i, self.gauge(i), line[0], line[1], held_n, self.prepared.period_s, out)
        return out

    def pressure(self, i: int) -> tuple[np.ndarray, np.ndarray]:
        """Absolute pressure of muscle i (N,), true and as a lagging sensor has it."""
        others = np.zeros(self.prepared.count)
        if self.params["gas"]["supply_droop_pa_s_kg"][0, 0] != 0.0 and self.params["muscle"]["present"][0, 1 - i] > 0.5:
            others = self._pressures(1 - i, others)[2]
        return self._pressures(i, others)[:2]

    def volume(self, i: int) -> np.ndarray:
        compliance = self.params["muscle"]["strap_compliance_m_n"][0, i]
        strap = self.force(i) if compliance != 0.0 else self.kept("zero", (), lambda: np.zeros(self.prepared.count))
        out = np.empty(self.prepared.count)
        gas_link.volumes(self.params, i, self.line(i)[0], strap, out)
        return out

    def _pressures(self, i: int, others: np.ndarray):
        p = self.prepared
        truth, seen, drawn = np.empty(p.count), np.empty(p.count), np.empty(p.count)
        atmosphere = float(self.params["gas"]["atmosphere_pa"][0, i])
        gas_link.pressures(self.params, i, float(self.params["bus"]["valve_delay_s"][0]) / p.period_s, self.volume(i),
                           np.ascontiguousarray(p.commands["inlet"][:, i]), np.ascontiguousarray(p.commands["exhaust"][:, i]), others,
                           self.true(f"muscle{i}_gauge_pa") + atmosphere, p.shut[i], float(self.sensors["pressure_lag_s"]), p.period_s,
                           truth, seen, drawn)
        return truth, seen, drawn

    # --- drive and load -----------------------------------------------------------------------------------------

    def heat(self) -> np.ndarray:
        if self.params["drive"]["torque_loss_per_k"][0] == 0.0:
            return self.kept("zero", (), lambda: np.zeros(self.prepared.count))
        out = np.empty(self.prepared.count)
        motor_link.winding_heat(self.params["drive"][0], self.true("motor_current_a"), self.prepared.period_s, out)
        return out

    def spool(self) -> np.ndarray:
        """(N,) force of the muscles against positive travel."""
        found = self.force(0) * float(self.params["load"]["travel0_ratio"][0])
        if self.params["load"]["travel1_ratio"][0] != 0.0 and self.params["muscle"]["present"][0, 1] > 0.5:
            found = found + self.force(1) * float(self.params["load"]["travel1_ratio"][0])
        return found


def drive_residual(bench: Bench) -> np.ndarray:
    p = bench.prepared
    angle, speed, _ = bench.motor()
    out = np.empty(p.count)
    measured = bench.true("motor_current_a")
    motor_link.drive_current(bench.params, np.zeros(1, STATE), p.commands, angle, speed, measured, bench.heat(), p.period_s, out)
    return p.readings["motor_current_a"] - bench.shown("motor_current_a", out)


def motor_residual(bench: Bench) -> np.ndarray:
    p = bench.prepared
    out = np.empty(p.count)
    motor_link.balance_current(bench.params, *bench.motor(), bench.spool(), bench.heat(), p.period_s, out)
    return p.readings["motor_current_a"] - bench.shown("motor_current_a", out)


def torque_residual(bench: Bench) -> np.ndarray:
    angle, _, _ = bench.motor()
    out = np.empty(bench.prepared.count)
    motor_link.shaft_torque(bench.params, bench.true("motor_current_a"), angle, bench.heat(), out)
    return bench.prepared.readings["motor_torque_nm"] - bench.shown("motor_torque_nm", out)


def encoder_residual(bench: Bench) -> np.ndarray:
    p = bench.prepared
    out = np.empty(p.count)
    motion.true_angle(bench.sensors, p.renewed["motor_angle_rad"], bench.kept("zero", (), lambda: np.zeros(p.count)), 1.0, out)
    return p.renewed["motor_speed_rad_s"] - bench.shown("motor_speed_rad_s", smooth.slope(out, p.period_s))


def gas_residual(bench: Bench, i: int) -> np.ndarray:
    _, seen = bench.pressure(i)
    port = f"muscle{i}_gauge_pa"
    return bench.prepared.readings[port] - bench.shown(port, seen - float(bench.params["gas"]["atmosphere_pa"][0, i]))


def muscle_residual(bench: Bench) -> np.ndarray:
    strapped = bench.params["muscle"]["strap_compliance_m_n"][0, 0] != 0.0
    predicted = bench.predicted_force(0, bench.true("force_n") if strapped else _NONE)
    return bench.prepared.readings["force_n"] - bench.shown("force_n", predicted)


def load_residual(bench: Bench) -> np.ndarray:
    out = np.empty(bench.prepared.count)
    load_link.load_balance(bench.params, *bench.place(), bench.force(0), bench.force(1), bench.prepared.period_s, out)
    return out


RESIDUALS: dict[str, Callable[[Bench], np.ndarray]] = {
    "drive": drive_residual, "motor": motor_residual, "gas0": lambda b: gas_residual(b, 0), "gas1": lambda b: gas_residual(b, 1),
    "muscle0": muscle_residual, "load": load_residual, "encoder": encoder_residual, "torque": torque_residual,
}
