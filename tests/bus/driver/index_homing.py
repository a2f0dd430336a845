"""A drive on an emulated bus in lock step seeks its index pulse, and what the rig goes through."""

from drivers.backend import EthercatBackend
from epa_rt.backend import BackendError
from epa_rt.config.rig import Rig, Zero, load_rig
from epa_rt.config.rig_homing import HomingOptions, index_way
from epa_rt.loop.by_hand import assemble_index
from epa_rt.loop.run import run
from tests.bus.driver.emulated import MASTER_END, ROOT
from tests.bus.faults.traced import traced
from tests.loop.rigging import Memory, Quiet

INDEX = Zero(
    method="index",
    at="10.27 mm",
    direction="decreasing",
    speed="4 mm/s",
    current="1 A",
    force="20 N",
)
MOVING = 600  # a cycle of the plant in which the drive seeks at full speed
AFTERWARDS = 1000  # cycles of the plant, once the master is silent
FRAME_S = 0.2  # lock step: how long the master waits for a frame that stays away


def index_rig() -> Rig:
    """The bench, homed on its index pulse."""
    rig = load_rig(ROOT / "config/rigs/bench.yaml")
    master = rig.master.model_copy(update={"frame_timeout": FRAME_S})
    motor = rig.motor.model_copy(update={"zero": INDEX})
    return rig.model_copy(update={"motor": motor, "master": master})


def _home(rig: Rig, requests: Quiet, homing: HomingOptions | None = None) -> dict:
    """One run, over the bus; the last measured row."""
    assembly, plan = assemble_index(rig)
    backend = EthercatBackend(rig, MASTER_END, lock_step=True, homing=homing or assembly.homing)
    memory = Memory()
    result = run(
        rig,
        backend,
        assembly.supervisor,
        assembly.envelope,
        assembly.decoder,
        assembly.encoder,
        memory,
        requests,
    )
    end = result.end
    return {
        "outcome": result.outcome,
        "cause": result.cause,
        "category": result.category,
        "measured": memory.samples[-1][6] if memory.samples else {},
        "after": plan.after,
        "off": bool(end is not None and end.off),
        "said": [text for _, kind, text, _ in memory.events if kind == "bus"],
    }


def _facts(bus, rig_start: int) -> dict:
    """What the plant went through since a row, and how it stands now."""
    rows, machine = bus.rows[rig_start:], bus.plant.machine[0]
    start = rows[0].travel_m
    return {
        "furthest_m": max(abs(row.travel_m - start) for row in rows),
        "fastest_m_s": max(abs(row.speed_m_s) for row in rows),
        "strongest_n": max(row.force_n for row in rows),
        "travels_m": [row.travel_m - start for row in rows],
        "speeds_m_s": [row.speed_m_s for row in rows],
        "powered": rows[-1].powered,
        "exhaust_open": all(rows[-1].exhaust_open),
        "gauge_pa": max(rows[-1].pressure_pa) - bus.rig.atmosphere_pa,
        "mode": int(machine["mode"]),
        "homing": int(machine["homing"]),
        "referenced": bool(machine["is_referenced"]),
        "count": int(machine["offset_counts"]),
    }


def _objects(bus) -> dict[str, int]:
    dictionary = bus.drive.dictionary
    places = {"method": (0x6098, 0), "switch": (0x6099, 1), "zero": (0x6099, 2)}
    places |= {"acceleration": (0x609A, 0), "home": (0x30B0, 0), "move": (0x30B1, 0)}
    return {name: dictionary.item(*place).number for name, place in places.items()}


def _add_fault(bus, kind: str, where: str, value: float | None, at_cycle: int) -> None:
    bus.faults.add(kind, where, value, at_cycle)


def _lose_index(bus) -> None:
    bus.plant._drive["has_index"] = 0


def _lose_zero(bus) -> None:
    bus.plant.lose_drive_supply()


def _move_behind(bus) -> None:
    """Objects as somebody else left them in the drive."""
    for place, value in (((0x30B1, 0), 5000), ((0x6099, 2), 3000), ((0x609A, 0), 100_000)):
        bus.drive.dictionary.item(*place).value = value.to_bytes(4, "little")


def _time_goes_on(bus) -> None:
    bus.time_goes_on(AFTERWARDS)


def _clear(bus) -> None:
    bus.faults.clear()


def _rows(bus) -> int:
    return len(bus.rows)


def homes() -> dict:
    """Unreferenced, with objects of somebody else: homed, and the objects read."""
    rig = index_rig()
    with traced(rig, True, None) as bus:
        bus.do(_lose_zero)
        bus.do(_move_behind)
        run_facts = _home(rig, Quiet())
        return run_facts | bus.do(_facts, 0) | {"objects": bus.do(_objects)} | _way(rig)


def homes_with(
    kind: str = "", place: str = "", value: float | None = None, stop_at: int = 1 << 60
) -> dict:
    """Homed with a fault at MOVING, or stopped by the operator; and homed again afterwards."""
    rig = index_rig()
    with traced(rig, True, None) as bus:
        if kind == "index":
            bus.do(_lose_index)
        elif kind:
            bus.do(_add_fault, kind, place, value, MOVING)
        run_facts = _home(rig, Quiet(stop_at))
        bus.do(_time_goes_on)
        facts = run_facts | bus.do(_facts, 0) | _way(rig)
        bus.do(_clear)
        if kind == "index":
            return facts | {"again": ""}
        again = _home(rig, Quiet())
    return facts | {"again": again["outcome"] + again["cause"]}


def refuses(kind: str = "sdo_forgotten", index: int = 0x6099) -> dict:
    """A drive that does not keep, or refuses, what its homing is set to."""
    rig = index_rig()
    with traced(rig, True, None) as bus:
        bus.do(_add_fault, kind, "drive", float(index), 0)
        run_facts = _home(rig, Quiet())
        return run_facts | {"rows": bus.do(_rows)}


def leaves_nothing_that_moves() -> dict[str, int]:
    """The objects after another run's bring-up behind a homing."""
    rig = index_rig()
    with traced(rig, True, None) as bus:
        _home(rig, Quiet(MOVING))
        backend = EthercatBackend(rig, MASTER_END, lock_step=True)
        try:
            backend.open()
        except BackendError as error:
            raise AssertionError(str(error)) from None
        backend.close()
        return bus.do(_objects)


def _way(rig: Rig) -> dict:
    return {"way": index_way(rig)._asdict()}


__all__ = ["homes", "homes_with", "leaves_nothing_that_moves", "refuses"]
