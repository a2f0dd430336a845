"""What is asked of kernel and interpreter is given back, whatever happens inside."""

import gc
import os
import sys

import pytest

from epa_rt.config.rig import Realtime
from epa_rt.realtime import process
from epa_rt.realtime.process import undisturbed


def state() -> tuple:
    return (
        gc.isenabled(),
        gc.get_freeze_count(),
        os.sched_getaffinity(0),
        os.sched_getscheduler(0),
        os.sched_getparam(0).sched_priority,
        sys.getswitchinterval(),
    )


class Kernel:
    """Grants everything and remembers it; the real one would hold this test's own process to it."""

    def __init__(self, monkeypatch, locked: int = 0):
        self.calls, self.affinity, self.scheduler = [], {0, 1}, (os.SCHED_BATCH, os.sched_param(0))
        monkeypatch.setattr(process.ctypes, "CDLL", lambda *_, **__: self)
        self.mlockall = lambda flags: self.calls.append(("lock", flags)) or locked
        self.munlockall = lambda: self.calls.append(("unlock",))
        monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(self.affinity))
        monkeypatch.setattr(
            os, "sched_setaffinity", lambda _, cores: setattr(self, "affinity", cores)
        )
        monkeypatch.setattr(os, "sched_getscheduler", lambda _: self.scheduler[0])
        monkeypatch.setattr(os, "sched_getparam", lambda _: self.scheduler[1])
        monkeypatch.setattr(
            os,
            "sched_setscheduler",
            lambda _, policy, param: setattr(self, "scheduler", (policy, param)),
        )


def test_garbage_collection_rests_inside_and_runs_again_after():
    before = state()
    with undisturbed(None) as sentences:
        assert not gc.isenabled() and gc.get_freeze_count() > 0
        assert sentences == ["garbage collection frozen"]
    assert state() == before


def test_it_stays_off_where_it_was_off():
    gc.disable()
    try:
        with undisturbed(None):
            pass
        assert not gc.isenabled()
    finally:
        gc.enable()


def test_an_error_inside_gives_all_back_as_well(monkeypatch):
    kernel = Kernel(monkeypatch)
    with pytest.raises(RuntimeError), undisturbed(Realtime(priority=42, core=1)) as sentences:
        assert (
            kernel.affinity == {1}
            and kernel.scheduler[0] == os.SCHED_FIFO
            and kernel.scheduler[1].sched_priority == 42
        )
        assert sentences[1:] == ["memory locked", "running on core 1", "SCHED_FIFO priority 42"]
        raise RuntimeError
    assert (
        kernel.affinity == {0, 1}
        and kernel.scheduler[0] == os.SCHED_BATCH
        and kernel.calls == [("lock", 3), ("unlock",)]
    )
    assert gc.isenabled()


def test_no_core_asked_for_is_no_core_taken(monkeypatch):
    kernel = Kernel(monkeypatch)
    with undisturbed(Realtime()) as sentences:
        assert "no core asked for" in sentences and kernel.affinity == {0, 1}


def test_what_is_not_granted_is_said_and_not_undone(monkeypatch):
    kernel = Kernel(monkeypatch, locked=-1)

    def refuse(*_):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setaffinity", refuse)
    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    with undisturbed(Realtime(priority=80, core=1)) as sentences:
        assert sentences[1].startswith("memory not locked (")
        assert sentences[2:] == [
            "core 1 not taken (Operation not permitted)",
            (
                "SCHED_FIFO not granted (Operation not permitted): raise 'rtprio' in"
                " /etc/security/limits.conf"
            ),
        ]
    assert kernel.calls == [("lock", 3)]


def test_the_real_process_is_as_before():
    before = state()
    with undisturbed(Realtime(priority=1, core=min(before[2]))) as sentences:
        assert len(sentences) == 4
    assert state() == before


def test_a_core_that_the_machine_lacks_is_said():
    before = state()
    with undisturbed(Realtime(core=1023)) as sentences:
        assert sentences[2].startswith("core 1023 not taken")
    assert state() == before
