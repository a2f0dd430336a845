"""A recorded run as a backend, and the comparison that stands in for its recorder: same inputs,
same bytes?
"""

from dataclasses import dataclass

import numpy as np

from epa_rt.backend import BackendError, Event, Exchange
from epa_rt.logs.layout import (
    FLAG_RECORDER_FAILED,
    FLAG_STOP_AT_ONCE,
    FLAG_STOP_REQUESTED,
    FLAG_WORKING_COUNTER_OK,
)
from epa_rt.logs.reader import LogReader


@dataclass(frozen=True)
class RecordedCycles:
    """What a replay needs of a log: scalar columns as lists, raw images as bytes, one element per
    cycle.
    """

    cycle: list[int]
    t_ns: list[int]
    flags: list[int]
    state: list[int]
    phase: list[int]
    lateness_ns: list[int]
    busy_ns: list[int]
    inputs: bytes
    outputs: bytes
    inputs_bytes: int
    outputs_bytes: int

    def __len__(self) -> int:
        return len(self.cycle)

    def inputs_raw(self, i: int) -> bytes:
        return self.inputs[i * self.inputs_bytes : (i + 1) * self.inputs_bytes]

    def outputs_raw(self, i: int) -> bytes:
        return self.outputs[i * self.outputs_bytes : (i + 1) * self.outputs_bytes]


def recorded_cycles(reader: LogReader) -> RecordedCycles:
    """The cycles of a log, in order."""
    names = ("cycle", "t_ns", "flags", "state", "phase", "lateness_ns", "busy_ns")
    columns = reader.columns("/cycle", names=list(names))
    inputs, outputs = reader.raw()
    return RecordedCycles(
        *(columns[name].tolist() for name in names),
        np.ascontiguousarray(inputs).tobytes(),
        np.ascontiguousarray(outputs).tobytes(),
        inputs.shape[1],
        outputs.shape[1],
    )


class ReplayBackend:
    """A Backend that reads its stamps and inputs from a log; what is sent to it goes nowhere.

    Raises BackendError from ``exchange`` once the log is at its end. ``simulated``: whether it is
    of a rig that moved by cycles alone.
    """

    def __init__(self, cycles: RecordedCycles, period_s: float, simulated: bool):
        self.period_s = period_s
        self.events: list[Event] = []
        self.drive_off: bool | None = None
        self._cycles, self._next, self._is_open = cycles, 0, False
        self._simulated = simulated

    def open(self) -> None:
        self._is_open = True

    def exchange(self, outputs_raw: bytes) -> Exchange:
        i, cycles = self._next, self._cycles
        if not self._is_open or len(outputs_raw) != cycles.outputs_bytes:
            found = f"{len(outputs_raw)} bytes" if self._is_open else "a closed backend"
            raise BackendError(
                f"found {found}, expected an open backend and {cycles.outputs_bytes} bytes of"
                " outputs"
            )
        if i >= len(cycles.cycle):
            raise BackendError(f"the log ends after {i} cycles")
        self._next = i + 1
        t_ns, lateness_ns = cycles.t_ns[i], cycles.lateness_ns[i]
        return Exchange(
            cycles.cycle[i],
            t_ns,
            cycles.inputs_raw(i),
            bool(cycles.flags[i] & FLAG_WORKING_COUNTER_OK),
            lateness_ns,
            cycles.busy_ns[i],
            t_ns if self._simulated else t_ns + lateness_ns,
        )

    def close(self) -> None:
        self._is_open = False


class RecordedRequests:
    """The operator's requests as they stand in the recorded flags."""

    def __init__(self, cycles: RecordedCycles):
        self._flags = cycles.flags

    def poll(self, cycle: int) -> int:
        flags = self._flags[cycle] if cycle < len(self._flags) else 0
        return 2 if flags & FLAG_STOP_AT_ONCE else (1 if flags & FLAG_STOP_REQUESTED else 0)


class Comparison:
    """Takes the recorder's place in a replay and compares every output image and state with the
    recorded one.

    ``compared`` cycles, ``different`` of them, ``first`` = (cycle, recorded bytes, replayed bytes)
    or None.
    """

    def __init__(
        self, cycles: RecordedCycles, failure: str = "the recorder failed in the recorded run"
    ):
        self._cycles, self._words = cycles, failure
        self.compared = self.different = 0
        self.first: tuple[int, bytes, bytes] | None = None

    def sample(
        self,
        cycle: int,
        t_ns: int,
        flags: int,
        state: int,
        phase: int,
        lateness_ns: int,
        busy_ns: int,
        invalid_mask: int,
        stale_mask: int,
        inputs_raw: bytes,
        outputs_raw: bytes,
        *signals: object,
    ) -> None:
        i, cycles = self.compared, self._cycles
        self.compared += 1
        recorded = cycles.outputs_raw(i)
        if (
            recorded != outputs_raw
            or state != cycles.state[i]
            or phase != cycles.phase[i]
            or flags != cycles.flags[i]
        ):
            self.different += 1
            if self.first is None:
                self.first = (cycle, recorded, outputs_raw)

    def event(self, cycle: int, t_ns: int, kind: str, text: str, /, **data: object) -> None:
        """Events are not compared: they carry no byte that goes out."""

    @property
    def failure(self) -> str | None:
        i = self.compared
        failed = i < len(self._cycles) and self._cycles.flags[i] & FLAG_RECORDER_FAILED
        return self._words if failed else None
