"""Our driver, loop and recorder beside an emulated bus for some cycles; what the driver wrote and
read goes to a JSON file.

python driver_run.py RIG EXPERIMENT CYCLES FOLDER       in the network of the bus; leaves run.mcap
and told.json
"""

import json
import os
import sys
from pathlib import Path

from drivers.backend import EthercatBackend
from drivers.bus import Bus
from drivers.mailbox import Mailbox
from epa_rt.cli.inputs import load_inputs
from epa_rt.logs.recorder import Recorder
from epa_rt.loop.assembly import assemble
from epa_rt.loop.requests import NONE, STOP
from epa_rt.loop.run import run

WRITES: list = []
READS: list = []
SWAPS: list = [0]


def listen() -> None:
    """Notes every object that the driver writes or reads, and counts its frames of process data."""
    write, read, swap = Mailbox.write, Mailbox.read, Bus.swap

    def noted_write(self, index, subindex, data):
        write(self, index, subindex, data)
        WRITES.append([index, subindex, data.hex()])

    def noted_read(self, index, subindex=0):
        data = read(self, index, subindex)
        READS.append([index, subindex, data.hex()])
        return data

    def counted_swap(self, outputs_raw):
        SWAPS[0] += 1
        return swap(self, outputs_raw)

    Mailbox.write, Mailbox.read, Bus.swap = noted_write, noted_read, counted_swap


class Stopping:
    """A backend around the driver that notes how many frames went before the first cycle, and stops
    after some.
    """

    def __init__(self, inner: EthercatBackend, cycles: int):
        self.inner, self.period_s, self._cycles, self.before = inner, inner.period_s, cycles, None
        # what the bus has to say stays with the driver, for the test to read
        self.events, self.drive_off = [], None

    def open(self) -> None:
        self.inner.open()
        self.before = SWAPS[0]

    def exchange(self, outputs_raw: bytes):
        return self.inner.exchange(outputs_raw)

    def close(self) -> None:
        self.inner.close()

    def poll(self, cycle: int) -> int:
        return STOP if cycle >= self._cycles else NONE


def main(rig: Path, experiment: Path, cycles: int, folder: Path) -> None:
    listen()
    inputs = load_inputs(experiment, rig, None, with_plant=False)
    assembly = assemble(inputs.rig, inputs.experiment)
    backend = EthercatBackend(inputs.rig, os.environ["EPA_BUS_INTERFACE"])
    stopping = Stopping(backend, cycles)
    recorder = Recorder(
        folder / "run.mcap", assembly.layout, inputs.attachments, {}, lossless=False
    )
    recorder.open()
    result = run(
        inputs.rig,
        stopping,
        assembly.supervisor,
        assembly.envelope,
        assembly.decoder,
        assembly.encoder,
        recorder,
        stopping,
    )
    recorder.close(result.outcome, result.cause)
    told = {
        "outcome": result.outcome,
        "cause": result.cause,
        "cycles": result.cycles,
        "writes": WRITES,
        "reads": READS,
        "swaps": SWAPS[0],
        "before": stopping.before,
        "working_counter": backend.expected_working_counter,
        "safe": assembly.encoder.safe_raw.hex(),
    }
    (folder / "told.json").write_text(json.dumps(told))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4]))
