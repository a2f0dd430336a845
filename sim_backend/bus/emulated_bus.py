"""The emulated bus: a rig's slaves on one segment, the simulated plant behind them, and time.

Without IO: frames go in and come out as bytes, the caller says what time it is (nanoseconds of a
monotonic clock).
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import ceil

from epa_rt.config.rig import Rig
from epa_rt.models.plant_file import PlantFile
from sim_backend.bus import registers as reg
from sim_backend.bus.agenda import Agenda
from sim_backend.bus.al_machine import DELAYS_NS
from sim_backend.bus.bus_faults import BusFaults
from sim_backend.bus.bus_plant import BusPlant
from sim_backend.bus.coupling import Coupling
from sim_backend.bus.epos4 import Epos4
from sim_backend.bus.frame import LRD, LRW, LWR, datagrams_of
from sim_backend.bus.logical import Plan
from sim_backend.bus.mailbox import RESPONSE_NS
from sim_backend.bus.segment import Segment
from sim_backend.bus.slave import Settings, Slave
from sim_backend.bus.terminals import Terminal
from sim_backend.bus.topology import wire

_NEAR = 8  # a step nearer to a frame than this part of a period would hold its answer up
_STAYS_CYCLES = 500
_LEFT_OUT_CYCLES = 1000


@dataclass
class Counters:
    """What the bus has seen. ``process_frames``: frames with logical data; ``steps``: periods that
    the plant moved.
    """

    frames: int = 0
    malformed: int = 0
    process_frames: int = 0
    steps: int = 0
    watchdogs: dict[str, int] = field(default_factory=dict)


class EmulatedBus:
    """A rig on the wire. ``lock_step``: one plant period per frame that carries all outputs, from
    OP on; else the plant moves with the clock of the first slave that has one, with or without a
    master: at each whole period of its system time, which is where a drive's SYNC0 is, so that a
    master locked to the clock never meets a plant step.
    """

    def __init__(
        self,
        rig: Rig,
        plant: PlantFile,
        seed: int = 0,
        lock_step: bool = False,
        drift_ppm: dict[str, float] | None = None,
        offset_ns: dict[str, int] | None = None,
        delays_ns: dict[int, int] = DELAYS_NS,
        response_ns: int = RESPONSE_NS,
        referenced: bool = True,
        count_offset: int = 0,
    ):
        self.rig, self.lock_step = rig, lock_step
        self._referenced, self._count_offset = referenced, count_offset
        self._plant_file, self._seed = plant, seed
        self.agenda, self.counters = Agenda(), Counters()
        self.transmit: Callable[[bytes], None] = lambda frame: (
            None
        )  # for frames that faults send late, or again
        self.faults = BusFaults(self, seed)
        settings = Settings(delays_ns, response_ns, drift_ppm or {}, offset_ns or {})
        self.slaves: dict[str, Slave] = {
            slave.name: (
                Epos4(slave.name, self.agenda, settings, slave.product, slave.revision)
                if slave.description.is_drive
                else Terminal(slave, self.agenda, settings)
            )
            for slave in rig.slaves
        }
        self.segment = Segment(self._outputs_arrived)
        self.coupling = Coupling(rig, self.slaves)
        self.is_running = (
            False  # lock step: from the first frame in OP until all slaves are below SAFEOP
        )
        self._frame_steps = False
        for slave in self.slaves.values():
            slave.on_change = self._changed
            slave.esc.on_mapping = self._mapping_changed
            slave.esc.on_data = lambda slave=slave: slave.watchdog.feed(self.time_ns)
        self._watchdogs = {id(slave.esc): slave.watchdog for slave in self.slaves.values()}
        self.segment.clock_escs = [
            slave.esc for slave in self.slaves.values() if slave.clock is not None
        ]
        for esc in self.segment.clock_escs[:1]:
            esc.on_write.append(
                (reg.DC_OFFSET, reg.DC_OFFSET + 8, lambda address, length: self._to_whole_periods())
            )
        self.drive = next(
            (slave for slave in self.slaves.values() if isinstance(slave, Epos4)), None
        )
        self.plant = self._fresh_plant()
        self.rewire()
        self.rewind()

    @property
    def time_ns(self) -> int:
        """The time that watchdogs count: the plant's in lock step, else the clock's."""
        return self.plant.t_ns if self.lock_step else self.agenda.now_ns

    @property
    def cycle(self) -> int:
        """Plant periods since the start, or since the last rewind."""
        return self.plant.t_ns // self.plant.period_ns

    def _fresh_plant(self) -> BusPlant:
        return BusPlant(
            self.rig, self._plant_file, self._seed, self._referenced, self._count_offset
        )

    def rewind(self) -> None:
        """A fresh plant at cycle 0 and no faults; the slaves keep their states."""
        self.faults.clear()
        self.plant = self._fresh_plant()
        self.coupling.outputs[:] = bytes(len(self.coupling.outputs))
        for slave in self.slaves.values():
            slave.watchdog.feed(self.time_ns)
        if self.drive is not None:
            self.plant.bind(self.drive, self.coupling)
            self.plant.hear_master(self.drive.drives_outputs)
        for number, slave in enumerate(self.slaves.values()):
            if isinstance(slave, Terminal) and slave.has_filter:
                self._set_filter(number, slave)
        self._give()
        self._start_periods: int | None = None
        self._to_whole_periods()
        self._reported = 0

    def _set_filter(self, number: int, slave: Terminal) -> None:
        """Gives the plant's terminal the filter of its objects, now and when they are written."""
        set_now = lambda: self.plant.filter_terminal(number, slave.filter_selection)  # noqa: E731
        slave.on_filter = set_now
        set_now()

    def rewire(self) -> None:
        """After a slave has come or gone."""
        reached = wire(list(self.slaves.values()))
        self.segment.set_slaves([slave.esc for slave in reached])
        self.faults.is_dark = not reached
        self.coupling.stale()

    def _changed(self) -> None:
        self._mapping_changed()
        if self.drive is not None:
            self.plant.hear_master(self.drive.drives_outputs)
        self.coupling.give(
            bytes(self.coupling.inputs)
        )  # a slave that enters SAFEOP has inputs from the start
        states = {slave.al.state for slave in self.slaves.values()}
        if self.is_running and not states & {reg.SAFEOP, reg.OP}:
            self.is_running = False

    def _mapping_changed(self) -> None:
        self.coupling.stale()
        self.segment.logical.forget()

    def receive(self, frame: bytearray, now_ns: int) -> bool:
        """Runs a frame that arrived at ``now_ns`` through the slaves, in place. True: send it back.
        False: malformed (nothing has happened), or a fault has taken it, which sends by
        ``transmit`` what is to be sent.
        """
        self.advance_to(now_ns)
        self.counters.frames += 1
        datagrams = datagrams_of(frame)
        if datagrams is None:
            self.counters.malformed += 1
            return False
        self._frame_steps = True
        for datagram in datagrams:
            if LRD <= datagram[0] <= LRW:
                self.counters.process_frames += 1
                break
        frame[6] |= (
            0x02  # a frame that has passed slaves: its source address says "locally administered"
        )
        if self.faults.is_idle:
            self.segment.run(frame, datagrams)
            return True
        self.faults.start_due(self.cycle)
        if self.faults.is_quiet:
            self.segment.run(frame, datagrams)
            return True
        self.faults.pass_frame(frame, datagrams)
        return False

    def pass_time(self, datagrams: list[tuple[int, int, int, int, int]]) -> None:
        """A frame has not reached the slaves; in lock step its period passes all the same."""
        if (
            self.lock_step
            and self.is_running
            and any(
                LWR <= command <= LRW
                and self.segment.logical.plan(command, address, length).carries_all_outputs
                for command, _, address, _, length in datagrams
            )
        ):
            self._step()

    def _outputs_arrived(self, plan: Plan) -> None:
        """The master's outputs are in the slaves' memories."""
        time_ns = self.time_ns
        for esc in plan.written:
            watchdog = self._watchdogs[id(esc)]
            if watchdog.expired:
                watchdog.feed(time_ns)
                self._changed()
            else:
                watchdog.fed_ns = time_ns
        if not self.lock_step:
            self._keep_away()
            return
        if not self._frame_steps or not plan.carries_all_outputs:
            return
        if not self.is_running:
            if any(slave.is_present and slave.al.state != reg.OP for slave in self.slaves.values()):
                return
            self.is_running = True
        self._frame_steps = False  # at most one period per frame
        self._step()

    def _to_whole_periods(self) -> None:
        """The master has set the bus's clock: the plant moves at whole periods of system time."""
        self._step_due_ns, self._phase_ns = self.agenda.now_ns, 0
        self._shifted_cycle = self.cycle - _STAYS_CYCLES

    def _keep_away(self) -> None:
        """A master that follows no SYNC0 may send just when the plant moves: then the plant moves
        half a period later.
        """
        period_ns, left_ns = self.plant.period_ns, self._step_due_ns - self.agenda.now_ns
        near_ns = period_ns // _NEAR
        if (
            near_ns < left_ns < period_ns - near_ns
            or self.cycle - self._shifted_cycle < _STAYS_CYCLES
        ):
            return
        if not any(esc.memory[reg.DC_ACTIVATION] & 0x02 for esc in self.segment.clock_escs):
            self._shifted_cycle = self.cycle
            self._phase_ns += left_ns - period_ns // 2
            self._step_due_ns = self.agenda.now_ns + period_ns // 2

    def _step(self) -> None:
        if not self.faults.is_idle:
            self.faults.start_due(self.cycle)
        self._check_watchdogs()
        outputs = self.coupling.take()
        self.counters.steps += 1
        if self.drive is not None and not self.drive.is_present:
            self.plant.lose_drive_supply()
        if self.lock_step:
            inputs = self.plant.cycle(bytes(outputs))
        else:
            inputs = self.plant.step_now(bytes(outputs))
        self.coupling.give(inputs)
        self._report_drive()

    def _report_drive(self) -> None:
        """An emergency message when the drive's error code has changed."""
        code = int(self.plant.machine["error_code"][0])
        if code != self._reported and self.drive is not None:
            self._reported = code
            self.drive.report(code)

    def _check_watchdogs(self) -> None:
        time_ns = self.time_ns
        for slave in self.slaves.values():
            watchdog = slave.watchdog
            if (
                time_ns - watchdog.fed_ns > watchdog.timeout_ns
                and slave.al.state == reg.OP
                and slave.is_guarded
                and watchdog.check(time_ns)
            ):
                self.counters.watchdogs[slave.name] = self.counters.watchdogs.get(slave.name, 0) + 1
                slave.watchdog_expired()

    def _give(self) -> None:
        self.coupling.give(self.plant.present_inputs())

    def _plant_clock_ns(self, now_ns: int) -> float:
        """Local time of the first slave with a clock, in phase with its system time; without one,
        the emulator's.
        """
        for slave in self.slaves.values():
            if slave.clock is not None:
                return slave.clock.local_ns(now_ns) + slave.clock.ahead_ns() % self.plant.period_ns
        return float(now_ns)

    def advance_to(self, now_ns: int, most_steps: int = 1 << 30) -> None:
        """Time passes: what is due happens, each at its own time, and in real time the plant moves,
        at most so many periods. A time that has passed already is taken for the present.
        """
        if not self.lock_step and now_ns >= self._step_due_ns:
            if (
                self._start_periods is None
                or now_ns - self._step_due_ns > _LEFT_OUT_CYCLES * self.plant.period_ns
            ):
                self._start_periods, self._step_due_ns = (
                    None,
                    now_ns,
                )  # the start; or the emulator itself had been stopped
            while self._step_due_ns <= now_ns:
                if not most_steps:
                    return
                most_steps -= 1
                self.agenda.advance_to(max(self._step_due_ns, self.agenda.now_ns))
                self._move(self.agenda.now_ns)
        self.agenda.advance_to(max(now_ns, self.agenda.now_ns))

    def _move(self, now_ns: int) -> None:
        """One plant period, where one has passed by the bus's clock; and when the next one ends."""
        period_ns = self.plant.period_ns
        local_ns = self._plant_clock_ns(now_ns) + self._phase_ns
        periods = int(local_ns // period_ns)
        if self._start_periods is None:
            self._start_periods = periods - self.cycle
        if periods - self._start_periods > self.cycle:
            self._step()
        self._step_due_ns = now_ns + max(
            0, ceil((self._start_periods + self.cycle + 1) * period_ns - local_ns)
        )

    def next_due_ns(self) -> int | None:
        """When ``advance_to`` next has something to do; None where only a frame can bring that."""
        due = self.agenda.next_ns
        if self.lock_step:
            return due
        return self._step_due_ns if due is None else min(due, self._step_due_ns)
