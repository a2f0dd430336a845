"""What the tests of the driver do on an emulated bus; each case runs in a process of its own
(tests/bus/own_network.py).
"""

import itertools
import tempfile
from pathlib import Path

import drivers.backend
from drivers.backend import EthercatBackend
from epa_rt.backend import BackendError
from epa_rt.cli.inputs import load_inputs
from epa_rt.config.rig import Rig, Slave, load_rig
from epa_rt.loop.assembly import assemble
from epa_rt.loop.run import run
from epa_rt.realtime.process import undisturbed
from epa_rt.signals.codec import Encoder
from sim_backend.backend import SimBackend
from tests.bus.driver.emulated import MASTER_END, ROOT, Remote, emulated
from tests.loop.rigging import Memory, Quiet
from tests.rig_at_period import rig_at_period

PATIENT_S = (
    0.2  # a busy machine may hold the emulator up; three of these are still less than the watchdogs
)
LOST_S = 0.5  # lock step: how long the driver waits for a frame that does not come
BRISK_NS = {
    1: 20_000,
    2: 20_000,
    4: 20_000,
    8: 20_000,
}  # lock step: state changes take frames, not milliseconds
SHORT = """
experiment: short
loop: {loop}
seed: 1
phases:
  - {{name: fill, valves: {{all: {{set: 150 kPa gauge}}}}, until: valves_settled, timeout: 30 s}}
  - {{name: out, move: {{to: 6 mm, speed: 40 mm/s}}}}
  - {{name: trial, trial: true, random_speed: {{between: [2 mm, 16 mm], speed: 50 mm/s}}, for: 1 s, valves: {{all: hold}}}}
  - {{name: return, move: {{to: no_load, speed: 40 mm/s}}}}
"""  # noqa: E501


def patient(rig: Rig, **master: object) -> Rig:
    """The rig with waits that a busy test machine does not exceed: for frames, and by the slaves'
    watchdogs; for new samples, which a loop that is late by whole conversions meets with the same
    toggle bit each time; and without a following error, for a loop that misses every second edge
    asks for half the speed that the drive has.
    """
    safety = rig.safety.model_copy(update={"watchdog": 1.0})
    rows = tuple(
        row.model_copy(update={"stale_after": 500}) if row.stale_after else row
        for row in rig.signals
    )
    axes = {
        name: axis.model_copy(update={"following_error": None})
        for name in ("motor", "joint")
        if (axis := getattr(rig, name)) is not None
    }
    changed = rig.model_copy(
        update={
            **axes,
            "safety": safety,
            "signals": rows,
            "master": rig.master.model_copy(update={"frame_timeout": PATIENT_S, **master}),
        }
    )
    for cached in ("inputs", "outputs", "_rows"):
        changed.__dict__.pop(cached, None)
    return changed


def rig_named(name: str) -> Rig:
    return patient(load_rig(ROOT / f"config/rigs/{name}.yaml"))


def with_slaves(rig: Rig, slaves: list[Slave]) -> Rig:
    changed = rig.model_copy(update={"bus": tuple(slaves)})
    changed.__dict__.pop("slaves", None)  # cached
    return changed


# what is done in the emulator


def counters(bus) -> dict:
    states = {name: slave.al.state for name, slave in bus.slaves.items()}
    return {
        "process_frames": bus.counters.process_frames,
        "steps": bus.counters.steps,
        "outputs": bytes(bus.coupling.take()).hex(),
        "states": states,
        "enabled": float(bus.plant.command["enabled"][0]),
    }


def set_object(bus, slave: str, index: int, subindex: int, value: int, size: int) -> None:
    bus.slaves[slave].dictionary.objects[index].items[subindex].value = value.to_bytes(
        size, "little"
    )


def make_read_only(bus, slave: str, index: int, subindex: int) -> None:
    from sim_backend.bus.dictionary import READ

    bus.slaves[slave].dictionary.objects[index].items[subindex].access = READ


def unplug(bus, slave: str) -> None:
    bus.slaves[slave].is_present = False
    bus.rewire()


def power_cycle(bus, slave: str) -> None:
    bus.slaves[slave].power_up()


def fall(bus, slave: str, code: int) -> None:
    bus.slaves[slave].al.fail(0x04, code)


def lose_frames(bus, skip: int, count: int) -> None:
    """From the ``skip``-th process-data frame on, ``count`` frames do not come back."""
    inner, seen = bus.receive, itertools.count()

    def receive(frame: bytearray, now_ns: int) -> bool:
        before = bus.counters.process_frames
        answered = inner(frame, now_ns)
        if bus.counters.process_frames > before:
            return answered and not skip <= next(seen) < skip + count
        return answered

    bus.receive = receive


def lose_two_of_three(bus, count: int) -> None:
    """From now on, of the next ``count`` process-data frames."""
    inner, seen = bus.receive, itertools.count()

    def receive(frame: bytearray, now_ns: int) -> bool:
        before = bus.counters.process_frames
        answered = inner(frame, now_ns)
        if not answered or bus.counters.process_frames == before:
            return answered
        number = next(seen)
        return number >= count or number % 3 == 2

    bus.receive = receive


def watch_outputs(bus) -> None:
    """Keeps every output image that acts while the drive has power coming on."""
    bus.seen = []
    inner = bus.plant.step_now

    def step_now(outputs: bytes) -> bytes:
        result = inner(outputs)
        bus.seen.append((int(bus.plant.machine["state"][0]), outputs, result))
        return result

    bus.plant.step_now = step_now


def seen_outputs(bus) -> list:
    return bus.seen


# cases


def refused(
    change: str,
    slave: str = "",
    index: int = 0,
    subindex: int = 0,
    value: int = 0,
    size: int = 4,
    rig: str = "bench",
    bare: bool = False,
) -> dict:
    """A bus that is not the rig file's; the sentence, and what the emulator saw of outputs.
    ``bare``: without start-up objects.
    """
    typed = rig_named(rig)
    if bare:
        typed = with_slaves(typed, [one.model_copy(update={"startup": ()}) for one in typed.bus])
    present = list(typed.bus)
    if change == "swapped":
        present[2], present[3] = present[3], present[2]
    elif change == "extra":
        present.insert(2, Slave(name="extra", device="EL2124"))
    elif change == "startup":
        sdo = _sdo(f"0x{index:04X}:{subindex:02X}", "i16", value)
        typed = with_slaves(
            typed,
            [
                one.model_copy(update={"startup": (sdo,)}) if one.name == slave else one
                for one in typed.bus
            ],
        )
    elif change == "revision":
        at = [s.name for s in present].index(slave)
        present[at] = present[at].model_copy(update={"revision": value})
    with emulated(with_slaves(typed, present)) as bus:
        if change == "missing":
            bus.do(unplug, slave)
        elif change == "object":
            bus.do(set_object, slave, index, subindex, value, size)
        elif change == "read_only":
            bus.do(make_read_only, slave, index, subindex)
        elif change == "nothing":
            for name in [s.name for s in typed.slaves]:
                bus.do(unplug, name)
        backend = EthercatBackend(typed, MASTER_END)
        sentence = ""
        try:
            backend.open()
        except BackendError as error:
            sentence = str(error)
        backend.close()
        after = bus.do(counters)
    return {
        "sentence": sentence,
        "process_frames": after["process_frames"],
        "outputs": after["outputs"],
        "states": after["states"],
    }


def start_up_object(value: int, type: str = "u16") -> dict:
    """A start-up object of the rig file arrives before OP; one that the slave refuses is named."""
    typed = rig_named("bench")
    slaves = [
        (
            s.model_copy(
                update={
                    "startup": (_sdo(f"0x8000:{'15' if type == 'u16' else '06'}", type, value),)
                }
            )
            if s.name == "analog_in"
            else s
        )
        for s in typed.bus
    ]
    typed = with_slaves(typed, slaves)
    with emulated(typed) as bus:
        backend, sentence = EthercatBackend(typed, MASTER_END), ""
        try:
            backend.open()
        except BackendError as error:
            sentence = str(error)
        there = bus.do(object_value, "analog_in", 0x8000, 0x15)
        backend.close()
    return {"sentence": sentence, "there": there}


def object_value(bus, slave: str, index: int, subindex: int) -> int:
    return int.from_bytes(
        bus.slaves[slave].dictionary.objects[index].items[subindex].value, "little"
    )


def reactions_written(zero_at: str) -> dict:
    """What stands in drive and analog terminal once the bus is in OP, and what was noted."""
    from epa_rt.config.rig import Zero

    typed = load_rig(ROOT / "config/rigs/bench.yaml")
    zero = Zero.model_validate({"method": "here", "at": zero_at})
    typed = typed.model_copy(update={"motor": typed.motor.model_copy(update={"zero": zero})})
    with emulated(typed, lock_step=True) as bus:
        backend = EthercatBackend(typed, MASTER_END, lock_step=True)
        backend.open()
        events = [text for _kind, text, _data in backend.events]
        indices = (0x6007, 0x605A, 0x605B, 0x605C, 0x605E, 0x6084, 0x6085, 0x6065)
        drive = {f"0x{i:04X}": bus.do(object_value, "drive", i, 0) for i in indices}
        enabled = bus.do(object_value, "analog_in", 0x8000, 6)
        backend.close()
    return {"drive": drive, "filter": enabled, "events": events}


def _sdo(place: str, kind: str, value: int):
    from epa_rt.config.rig import StartupSdo

    return StartupSdo(object=place, type=kind, value=value)


def registers(watchdog_s: float) -> dict:
    """Watchdog registers of the slaves with outputs, interpolation time and SYNC0 of the drive,
    once in OP.
    """
    typed = rig_named("bench")
    typed = typed.model_copy(
        update={"safety": typed.safety.model_copy(update={"watchdog": watchdog_s})}
    )
    with emulated(typed) as bus:
        backend = EthercatBackend(typed, MASTER_END)
        backend.open()
        result = bus.do(register_values)
        backend.close()
        result["sync_after"] = bus.do(register_values)["sync"]
    return result


def register_values(bus) -> dict:
    memory = {name: slave.esc.memory for name, slave in bus.slaves.items()}
    word = lambda name, at: memory[name][at] | memory[name][at + 1] << 8  # noqa: E731
    return {
        "divider": [word(n, 0x0400) for n in ("valves", "analog_out", "drive")],
        "watchdog": [word(n, 0x0420) for n in ("valves", "analog_out", "drive")],
        "triggers": [
            memory["valves"][0x0804],
            memory["analog_out"][0x0814],
            memory["drive"][0x0814],
        ],
        "active": [
            memory["valves"][0x0806] & 1,
            memory["analog_out"][0x0816] & 1,
            memory["drive"][0x0816] & 1,
        ],
        "interpolation": [
            object_value(bus, "drive", 0x60C2, 1),
            object_value(bus, "drive", 0x60C2, 2),
        ],
        "sync": memory["drive"][0x0981],
        "sync0_ns": int.from_bytes(memory["drive"][0x09A0:0x09A4], "little"),
    }


def two_alike() -> dict:
    """Two EL2124 side by side: every pattern of bits arrives in its own terminal."""
    typed = rig_named("bench")
    slaves = list(typed.bus)
    slaves.insert(2, Slave(name="valves_b", device="EL2124"))
    typed = with_slaves(typed, slaves)
    wrong = []
    with emulated(typed, lock_step=True) as bus:
        backend = EthercatBackend(typed, MASTER_END, lock_step=True)
        backend.open()
        for first, second in itertools.product(range(16), range(16)):
            sent = bytes([first, second]) + bytes(len(backend.cycle.safe) - 2)
            ok = backend.exchange(sent).working_counter_ok
            if not ok or bus.do(terminal_bits) != [first, second]:
                wrong.append([first, second, ok, bus.do(terminal_bits)])
        expected, actual = backend.expected_working_counter, backend._bus.master.expected_wkc
        backend.close()
    return {"wrong": wrong, "expected": expected, "actual": actual}


def terminal_bits(bus) -> list[int]:
    return [bus.slaves[name].esc.memory[0x0F00] & 0x0F for name in ("valves", "valves_b")]


def lock_step(rig: str, experiment: str, cycles: int, period_ms: float = 1.0) -> dict:
    """An experiment over the bus in lock step and on the simulated rig: the first cycle whose image
    differs.
    """
    with tempfile.TemporaryDirectory() as folder:
        inputs = load_inputs(
            ROOT / f"config/experiments/{experiment}.yaml",
            rig_at_period(rig, period_ms, Path(folder)),
            None,
            with_plant=True,
        )
    recorded = []
    with emulated(inputs.rig, lock_step=True):
        for backend in (
            EthercatBackend(inputs.rig, MASTER_END, lock_step=True),
            SimBackend(inputs.rig, inputs.plant, 1),
        ):
            result, memory = _run(inputs, backend, Quiet(stop_at=cycles))
            recorded.append((result, memory.samples))
    (ours, over_bus), (theirs, simulated) = recorded
    differs = next(
        (i for i, (a, b) in enumerate(zip(over_bus, simulated, strict=False)) if a[:6] != b[:6]),
        None,
    )
    return {
        "cycles": [len(over_bus), len(simulated)],
        "differs": differs,
        "outcomes": [ours.outcome, theirs.outcome],
        "confirmed": ours.confirmed,
        "cause": ours.cause,
    }


def _run(inputs, backend, requests=None):
    assembly, memory = assemble(inputs.rig, inputs.experiment), Memory()
    with undisturbed(None):  # as epa run does: a garbage collection takes a hundred cycles here
        result = run(
            inputs.rig,
            backend,
            assembly.supervisor,
            assembly.envelope,
            assembly.decoder,
            assembly.encoder,
            memory,
            requests or Quiet(),
        )
    return result, memory


def _short(rig: str, loop: str = "motor_speed"):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "short.yaml")
        path.write_text(SHORT.format(loop=loop))
        return load_inputs(path, ROOT / f"config/rigs/{rig}.yaml", None, with_plant=True)


def _on(inputs, rig: Rig):
    return type(inputs)(rig, inputs.experiment, inputs.plant, inputs.attachments)


def runs(rig: str, loop: str = "motor_speed") -> dict:
    """To OP and closed again, so that the second finds what the first left; then a short experiment
    in real time, from bring-up to safe, and what acted in the cycle in which power came on.
    """
    inputs = _short(rig, loop)
    inputs = _on(inputs, patient(inputs.rig))
    with emulated(inputs.rig) as bus:
        first = EthercatBackend(inputs.rig, MASTER_END)
        first.open()
        ok = [first.exchange(bytes(len(first.cycle.safe))).working_counter_ok for _ in range(100)]
        opened = {
            "ok": sum(ok),
            "of": len(ok),
            "expected": first.expected_working_counter,
            "actual": first._bus.master.expected_wkc,
            "states": bus.do(counters)["states"],
            "events": [text for _kind, text, _data in first.events],
        }
        first.close()
        first.close()
        opened["drive_off"] = first.drive_off
        bus.do(watch_outputs)
        backend = EthercatBackend(inputs.rig, MASTER_END)
        result, _memory = _run(inputs, backend)
        seen, after = bus.do(seen_outputs), bus.do(counters)
    from sim_backend.devices import ENABLED

    powered = next((row for row in seen if row[0] == ENABLED), None)
    return {
        "opened": opened,
        "outcome": result.outcome,
        "cause": result.cause,
        "confirmed": result.confirmed,
        "cycles": result.cycles,
        "drive_off": backend.drive_off,
        "jump": None if powered is None else _jump(inputs.rig, *powered),
        "outputs_after": after["outputs"],
        "states_after": after["states"],
    }


def _jump(rig: Rig, _state: int, outputs: bytes, inputs: bytes) -> int | None:
    """Target less actual position, in counts, when power came on; None where the bus carries no
    target.
    """
    from epa_rt.signals.image import image_of

    target = image_of(rig, outputs=True).places.get("drive.target_position")
    actual = image_of(rig, outputs=False).places["drive.position"]
    if target is None:
        return None
    return _number(outputs, target.byte) - _number(inputs, actual.byte)


def _number(image: bytes, at: int) -> int:
    return int.from_bytes(image[at : at + 4], "little", signed=True)


def troubled(
    trouble: str,
    slave: str = "",
    code: int = 0x001B,
    recovery: str = "stop",
    lost_cycles: int = 3,
    at: int = 1500,
    real_time: bool = False,
    rig: str = "bench",
    lost_s: float = LOST_S,
) -> dict:
    """A run in which something happens to the bus ``at`` a cycle; how it ended and what the log
    would say. In lock step unless ``real_time``: nothing of it depends on when this machine lets
    somebody run.
    """
    drivers.backend._LOCK_STEP_TIMEOUT_S = lost_s
    inputs = _short(rig)
    rig = (
        patient(inputs.rig, recovery=recovery)
        if real_time
        else inputs.rig.model_copy(
            update={"master": inputs.rig.master.model_copy(update={"recovery": recovery})}
        )
    )
    rig = rig.model_copy(
        update={"safety": rig.safety.model_copy(update={"lost_cycles": lost_cycles})}
    )
    inputs = _on(inputs, rig)
    with emulated(rig, not real_time, **({} if real_time else {"delays_ns": BRISK_NS})) as bus:
        backend = EthercatBackend(rig, MASTER_END, not real_time)
        result, memory = _run(inputs, Troubling(backend, bus, at, trouble, slave, code))
        after, triggers = bus.do(counters), bus.do(register_values)["triggers"]
        again = (
            _run(inputs, EthercatBackend(rig, MASTER_END, not real_time), Quiet(stop_at=400))[0]
            if trouble == "power_cycle"
            else None
        )
    return {
        "outcome": result.outcome,
        "cause": result.cause,
        "cycles": result.cycles,
        "tripped_at": result.trip.cycle if result.trip else None,
        "confirmed": result.confirmed,
        "drive_off": backend.drive_off,
        "outputs_after": after["outputs"],
        "enabled_after": after["enabled"],
        "triggers": triggers,
        "bad": [s[0] for s in memory.samples if not s[1] & 1],
        "events": [list(e[:2]) for e in backend.events],
        "again": again.outcome if again else "",
        "again_cause": again.cause if again else "",
    }


class Troubling:
    """A backend that has the emulator do something in one cycle."""

    def __init__(
        self, inner: EthercatBackend, bus: Remote, at: int, trouble: str, slave: str, code: int
    ):
        self.inner, self.period_s, self._bus, self._at = inner, inner.period_s, bus, at
        self._trouble, self._slave, self._code = trouble, slave, code
        # what the bus has to say stays with the driver, for the test to read
        self.events, self.drive_off = [], None

    def open(self) -> None:
        self.inner.open()

    def exchange(self, outputs_raw: bytes):
        exchange = self.inner.exchange(outputs_raw)
        if exchange.cycle == self._at:
            if self._trouble == "unplug":
                self._bus.do(unplug, self._slave)
            elif self._trouble == "power_cycle":
                self._bus.do(power_cycle, self._slave)
            elif self._trouble == "fall":
                self._bus.do(fall, self._slave, self._code)
            elif self._trouble == "lose":
                self._bus.do(lose_frames, 5, self._code)
            elif self._trouble == "lose_two_of_three":
                self._bus.do(lose_two_of_three, self._code)
        return exchange

    def close(self) -> None:
        self.inner.close()


def follows(drift_ppm: float, off_ns: int, cycles: int) -> dict:
    """From ``off_ns`` off: offsets of the planned edges from the reference clock, as the driver
    believes them and as they are (emulator and driver read the same monotonic clock, so that the
    emulator can tell for any instant).
    """
    typed = rig_named("bench")
    with (
        emulated(typed, drift_ppm={s.name: drift_ppm for s in typed.slaves}) as bus,
        undisturbed(None),
    ):
        backend = EthercatBackend(typed, MASTER_END)
        backend.open()
        backend.cycle.edges.steer(off_ns)
        backend.cycle.clock.locked = False  # as at the start: the loop has to find its way back
        backend.cycle.clock._spread_ns = float(backend._period_ns)
        believed, edges = [], []
        for _ in range(cycles):
            edges.append(backend.exchange(backend.cycle.safe).t_ns - backend.cycle._epoch_ns)
            believed.append(backend.cycle.clock.offset_ns)
        locked, period = backend.cycle.clock.locked, backend._period_ns
        true = [t % period - period // 2 for t in bus.do(reference_times, edges)]
        backend.close()
    return {"believed": believed, "true": true, "locked": locked}


def reference_times(bus, edges: list[int]) -> list[int]:
    """System time of the reference clock (the coupler's) at instants of the monotonic clock."""
    slave = bus.slaves["coupler"]
    offset = int.from_bytes(slave.esc.memory[0x0920:0x0928], "little", signed=True)
    return [int(slave.clock.local_ns(edge) + offset + slave.clock._correction) for edge in edges]


def scanned(change: str) -> dict:
    """epa scan as the command line runs it."""
    import subprocess
    import sys

    typed = rig_named("bench")
    with emulated(typed) as bus:
        if change == "missing":
            bus.do(unplug, "analog_in")
        done = subprocess.run(
            [
                sys.executable,
                "-m",
                "epa_rt",
                "scan",
                "--interface",
                MASTER_END,
                "--rig",
                str(ROOT / "config/rigs/bench.yaml"),
            ],
            capture_output=True,
            text=True,
            check=False,
            cwd=ROOT,
        )
        after = bus.do(counters)
    return {
        "code": done.returncode,
        "out": done.stdout,
        "err": done.stderr,
        "process_frames": after["process_frames"],
        "states": after["states"],
    }


def wrong_images() -> dict:
    """Images of the wrong size are refused, before and after."""
    typed = rig_named("bench")
    sentences = []
    with emulated(typed, lock_step=True):
        backend = EthercatBackend(typed, MASTER_END, lock_step=True)
        backend.open()
        for image in (b"", bytes(len(Encoder(typed).safe_raw) + 1)):
            try:
                backend.exchange(image)
            except BackendError as error:
                sentences.append(str(error))
        fine = backend.exchange(Encoder(typed).safe_raw).working_counter_ok
        backend.close()
        try:
            backend.exchange(Encoder(typed).safe_raw)
        except BackendError as error:
            sentences.append(str(error))
    return {"sentences": sentences, "fine": fine}


# one master


def second_masters(tries: int) -> dict:
    """A run's bus in OP; scans and second backends beside it, in processes of their own; then what
    the run's own cycles saw of it.
    """
    import subprocess
    import sys

    typed = rig_named("bench")
    commands = [
        [sys.executable, "-m", "epa_rt", "scan", "--interface", MASTER_END],
        [
            sys.executable,
            "-c",
            "import sys\n"
            "from drivers.backend import EthercatBackend\n"
            "from epa_rt.backend import BackendError\n"
            "from epa_rt.config.rig import load_rig\n"
            "try:\n"
            f"    EthercatBackend(load_rig('config/rigs/bench.yaml'), '{MASTER_END}').open()\n"
            "except BackendError as error:\n"
            "    sys.exit(str(error))\n",
        ],
    ]
    with emulated(typed, lock_step=True) as bus:
        backend = EthercatBackend(typed, MASTER_END, lock_step=True)
        backend.open()
        before = bus.do(counters)["states"]
        beside = [
            subprocess.Popen(
                commands[k % 2], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT
            )
            for k in range(tries)
        ]
        bad = 0
        while any(process.poll() is None for process in beside):
            bad += not backend.exchange(backend.cycle.safe).working_counter_ok
        said = [process.communicate()[1] for process in beside]
        after = bus.do(counters)["states"]
        backend.close()
        again = EthercatBackend(typed, MASTER_END, lock_step=True)
        again.open()
        again.close()
    import os

    return {
        "bad": bad,
        "before": before,
        "after": after,
        "codes": [process.returncode for process in beside],
        "said": said,
        "pid": os.getpid(),
    }


def another_machines_master(take_over: bool = False) -> dict:
    """A bus that somebody drives whose claim is not seen here, then one that he left alone; what a
    second master says of either.
    """
    import threading
    import time

    typed = rig_named("bench")
    typed = typed.model_copy(update={"safety": typed.safety.model_copy(update={"watchdog": 0.5})})
    with emulated(typed) as bus:
        first = EthercatBackend(typed, MASTER_END)
        first.open()
        first._claim.release()
        ended, cycles = threading.Event(), []

        def drive() -> None:
            while not ended.is_set():
                try:
                    first.exchange(first.cycle.safe)
                except BackendError:  # it was taken over
                    return
                cycles.append(1)
                time.sleep(0.001)

        driver = threading.Thread(target=drive)
        driver.start()
        second, live = EthercatBackend(typed, MASTER_END, False, take_over), ""
        try:
            second.open()
        except BackendError as error:
            live = str(error)
        second.close()
        states = bus.do(counters)["states"]
        ended.set()
        driver.join()
        first._bus.close()  # as a process that is killed does
        third, dead = EthercatBackend(typed, MASTER_END, False, take_over), ""
        try:
            third.open()
        except BackendError as error:
            dead = str(error)
        third.close()
    return {"live": live, "dead": dead, "states": states, "cycles": len(cycles)}


def diagnosed(cycles: int) -> dict:
    """A bus in OP on whose drive an emergency waits; what the driver tells of it meanwhile, and of
    the clocks at the end.
    """
    typed = rig_named("bench")
    with emulated(typed) as bus, undisturbed(None):
        backend = EthercatBackend(typed, MASTER_END)
        backend.open()
        backend.events.clear()
        bus.do(send_emergency, "drive", 0x8611)
        bad = sum(
            not backend.exchange(backend.cycle.safe).working_counter_ok for _ in range(cycles)
        )
        running = list(backend.events)
        backend.close()
    return {"bad": bad, "running": running, "events": backend.events}


def send_emergency(bus, slave: str, code: int) -> None:
    bus.slaves[slave].report(code)
