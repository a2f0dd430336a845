"""A rig at rest in front of the envelope, and what may leave it, said anew from the rig file."""

import math
from functools import cache
from pathlib import Path

from epa_rt.config.rig import Rig, load_rig, rig_from
from epa_rt.config.source import parse_yaml
from epa_rt.safety.envelope import Envelope

ROOT = Path(__file__).resolve().parents[2]
NAMES = ("bench", "bench_analog", "knee", "mass")


@cache
def rig(name: str) -> Rig:
    return load_rig(ROOT / "config" / "rigs" / f"{name}.yaml")


def edited(name: str, *edits: tuple[str, str]) -> Rig:
    text = (ROOT / "config" / "rigs" / f"{name}.yaml").read_text(encoding="utf-8")
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new, 1)
    return rig_from(parse_yaml(text, f"{name}.yaml"))


class Bench:
    """An envelope with sound measured signals and a command at rest; ``check`` changes either for
    one cycle.
    """

    def __init__(self, on: Rig | str = "bench"):
        self.rig = rig(on) if isinstance(on, str) else on
        self.envelope = Envelope(self.rig, lambda i: f"says row {i}")
        self.safe = {row.name: row.safe for row in self.rig.outputs}
        self.measured = {row.name: 0.0 for row in self.rig.inputs}
        for row in self.rig.inputs:
            if row.limits and not row.limits[0] <= 0.0 <= row.limits[1]:
                self.measured[row.name] = 0.5 * sum(row.limits)
        self.command = dict(self.safe)
        self.cycle = -1

    def check(
        self,
        measured: dict | None = None,
        command: dict | None = None,
        bus_ok: bool = True,
        invalid: int = 0,
        stale: int = 0,
    ) -> dict:
        self.cycle += 1
        return self.envelope.check(
            self.cycle,
            bus_ok,
            self.measured | (measured or {}),
            invalid,
            stale,
            self.command | (command or {}),
        )

    @property
    def trip(self):
        return self.envelope.tripped

    @property
    def gate(self):
        return self.envelope.gate

    def power_on(self, mode: int = 8, says: int | None = None) -> "Bench":
        """Powered in a mode, by the steps that a drive takes; later checks keep it so.

        ``says``: the drive's status word from then on, where it is to say that it has power.
        """
        if self.rig.drive.interface == "analog":
            self.command["cmd_drive_enable"] = 1.0
        else:
            self.command |= {"cmd_drive_mode_raw": mode, "cmd_drive_control_raw": 0x0F}
        self.check()
        assert self.trip is None
        if says is not None and self.rig.drive.interface == "cia402":
            self.measured[self.rig.drive.status_word] = says
        return self


def assert_may_leave(on: Rig, before: dict, out: dict, powered_before: bool) -> None:
    """Every rule of what may leave, from the rig file: a set of its own, not the gate's code."""
    assert list(out) == [row.name for row in on.outputs]
    for row in on.outputs:
        value = out[row.name]
        assert not math.isnan(value) and not math.isinf(value), row.name
        if row.name.endswith("_raw"):
            assert value in ((0, 8, 9, 10) if "mode" in row.name else (0, 2, 6, 7, 15, 128))
        elif row.limits is None:
            assert value in (0.0, 1.0)
        else:
            assert row.limits[0] <= value <= row.limits[1], row.name
            follows = row.name == on.motor.position_target and not (
                is_powered(on, out) and mode_of(on, out) in (None, 8)
            )
            if row.slew and not follows:
                assert (
                    abs(value - before[row.name]) <= row.slew * on.period_s * (1 + 1e-9) + 1e-15
                ), row.name
    for muscle in on.muscles:
        assert not (out[muscle.inlet] and out[muscle.exhaust])
    if powered_before and is_powered(on, out):
        assert mode_of(on, out) == mode_of(on, before)


def assert_may_stop(on: Rig, before: dict, out: dict) -> None:
    """Every rule of what may leave while a trip brakes: air out, the drive stops by itself."""
    assert list(out) == [row.name for row in on.outputs]
    for muscle in on.muscles:
        for name in (muscle.inlet, muscle.exhaust):
            assert out[name] == on.row(name).safe
    motor, bus = on.motor, on.drive.interface == "cia402"
    if bus:
        assert out[on.drive.control_word] == 0x02 and out[on.drive.mode] in (8, 9, 10)
    else:
        assert out[on.drive.enable] == 1.0
    for name in (motor.speed_target, motor.torque_target):
        if name and bus:
            assert out[name] == 0.0
        elif name:  # a wired drive: the gate's slew, toward rest
            step = on.row(name).slew * on.period_s * (1 + 1e-9)
            assert abs(out[name] - before[name]) <= step and abs(out[name]) <= abs(before[name])
    if motor.position_target:
        low, high = on.row(motor.position_target).limits
        assert low <= out[motor.position_target] <= high


def assert_may_let_down(on: Rig, before: dict, out: dict, travel: float) -> None:
    """Every rule of what may leave while a load is let down: valves safe, power on, and targets
    that only approach the rest place, at the let-down speed at most.
    """
    motor, place = on.motor, on.motor.places[on.motor.rest_place or "no_load"]
    fastest = motor.let_down_speed_si * (1 + 1e-9)
    for muscle in on.muscles:
        for name in (muscle.inlet, muscle.exhaust):
            assert out[name] == on.row(name).safe
    assert is_powered(on, out)
    if motor.torque_target:
        assert out[motor.torque_target] == 0.0
    if mode_of(on, out) == 8:
        target, last = out[motor.position_target], before[motor.position_target]
        assert abs(target - last) <= fastest * on.period_s + 1e-12
        assert abs(target - place) <= abs(last - place) + 1e-12
        assert (target - place) * (last - place) >= 0.0
        assert not motor.speed_target or out[motor.speed_target] == 0.0
    else:
        assert mode_of(on, out) in (None, 9)
        assert abs(out[motor.speed_target]) <= fastest
        assert out[motor.speed_target] * (place - travel) >= 0.0


def is_powered(on: Rig, out: dict) -> bool:
    return (
        out[on.drive.enable] == 1.0
        if on.drive.interface == "analog"
        else out[on.drive.control_word] == 0x0F
    )


def mode_of(on: Rig, out: dict) -> float | None:
    return None if on.drive.interface == "analog" else out[on.drive.mode]
