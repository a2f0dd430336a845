"""Faults of what is measured that leave a plausible value: gain, offset, exchanged hoses and wires,
a burst muscle.
"""

from struct import pack_into, unpack_from
from typing import TYPE_CHECKING

from epa_rt.config.rig_checks import calibration_line
from epa_rt.signals.image import image_of
from sim_backend.fault_effects import Effect, Leak, _Sensor

if TYPE_CHECKING:
    from sim_backend.rig_model import RigModel


def _line(sensor: _Sensor) -> tuple[float, float]:
    """Counts per SI of a row's own calibration, and the counts at its zero (of a gauge pressure,
    gauge). Raises ValueError for a row without one.
    """
    row = next(row for row in sensor.rig.inputs if sensor.where in (row.name, row.entry))
    if row.calibration is None:
        raise ValueError(f"found {sensor.where!r}, expected a row with a calibration")
    slope, intercept = calibration_line(row, sensor.place.entry)
    counts_per_si = 1.0 / (slope * sensor.place.entry.per_count)
    zero = -intercept * counts_per_si
    entry = sensor.place.entry
    return counts_per_si, zero - entry.offset / entry.per_count if entry.offset else zero


class SensorGain(_Sensor):
    """The reading is ``value`` times what it should be; 0 is a sensor that reads zero."""

    def prepare(self) -> None:
        super().prepare()
        _, self.zero_counts = _line(self)

    def change(self, inputs: bytearray) -> None:
        counts = self.counts(inputs) - self.zero_counts
        self.put(inputs, self.zero_counts + self.value * counts)


class SensorOffset(_Sensor):
    """``value`` (SI) is added to the reading."""

    def prepare(self) -> None:
        super().prepare()
        self.counts_per_si, _ = _line(self)

    def change(self, inputs: bytearray) -> None:
        self.put(inputs, self.counts(inputs) + self.value * self.counts_per_si)


class PressuresExchanged(Effect):
    """The two pressure sensors' wires are exchanged."""

    def prepare(self) -> None:
        if len(self.rig.muscles) != 2:
            raise ValueError(f"found {len(self.rig.muscles)} muscles, expected two to exchange")
        places = image_of(self.rig, outputs=False).places
        self.places = [
            places[next(row.entry for row in self.rig.inputs if row.port == port)]
            for port in ("muscle0_gauge_pa", "muscle1_gauge_pa")
        ]

    def change(self, inputs: bytearray) -> None:
        first, second = (
            unpack_from("<" + place.entry.code, inputs, place.byte)[0] for place in self.places
        )
        for place, counts in zip(self.places, (second, first), strict=True):
            pack_into("<" + place.entry.code, inputs, place.byte, counts)


class HosesExchanged(PressuresExchanged):
    """The muscles' hoses are exchanged at the valves, where the pressure sensors sit."""

    def hold(self, model: "RigModel") -> None:
        for valve in ("inlet", "exhaust"):
            model.command[valve][0] = model.command[valve][0, ::-1].copy()


class Burst(Leak):
    """A muscle bursts: a leak that empties it within hundredths of a second."""
