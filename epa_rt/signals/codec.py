"""Raw process image <-> SI signals. The only code that knows counts."""

import math
import struct

from epa_rt.config.devices import (
    STATUS_ERROR,
    STATUS_INVALID,
    STATUS_OVER_RANGE,
    STATUS_TOGGLE,
    STATUS_UNDER_RANGE,
)
from epa_rt.config.rig import Rig
from epa_rt.signals.image import Image, image_of, struct_format
from epa_rt.signals.scaling import scaling_of

NAN = math.nan


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
        self._unpack = struct.Struct(text).unpack
        self._fields: tuple[int, ...] = ()
        self._raw: list[tuple[str, int]] = []
        self._plain: list[tuple[str, int, float, float]] = []
        self._bits: list[tuple[str, int, int, bool]] = []
        # bit of the row, name, field, slope, intercept, valid counts
        self._checked: list[tuple[int, str, int, float, float, int, int]] = []
        # bit of the row, and its status word: field, bit of the toggle in the image, bits that say
        # that the value is bad
        self._status: list[tuple[int, int, int, int]] = []
        self._stale_after: list[float] = []  # in cycles, of each status word
        self._any_bad = self._all_toggles = 0  # these bits of every status word in the image
        self._toggles: int | None = None  # in the image before; None: the first sample is a new one
        self._cycle = self._all_renewed = 0  # now, and when every status word last toggled at once
        for i, row in enumerate(rig.inputs):
            place = image.places[row.entry]
            scaling = scaling_of(row, place.entry, rig)
            status = _status_field(row.entry, image, fields)
            if place.entry.code == "?":
                self._bits.append((row.name, digital[place.byte], place.bit, row.inverted))
            elif row.name.endswith("_raw"):
                self._raw.append((row.name, fields[row.entry]))
            elif status is None and row.valid is None:
                self._plain.append((row.name, fields[row.entry], scaling.slope, scaling.intercept))
            else:
                self._checked.append(
                    (
                        1 << i,
                        row.name,
                        fields[row.entry],
                        scaling.slope,
                        scaling.intercept,
                        scaling.valid_low,
                        scaling.valid_high,
                    )
                )
                if status is not None:
                    word = image.places[row.entry + "_status"]
                    shift, bad = 8 * word.byte, word.entry.faults
                    self._status.append((1 << i, status, STATUS_TOGGLE << shift, bad))
                    self._stale_after.append(row.stale_after or math.inf)
                    self._any_bad |= bad << shift
                    self._all_toggles |= STATUS_TOGGLE << shift
        self._renewed = [0] * len(self._status)  # the cycle in which some toggled and some did not
        self._soonest_stale = min(self._stale_after, default=math.inf)

    def decode(self, inputs_raw: bytes) -> dict[str, float]:
        """The measured signals of one process image (the same dict each time). Raises struct.error
        on a wrong size.
        """
        fields = self._fields = self._unpack(inputs_raw)
        measured = self.measured
        for name, field in self._raw:
            measured[name] = fields[field]
        for name, field, slope, intercept in self._plain:
            measured[name] = slope * fields[field] + intercept
        for name, field, bit, inverted in self._bits:
            measured[name] = float((fields[field] >> bit & 1) ^ inverted)
        invalid = stale = 0
        if self._all_toggles:
            image = int.from_bytes(inputs_raw, "little")
            if image & self._any_bad:
                invalid = self._said_to_be_bad()
            self._cycle = cycle = self._cycle + 1
            toggles = image & self._all_toggles
            if toggles != self._toggles:
                self._renew(toggles)
            if cycle - self._all_renewed >= self._soonest_stale:
                stale = self._not_renewed()
        for row, name, field, slope, intercept, low, high in self._checked:
            counts = fields[field]
            if low <= counts <= high:
                measured[name] = slope * counts + intercept
            else:
                invalid |= row
        if invalid:
            self._disbelieve(invalid)
        self.invalid, self.stale = invalid, stale
        return measured

    def _disbelieve(self, invalid: int) -> None:
        for row, name, *_ in self._checked:
            if invalid & row:
                self.measured[name] = NAN

    def _said_to_be_bad(self) -> int:
        """The rows whose status words say so, as bits."""
        invalid = 0
        for row, field, _toggle, bad in self._status:
            if self._fields[field] & bad:
                invalid |= row
        return invalid

    def _renew(self, toggles: int) -> None:
        """Some channels have a new sample. A terminal converts its channels together: often all."""
        before, self._toggles = self._toggles, toggles
        if before is None or toggles ^ before == self._all_toggles:
            self._all_renewed = self._cycle
            return
        for k, (_row, _field, toggle, _bad) in enumerate(self._status):
            if (toggles ^ before) & toggle:
                self._renewed[k] = self._cycle

    def _not_renewed(self) -> int:
        """The rows that are stale, as bits."""
        stale = 0
        for k, (row, _field, _toggle, _bad) in enumerate(self._status):
            renewed = max(self._all_renewed, self._renewed[k])
            if self._cycle - renewed >= self._stale_after[k]:
                stale |= row
        return stale

    def reason(self, i: int) -> str:
        """Why the i-th measured row of the last image is not believed, in words with the counts
        that were read.
        """
        status_words = {row: (field, bad) for row, field, _toggle, bad in self._status}
        for row, _name, field, _slope, _intercept, low, high in self._checked:
            if row != 1 << i or not self._fields:
                continue
            counts = self._fields[field]
            status = 0
            if row in status_words:
                word, bad = status_words[row]
                status = self._fields[word] & bad
            for bit, words in (
                (STATUS_INVALID, "terminal says the value is invalid"),
                (STATUS_ERROR, "terminal reports an error"),
                (STATUS_UNDER_RANGE, "terminal under-range"),
                (STATUS_OVER_RANGE, "terminal over-range"),
            ):
                if status & bit:
                    told = self._fields[word]
                    return f"{words} (status 0x{told:04X}, {counts} counts)"
            if counts < low:
                return f"below the sensor's range, broken wire ({counts} counts, valid from {low})"
            if counts > high:
                return f"above the sensor's range ({counts} counts, valid to {high})"
        return "no longer invalid"


def _status_field(entry: str, image: Image, fields: dict[str, int]) -> int | None:
    """Field of the status word that tells whether an entry's value is to be believed; None where
    it has none.
    """
    place = image.places.get(entry + "_status")
    return None if place is None or not place.entry.faults else fields[entry + "_status"]


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
        whole = struct.Struct(text)
        self._pack = whole.pack
        self._values = list(whole.unpack(bytes(image.size)))
        self._analog: list[tuple[str, int, float, float, int, int]] = []
        self._bits: list[tuple[str, int, int]] = []
        self._raw: list[tuple[str, int]] = []
        all_off = dict.fromkeys(digital.values(), 0)  # fields of bits while every command is zero
        for row in rig.outputs:
            place = image.places[row.entry]
            if place.entry.code == "?":
                field, mask = digital[place.byte], 1 << place.bit
                self._bits.append((row.name, field, mask))
                all_off[field] |= mask if row.inverted else 0
                continue
            low, high = place.entry.counts
            scaling = scaling_of(row, place.entry, rig)
            if row.name.endswith("_raw"):
                self._raw.append((row.name, fields[row.entry]))
            else:
                self._analog.append(
                    (row.name, fields[row.entry], scaling.slope, scaling.intercept, low, high)
                )
        self._all_off = tuple(all_off.items())
        self.safe = {row.name: row.safe for row in rig.outputs}
        self.safe_raw = self.encode(self.safe)

    def encode(self, command: dict[str, float]) -> bytes:
        """Bytes of a command. Raises KeyError (signal missing), ValueError (NaN) and struct.error
        (a word too large for its entry): all mean a fault above.
        """
        values = self._values
        for field, all_off in self._all_off:
            values[field] = all_off
        for name, field, slope, intercept, low, high in self._analog:
            counts = (command[name] - intercept) / slope
            if low <= counts <= high:
                values[field] = round(counts)
                continue
            if counts != counts:
                raise ValueError(f"{name} is not a number")
            self.saturated += counts >= high + 0.5 or counts <= low - 0.5
            values[field] = low if counts < low else high
        for name, field, mask in self._bits:
            value = command[name]
            if value != 0.0:
                if value != value:
                    raise ValueError(f"{name} is not a number")
                values[field] ^= mask
        for name, field in self._raw:
            values[field] = int(command[name])
        return self._pack(*values)
