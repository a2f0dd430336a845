"""What a set of parameters makes of a recording: motion, forces and pressures, instruments
corrected where they go in.
"""

from collections.abc import Callable

import numpy as np

from epa_rt.gap.rig.house import gas_link, instruments, motion, motor_link, smooth
from epa_rt.gap.rig.house.depends import gases, lengths, pressures, torques
from epa_rt.gap.rig.house.prepared import Prepared
from epa_rt.models.blocks.bus import valve_delays
from epa_rt.models.ports import STATE


class Bench:
    """One set of parameters against one prepared recording. Everything it makes is its own or only
    read.
    """

    def __init__(self, prepared: Prepared, params: np.ndarray) -> None:
        self.prepared, self.params = prepared, params
        self.sensors = params["sensors"][0]

    def true(self, port: str) -> np.ndarray:
        """(N,) what the instrument was shown, from its reading; of pressure and force see ``gauge``
        and ``force``.
        """
        return instruments.straight(
            self.sensors, port, self.prepared.readings[port], self.prepared.period_s
        )

    def shown(self, port: str, truth: np.ndarray) -> np.ndarray:
        """(N,) what the instrument reads of a truth."""
        return instruments.shown(self.sensors, port, truth, self.prepared.period_s)

    def cycles(self, name: str) -> float:
        """A time (s) of the sensors' rows in cycles."""
        return float(self.sensors[name]) / self.prepared.period_s

    def zero(self) -> np.ndarray:
        """(N,) zeros that all share, to be read only."""
        return self.kept("zero", (), lambda: np.zeros(self.prepared.count))

    def kept(self, name: str, blocks: tuple[np.ndarray, ...], make: Callable[[], object]) -> object:
        """A result that depends on these parameter records alone."""
        return self.prepared.kept((name, *(block.tobytes() for block in blocks)), make)

    # --- motion

    def motor(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Motor angle, speed and acceleration, (N,) each."""
        s = self.sensors
        names = (
            "motor_angle_gain_ratio",
            "motor_angle_offset_rad",
            "motor_speed_gain_ratio",
            "encoder_eccentricity_rad",
            "encoder_phase_rad",
            "encoder_twice_sine_ratio",
            "encoder_twice_cosine_ratio",
            "encoder_skew_s",
        )
        return self.kept("motor", tuple(np.asarray(s[name]) for name in names), self._motor)

    def _motor(self):
        p, s = self.prepared, self.sensors
        angle_gain, speed_gain = (
            float(s["motor_angle_gain_ratio"]),
            float(s["motor_speed_gain_ratio"]),
        )
        angle = np.empty(p.count)
        motion.true_angle(s, p.angle[0], p.angle[1], speed_gain, angle)
        speed = p.speed[0] / angle_gain + p.speed[1] / speed_gain
        acceleration = p.acceleration[0] / angle_gain + p.acceleration[1] / speed_gain
        if s["encoder_eccentricity_rad"] != 0.0:
            plain = (p.angle[0] - float(s["motor_angle_offset_rad"])) / angle_gain + p.angle[
                1
            ] / speed_gain
            taps = smooth.gaussian_taps(smooth.FUSE_CYCLES)
            error = smooth.slope(smooth.smoothed(angle - plain, taps), p.period_s)
            speed, acceleration = speed + error, acceleration + smooth.slope(error, p.period_s)
        late = self.cycles("encoder_skew_s")
        return (
            instruments.moved(angle, late),
            instruments.moved(speed, late),
            instruments.moved(acceleration, late),
        )

    def place_port(self) -> str | None:
        """Port that shows the load's place, of a knee in rad, of a mass in m; None where none
        does.
        """
        return next(
            (
                port
                for port in ("joint_angle_rad", "load_position_m")
                if port in self.prepared.readings
            ),
            None,
        )

    def place(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Position of the load (rad of a knee, m of a mass), its speed and acceleration; zeros
        where it is fixed.
        """
        p = self.prepared
        port = self.place_port()
        if port is None:
            zero = self.zero()
            return zero, zero, zero
        gain, late = (
            instruments.line_of(self.sensors, port)[0],
            (self.cycles("joint_skew_s") if port == "joint_angle_rad" else 0.0),
        )
        place = instruments.straight(self.sensors, port, p.smooth["place"], p.period_s)
        return tuple(
            instruments.moved(x, late)
            for x in (place, p.smooth["place_speed"] / gain, p.smooth["place_acceleration"] / gain)
        )

    def line(self, i: int) -> np.ndarray:
        """(2, N) length of muscle i's line and its speed."""
        return self.kept(f"line{i}", lengths(self.params), lambda: self._line(i))

    def _line(self, i: int) -> np.ndarray:
        (angle, speed, _), (place, place_speed, _) = self.motor(), self.place()
        out = np.empty((2, len(angle)))
        motion.line_lengths(self.params, i, angle, speed, place, place_speed, out)
        return out

    # --- gas and muscle

    def lagging_gauge(self, i: int) -> np.ndarray:
        """(N,) gauge pressure of muscle i behind its lags alone: the sensor's own and that of a
        tube or filter.
        """
        value = self.true(f"muscle{i}_gauge_pa")
        if (
            i == 0
            and self.sensors["gauge_crosstalk_pa_n"] != 0.0
            and "force_n" in self.prepared.readings
        ):
            value = value - float(self.sensors["gauge_crosstalk_pa_n"]) * self.true("force_n")
        return instruments.moved(value, self.cycles("gauge_skew_s"))

    def lags_s(self) -> tuple[float, float]:
        """Lags of the pressure readings: the sensor's own, and of a tube or filter behind it."""
        return float(self.sensors["pressure_lag_s"]), float(self.sensors["gauge_lag_s"])

    def gauge(self, i: int) -> np.ndarray:
        """(N,) gauge pressure of muscle i, what its sensor does taken off."""
        port, value, lag_s = f"muscle{i}_gauge_pa", self.lagging_gauge(i), sum(self.lags_s())
        if lag_s == 0.0:
            return value
        slope = instruments.moved(
            self.prepared.smooth[f"{port}_slope"], self.cycles("gauge_skew_s")
        )
        return value + lag_s / instruments.line_of(self.sensors, port)[0] * slope

    def force(self, i: int) -> np.ndarray:
        """(N,) force of muscle i: measured where there is a cell, else predicted from its measured
        pressure.
        """
        s, p = self.sensors, self.prepared
        if i == 0 and "force_n" in p.readings:
            value = self.true("force_n")
            if s["force_crosstalk_n_pa"] != 0.0:
                value = value - float(s["force_crosstalk_n_pa"]) * self.true("muscle0_gauge_pa")
            return value - self.late_part() if instruments.is_dynamic(s) else value
        if self.params["muscle"]["present"][0, i] < 0.5:
            return self.zero()
        return self.predicted_force(i)

    def late_part(self) -> np.ndarray:
        """(N,) what frame, age and lag add to the force, from a prediction: taken from the reading,
        its noise would swing too.
        """

        def made() -> np.ndarray:
            calm = self.predicted_force(0, calm=True)
            return instruments.cell(self.sensors, calm, self.prepared.period_s) - calm

        return self.kept("late part", gases(self.params), made)

    def predicted_force(self, i: int, calm: bool = False) -> np.ndarray:
        """(N,) from measured pressure, ``calm``: smoothed, and length."""
        gauge = self.gauge(i)
        return self._pull(
            i,
            (
                smooth.flat_smoothed(gauge, smooth.gaussian_taps(smooth.SLOPE_CYCLES))
                if calm
                else gauge
            ),
        )

    def modelled_force(self, i: int) -> np.ndarray:
        """(N,) from length and, while the valves are shut, the pressure that the gas then must
        have, levelled to the readings of the whole span: neither a converter's steps nor the noise
        of the force cell are in it. Else from the measured pressure.
        """
        if (
            self.params["muscle"]["present"][0, i] < 0.5
            or f"muscle{i}_gauge_pa" not in self.prepared.readings
        ):
            return self.force(i)
        return self.kept(f"force{i}", gases(self.params), lambda: self._modelled_force(i))

    def _modelled_force(self, i: int) -> np.ndarray:
        gauge, model = (
            self.gauge(i).copy(),
            self.pressure(i)[0] - float(self.params["gas"]["atmosphere_pa"][0, i]),
        )
        for start, stop in self.prepared.shut[i]:
            gauge[start:stop] = model[start:stop]
        return self._pull(i, gauge)

    def _pull(self, i: int, gauge: np.ndarray) -> np.ndarray:
        """(N,) force of muscle i at a gauge pressure (N,) and its measured length."""
        line, out = self.line(i), np.empty(self.prepared.count)
        motion.pulls(
            self.params, np.zeros(1, STATE), i, gauge, line[0], line[1], self.prepared.period_s, out
        )
        return out

    def pressure(self, i: int) -> tuple[np.ndarray, np.ndarray]:
        """Absolute pressure of muscle i (N,), true and behind its lags, as ``lagging_gauge`` is."""
        return self.kept(f"pressure{i}", pressures(self.params), lambda: self._pressure(i))

    def _pressure(self, i: int) -> tuple[np.ndarray, np.ndarray]:
        others = np.zeros(self.prepared.count)
        if (
            self.params["gas"]["supply_droop_pa_s_kg"][0, 0] != 0.0
            and self.params["muscle"]["present"][0, 1 - i] > 0.5
        ):
            others = self._pressures(1 - i, others)[2]
        return self._pressures(i, others)[:2]

    def volume(self, i: int) -> np.ndarray:
        """(N,) volume of muscle i at its measured line's length, m^3, its dead volume included."""
        compliance = self.params["muscle"]["strap_compliance_m_n"][0, i]
        strap = self.force(i) if compliance != 0.0 else self.zero()
        out = np.empty(self.prepared.count)
        gas_link.volumes(self.params, i, self.line(i)[0], strap, out)
        return out

    def _pressures(self, i: int, others: np.ndarray):
        p = self.prepared
        truth, seen, drawn = np.empty(p.count), np.empty(p.count), np.empty(p.count)
        atmosphere = float(self.params["gas"]["atmosphere_pa"][0, i])
        late = valve_delays(
            float(self.params["bus"]["valve_delay_s"][0]),
            float(self.params["bus"]["valve_skew_ratio"][0]),
        )
        gas_link.pressures(
            self.params,
            i,
            (late[0] / p.period_s, late[1] / p.period_s),
            self.volume(i),
            np.ascontiguousarray(p.commands["inlet"][:, i]),
            np.ascontiguousarray(p.commands["exhaust"][:, i]),
            others,
            self.lagging_gauge(i) + atmosphere,
            p.shut[i],
            self.lags_s(),
            p.period_s,
            truth,
            seen,
            drawn,
        )
        return truth, seen, drawn

    # --- drive and load

    def needed_torque(self) -> np.ndarray:
        """(N,) torque on the shaft that the measured motion needs against the muscles' forces,
        N*m.
        """

        def made() -> np.ndarray:
            out = np.empty(self.prepared.count)
            motor_link.balance_torque(
                self.params, *self.motor(), self.spool(), self.prepared.period_s, out
            )
            return out

        return self.kept("torque", torques(self.params), made)

    def warmth(self) -> np.ndarray:
        """(N,) kelvins that weaken the motor's torque, from the measured current; zeros where they
        do nothing.
        """
        if self.params["drive"]["torque_loss_per_k"][0] == 0.0:
            return self.zero()
        out = np.empty(self.prepared.count)
        motor_link.warmth(
            self.params["drive"][0], self.true("motor_current_a"), self.prepared.period_s, out
        )
        return out

    def spool(self) -> np.ndarray:
        """(N,) force of the muscles against positive travel."""
        found = self.force(0) * float(self.params["load"]["travel0_ratio"][0])
        if (
            self.params["load"]["travel1_ratio"][0] != 0.0
            and self.params["muscle"]["present"][0, 1] > 0.5
        ):
            found = found + self.force(1) * float(self.params["load"]["travel1_ratio"][0])
        return found
