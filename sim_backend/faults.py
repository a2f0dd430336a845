"""Faults of the simulated plant, at a given cycle, for a while or for good: sensors, valves,
supply, drive.

They act on the RigModel's parameters and command before a cycle and on the input image after it; so
they work behind the SimBackend and behind the emulated bus alike. Faults of the bus itself:
sim_backend/bus/bus_faults.py.
"""

from dataclasses import dataclass, field
from typing import Any

from epa_rt.config.rig import Rig
from epa_rt.models.plant_file import PlantFile
from sim_backend.fault_effects import EFFECTS, Effect
from sim_backend.rig_model import RigModel
from sim_backend.sensor_faults import (
    Burst,
    HosesExchanged,
    PressuresExchanged,
    SensorGain,
    SensorOffset,
)


@dataclass(frozen=True)
class FaultKind:
    """A kind of fault: what it does, what ``where`` names, the usual value with its unit, how many
    cycles by default.
    """

    words: str
    where: str = ""
    value: float | None = None
    unit: str = ""
    cycles: int | None = None


PLANT_FAULTS: dict[str, FaultKind] = {
    "wire_broken": FaultKind(
        "a sensor's wire breaks: its terminal reads this (by default what that terminal reads then:"
        " EL3004 -10 V, EL3064 0 V, EL3154 0 mA)",
        "input row",
        None,
        "V or mA",
    ),
    "sensor_stuck": FaultKind(
        "a sensor's value stays where it is, while the terminal goes on converting", "input row"
    ),
    "sensor_noisy": FaultKind(
        "noise of this RMS is added to a sensor", "input row", 0.5, "V or counts"
    ),
    "toggle_frozen": FaultKind(
        "an analog input stops converting: values, status and toggle stay", "slave"
    ),
    "valve_stuck_open": FaultKind("a valve stays open", "valve row or port"),
    "valve_stuck_closed": FaultKind("a valve stays shut", "valve row or port"),
    "leak": FaultKind(
        "a muscle loses air: this part of its volume per second and bar of gauge",
        "muscle",
        5.0,
        "1/s",
    ),
    "supply_lost": FaultKind("the supply falls to this gauge pressure", "", 0.0, "Pa"),
    "drive_fault": FaultKind(
        "the drive falls into its fault state with this error code; it may be reset afterwards",
        "",
        0x2310,
        "code",
        1,
    ),
    "sto": FaultKind(
        "safe torque off: no torque, error 0x8A88 until it is released and reset",
        "",
        0x8A88,
        "code",
    ),
    "following_error": FaultKind(
        "the drive gives up with a following error", "", 0x8611, "code", 1
    ),
    "encoder_jump": FaultKind(
        "the encoder jumps by this many counts; the drive believes it", "", 2000.0, "counts"
    ),
    "count_offset": FaultKind(
        "the encoder's count is off by this much from the start; the drive calls it referenced",
        "",
        9000.0,
        "counts",
    ),
    "drive_supply_lost": FaultKind(
        "the drive loses its supply, and with it torque, count and reference", "", None, "", 200
    ),
}


PLANT_FAULTS |= {
    "sensor_gain": FaultKind("a sensor reads this many times its value", "input row", 0.8, "1"),
    "sensor_offset": FaultKind("this is added to a sensor's value", "input row", 0.0, "SI"),
    "pressures_exchanged": FaultKind("the wires of two muscles' pressure sensors are exchanged"),
    "hoses_exchanged": FaultKind("two muscles' hoses are exchanged behind valves and sensors"),
    "burst": FaultKind("a muscle bursts: it loses air as `leak` says", "muscle", 50.0, "1/s"),
}
EFFECTS |= {
    "sensor_gain": SensorGain,
    "sensor_offset": SensorOffset,
    "pressures_exchanged": PressuresExchanged,
    "hoses_exchanged": HosesExchanged,
    "burst": Burst,
}


@dataclass
class Fault:
    """A fault to come or at work. ``cycles``: None for good. ``options``: what only some kinds
    know.
    """

    kind: str
    where: str = ""
    value: float | None = None
    at_cycle: int = 0
    cycles: int | None = None
    options: dict[str, Any] = field(default_factory=dict)

    def is_over(self, cycle: int) -> bool:
        return self.cycles is not None and cycle >= self.at_cycle + self.cycles


def make_fault(
    kinds: dict[str, FaultKind],
    kind: str,
    where: str = "",
    value: float | None = None,
    at_cycle: int = 0,
    cycles: int | None = None,
    **options: Any,
) -> Fault:
    """A fault with its kind's usual value and length where none is given. Raises ValueError."""
    if kind not in kinds:
        raise ValueError(f"found the fault {kind!r}, expected one of {', '.join(kinds)}")
    usual = kinds[kind]
    if cycles is not None and cycles < 1:
        raise ValueError(f"found {cycles} cycles, expected at least 1, or none for good")
    if usual.where and not where and usual.where not in ("muscle", "slave with a clock"):
        raise ValueError(f"found no 'where' for {kind}, expected the name of a {usual.where}")
    return Fault(
        kind,
        where,
        usual.value if value is None else float(value),
        int(at_cycle),
        usual.cycles if cycles is None else int(cycles),
        options,
    )


class PlantFaults:
    """All faults of one plant. ``start_due`` before a cycle, ``hold`` after outputs were latched,
    ``change`` on inputs.
    """

    def __init__(self, rig: Rig, seed: int = 0):
        self._rig, self._seed = rig, seed
        self._waiting: list[tuple[Fault, Effect]] = []
        self._active: list[tuple[Fault, Effect]] = []

    def __bool__(self) -> bool:
        return bool(self._waiting or self._active)

    def add(self, fault: Fault) -> None:
        """Takes a fault up. Raises ValueError where it names something that the rig does not
        have.
        """
        number = len(self._waiting) + len(self._active)
        self._waiting.append(
            (fault, EFFECTS[fault.kind](self._rig, fault.where, fault.value, self._seed + number))
        )

    def listed(self) -> list[Fault]:
        return [fault for fault, _ in self._active + self._waiting]

    def clear(self, model: RigModel) -> None:
        """Ends all of them."""
        for _, effect in self._active:
            effect.end(model)
        self._active, self._waiting = [], []

    def start_due(self, model: RigModel, cycle: int) -> None:
        """Begins what is due in this cycle and ends what is over."""
        for row in [row for row in self._active if row[0].is_over(cycle)]:
            self._active.remove(row)
            row[1].end(model)
        for row in [row for row in self._waiting if row[0].at_cycle <= cycle]:
            self._waiting.remove(row)
            self._active.append(row)
            row[
                0
            ].at_cycle = (
                cycle  # a fault that comes too late for its cycle lasts as long all the same
            )
            row[1].begin(model)
            row[1].hold(model)

    def hold(self, model: RigModel) -> None:
        """Outputs have just been latched: what the faults hold, they hold against them."""
        for _, effect in self._active:
            effect.hold(model)

    def change(self, inputs: bytearray) -> None:
        """Changes what the sensors say."""
        for _, effect in self._active:
            effect.change(inputs)


class FaultyRigModel(RigModel):
    """A RigModel that takes faults; without any it is the plain one, byte for byte."""

    def __init__(
        self, rig: Rig, plant: PlantFile, seed: int, referenced: bool = True, count_offset: int = 0
    ):
        super().__init__(rig, plant, seed, referenced=referenced, count_offset=count_offset)
        self.faults = PlantFaults(rig, seed)

    @property
    def cycle_number(self) -> int:
        """Number of the cycle that comes next."""
        return self.t_ns // self.period_ns

    def cycle(self, outputs_raw: bytes) -> bytes:
        if not self.faults:
            return super().cycle(outputs_raw)
        self.faults.start_due(self, self.cycle_number)
        inputs = bytearray(super().cycle(outputs_raw))
        self.faults.hold(self)
        self.faults.change(inputs)
        return bytes(inputs)
