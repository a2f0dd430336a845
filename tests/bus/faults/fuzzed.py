"""Damaged and random frames against emulator and driver; counts what became of them.

fuzz_emulator(frames, seed)       in memory
fuzz_driver(frames, seed)         inside a network of one's own: python -m tests.bus.faults.fuzzed
FRAMES SEED
"""

import collections
import json
import random
import sys

from epa_rt.config.rig import load_rig
from epa_rt.models.plant_file import load_plant
from sim_backend.bus.emulated_bus import EmulatedBus
from sim_backend.bus.frame import FPWR, LRW, LWR, build, datagrams_of
from tests.bus.emulator.bring_up import Wire
from tests.bus.faults.damage import damaged

RIG, PLANT = "config/rigs/bench.yaml", "config/plants/bench.yaml"
_WRITES = {2, 3, 5, 6, 8, 9, LWR, LRW, 13, 14}
_LOST_S = 0.002
_COPIES = 8


def fuzz_emulator(frames: int, seed: int) -> dict:
    """Frames into a running bus. A frame that is not sound must do nothing; one that reads must not
    write.
    """
    rig = load_rig(RIG)
    wire = Wire(EmulatedBus(rig, load_plant(PLANT), lock_step=True))
    wire.exchange(b"\x02" + bytes(wire.output_size - 1))
    bus, choice, now_ns = wire.bus, random.Random(seed), wire.master.now_ns
    process = bytes(wire.output_size + wire.input_size)
    good = [
        build([(LRW, 1, wire.logical, process)]),
        build([(7, 2, 0x0130 << 16, bytes(2)), (4, 2, 0x1005 | 0x0130 << 16, bytes(6))]),
        build([(FPWR, 3, 0x1005 | 0x1000 << 16, bytes(48))]),
        build([(11, 4, wire.logical, process)]),
    ]
    counts, changed = collections.Counter(), 0
    for _ in range(frames):
        way, raw = damaged(choice.choice(good), choice)
        frame, before, found = bytearray(raw), bytes(bus.coupling.outputs), datagrams_of(raw)
        now_ns += 1000
        answered = bus.receive(frame, now_ns)
        counts[f"{way}: {'answered' if answered else 'thrown away'}"] += 1
        assert len(frame) == len(raw) and answered == (found is not None)
        if found is None or not any(row[0] in _WRITES for row in found):
            changed += bytes(bus.coupling.outputs) != before or (
                found is None and bytes(frame) != raw
            )
    for slave in bus.slaves.values():
        slave.power_up()
    fresh = Wire(bus)
    usable = fresh.exchange(bytes(fresh.output_size))[1] == fresh.expected_counter
    return {
        "frames": frames,
        "counted": dict(sorted(counts.items())),
        "crashes": 0,
        "outputs_changed": changed,
        "comes_up_again": usable,
    }


class FuzzedBus(EmulatedBus):
    """Sends damaged copies of every answer to process data before the answer, and sometimes in its
    place.
    """

    def __init__(self, rig, plant, seed: int):
        super().__init__(rig, plant, lock_step=True)
        self.choice, self.counts = random.Random(seed), collections.Counter()
        self.fixed: bytes | None = None
        self.changed = 0

    def receive(self, frame: bytearray, now_ns: int) -> bool:
        before = self.counters.process_frames
        answered = super().receive(frame, now_ns)
        if self.fixed is None or not answered or self.counters.process_frames == before:
            return answered
        self.changed += bytes(self.coupling.outputs) != self.fixed
        for _ in range(self.choice.randrange(_COPIES)):
            way, raw = damaged(bytes(frame), self.choice)
            self.counts[way] += 1
            self.transmit(raw)
        if self.choice.random() < 0.8:
            return True
        self.counts["the answer itself lost"] += 1
        return False


def fuzz_driver(frames: int, seed: int) -> dict:
    """A loop through pysoem whose answers come damaged; outputs stay the same all the while, and
    must.
    """
    import drivers.backend
    from drivers.backend import EthercatBackend
    from epa_rt.backend import BackendError
    from tests.bus.driver.emulated import MASTER_END, served

    drivers.backend._LOCK_STEP_TIMEOUT_S = _LOST_S
    rig = load_rig(RIG)
    rig = rig.model_copy(
        update={"safety": rig.safety.model_copy(update={"lost_cycles": 1_000_000})}
    )
    outputs = b"\x02" + bytes(8) + b"\x06" + bytes(12)
    seen, sent, ended = collections.Counter(), 0, []
    with served(FuzzedBus(rig, load_plant(PLANT), seed)) as bus:
        while sent < frames:
            bus.do(_fix, None)
            backend = EthercatBackend(rig, MASTER_END, lock_step=True)
            backend.open()
            backend.exchange(outputs)
            bus.do(_fix, outputs)
            try:
                while sent < frames:
                    for _ in range(500):
                        seen[
                            (
                                "good cycles"
                                if backend.exchange(outputs).working_counter_ok
                                else "bad cycles"
                            )
                        ] += 1
                    sent, counts, changed = bus.do(_tell)
            except BackendError as error:
                ended.append(str(error))
            bus.do(_fix, None)
            backend.close()
    return {
        "frames": sent,
        "sent": counts,
        "driver": dict(seen),
        "ended": dict(collections.Counter(ended)),
        "crashes": 0,
        "outputs_changed": changed,
    }


def _fix(bus: FuzzedBus, outputs: bytes | None) -> None:
    bus.fixed = outputs


def _tell(bus: FuzzedBus) -> tuple[int, dict, int]:
    return sum(bus.counts.values()), dict(sorted(bus.counts.items())), bus.changed


if __name__ == "__main__":
    print(json.dumps(fuzz_driver(int(sys.argv[1]), int(sys.argv[2]))))
