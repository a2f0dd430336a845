"""Raw process image <-> SI signals. The only code that knows counts."""

import math
import struct
from typing import Any

from epa_rt.config.devices import (
    STATUS_ERROR,
    STATUS_INVALID,
    STATUS_OVER_RANGE,
    STATUS_TOGGLE,
    STATUS_UNDER_RANGE,
)
from epa_rt.config.rig import Rig
from epa_rt.signals.image import image_of, struct_format
from epa_rt.signals.scaling import scaling_of

NAN = math.nan
_BAD_STATUS = STATUS_UNDER_RANGE | STATUS_OVER_RANGE | STATUS_ERROR | STATUS_INVALID


class Decoder:
    """Inputs: bytes to SI.

    ``decode`` fills ``measured`` (SI; NaN where the sensor is not to be believed) and sets
    ``invalid`` and ``stale``, bit i for the i-th measured row; ``reason(i)`` says why a row is
    invalid.
    """

    def __init__(self, rig: Rig):
        image = image_of(rig, outputs=False)
        digital: dict[int, int] = {}
        text, fields = struct_format(image, digital)
        self.size = image.size
        self.names = tuple(row.name for row in rig.inputs)
        self.measured: dict[str, float] = dict.fromkeys(self.names, NAN)
        self.invalid = 0
        self.stale = 0
        self._struct = struct.Struct(text)
        self._fields: tuple[Any, ...] = ()
        self._plain, self._checked, self._bits = [], [], []
        self._raw = []
        self._toggle, self._age = (
            [None] * len(self.names),
            [0] * len(self.names),
        )  # None: the first sample is a new one
        for i, row in enumerate(rig.inputs):
            place = image.places[row.entry]
            scaling = scaling_of(row, place.entry, rig)
            status = fields.get(row.entry + "_status")
            if place.entry.code == "?":
                self._bits.append((row.name, digital[place.byte], place.bit, row.inverted))
            elif row.name.endswith("_raw"):
                self._raw.append((row.name, fields[row.entry]))
            elif status is None and row.valid is None:
                self._plain.append((row.name, fields[row.entry], scaling.slope, scaling.intercept))
            else:
                self._checked.append(
                    (
                        i,
                        row.name,
                        fields[row.entry],
                        scaling.slope,
                        scaling.intercept,
                        scaling.valid_low,
                        scaling.valid_high,
                        status,
                        row.stale_after or math.inf,
                    )
                )

    def decode(self, inputs_raw: bytes) -> dict[str, float]:
        """The measured signals of one process image (the same dict each time). Raises struct.error
        on a wrong size.
        """
        fields = self._fields = self._struct.unpack(inputs_raw)
        measured = self.measured
        for name, field in self._raw:
            measured[name] = fields[field]
        for name, field, slope, intercept in self._plain:
            measured[name] = slope * fields[field] + intercept
        for name, field, bit, inverted in self._bits:
            measured[name] = float((fields[field] >> bit & 1) ^ inverted)
        invalid = stale = 0
        toggles, ages = self._toggle, self._age
        for i, name, field, slope, intercept, low, high, status_field, stale_after in self._checked:
            counts = fields[field]
            if status_field is not None:
                status = fields[status_field]
                if status & STATUS_TOGGLE == toggles[i]:
                    ages[i] = age = ages[i] + 1
                    if age >= stale_after:
                        stale |= 1 << i
                else:
                    toggles[i] = status & STATUS_TOGGLE
                    ages[i] = 0
                if status & _BAD_STATUS:
                    invalid |= 1 << i
            if counts < low or counts > high:
                invalid |= 1 << i
            measured[name] = NAN if invalid >> i & 1 else slope * counts + intercept
        self.invalid, self.stale = invalid, stale
        return measured

    def reason(self, i: int) -> str:
        """Why the i-th measured row of the last image is not believed, in words with the counts
        that were read.
        """
        for (
            index,
            _name,
            field,
            _slope,
            _intercept,
            low,
            high,
            status_field,
            _stale,
        ) in self._checked:
            if index != i or not self._fields:
                continue
            counts = self._fields[field]
            status = self._fields[status_field] if status_field is not None else 0
            for bit, words in (
                (STATUS_INVALID, "terminal says the value is invalid"),
                (STATUS_ERROR, "terminal reports an error"),
                (STATUS_UNDER_RANGE, "terminal under-range"),
                (STATUS_OVER_RANGE, "terminal over-range"),
            ):
                if status & bit:
                    return f"{words} (status 0x{status:04X}, {counts} counts)"
            if counts < low:
                return f"below the sensor's range, broken wire ({counts} counts, valid from {low})"
            if counts > high:
                return f"above the sensor's range ({counts} counts, valid to {high})"
        return "no longer invalid"


class Encoder:
    """Outputs: SI to bytes. Values must have passed the envelope; counts saturate and each
    saturation is counted.

    ``saturated`` counts every value that had to be cut by half a count or more.
    """

    def __init__(self, rig: Rig):
        image = image_of(rig, outputs=True)
        digital: dict[int, int] = {}
        text, fields = struct_format(image, digital)
        self.size = image.size
        self.names = tuple(row.name for row in rig.outputs)
        self.saturated = 0
        self._struct = struct.Struct(text)
        self._values = [0] * len(self._struct.unpack(bytes(image.size)))
        self._analog, self._bits, self._raw = [], [], []
        self._bit_fields = tuple(digital.values())
        for row in rig.outputs:
            place = image.places[row.entry]
            if place.entry.code == "?":
                self._bits.append((row.name, digital[place.byte], 1 << place.bit, row.inverted))
                continue
            low, high = place.entry.counts
            scaling = scaling_of(row, place.entry, rig)
            if row.name.endswith("_raw"):
                self._raw.append((row.name, fields[row.entry]))
            else:
                self._analog.append(
                    (row.name, fields[row.entry], scaling.slope, scaling.intercept, low, high)
                )
        self.safe = {row.name: row.safe for row in rig.outputs}
        self.safe_raw = self.encode(self.safe)

    def encode(self, command: dict[str, float]) -> bytes:
        """Bytes of a command. Raises KeyError (signal missing), ValueError (NaN) and struct.error
        (a word too large for its entry): all mean a fault above.
        """
        values = self._values
        for field in self._bit_fields:
            values[field] = 0
        for name, field, slope, intercept, low, high in self._analog:
            counts = (command[name] - intercept) / slope
            if low <= counts <= high:
                values[field] = round(counts)
                continue
            if counts != counts:
                raise ValueError(f"{name} is not a number")
            self.saturated += counts >= high + 0.5 or counts <= low - 0.5
            values[field] = low if counts < low else high
        for name, field, mask, inverted in self._bits:
            value = command[name]
            if value != value:
                raise ValueError(f"{name} is not a number")
            if (value != 0.0) != inverted:
                values[field] |= mask
        for name, field in self._raw:
            values[field] = int(command[name])
        return self._struct.pack(*values)
