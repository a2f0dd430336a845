"""What the tests of a loop that stood still do on an emulated bus; see cases.py."""

import time

from drivers.backend import EthercatBackend
from epa_rt.backend import BackendError
from tests.bus.driver.cases import counters, rig_named, seen_outputs, watch_outputs
from tests.bus.driver.emulated import MASTER_END, emulated

_WATCHDOG_S, _PAUSE_S = 2.0, 2.5
_LIVE = 0x03  # both valves of the muscle: the inlet open, the exhaust shut
_TURNS = 23  # the next one is none in which the states are looked at


def stood_still() -> dict:
    """A loop with live outputs that stands still for longer than the slaves' watchdog: what it
    says, and what went out.
    """
    typed = rig_named("bench")
    typed = typed.model_copy(
        update={
            "safety": typed.safety.model_copy(update={"watchdog": _WATCHDOG_S}),
            "master": typed.master.model_copy(update={"clock": "free"}),
        }
    )
    with emulated(typed) as bus:
        backend, sentence = EthercatBackend(typed, MASTER_END), ""
        backend.open()
        bus.do(watch_outputs)
        live = bytes([_LIVE]) + bytes(len(backend.cycle.safe) - 1)
        ok = [backend.exchange(live).working_counter_ok for _ in range(_TURNS)]
        time.sleep(_PAUSE_S)
        frames = [bus.do(counters)["process_frames"]]
        try:
            backend.exchange(live)
        except BackendError as error:
            sentence = str(error)
        frames.append(bus.do(counters)["process_frames"])
        backend.close()
        seen, dropped = bus.do(seen_outputs), bus.do(dropped_by_themselves)
    on = [outputs[0] & _LIVE for _state, outputs, _inputs in seen]
    return {
        "ok": all(ok),
        "sentence": sentence,
        "frames": frames,
        "dropped": sorted(dropped),
        "rises": sum(now > before for before, now in zip([0, *on], on, strict=False)),
    }


def dropped_by_themselves(bus) -> dict:
    return dict(bus.counters.watchdogs)
