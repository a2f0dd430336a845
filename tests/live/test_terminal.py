"""The terminal view: driven through Textual at 80 x 24, and once in a real terminal by tmux."""

import asyncio
import contextlib
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from textual import events as keys

from epa_rt.cli.inputs import load_inputs
from epa_rt.live.attach import Attached, Happened, Over, Rows, RunFacts, Status, find
from epa_rt.live.panels import events, head, health, muscles, plot, verdict
from epa_rt.live.plot import drawn, spark
from epa_rt.live.start import Views, Wanted
from epa_rt.live.terminal import LiveView
from epa_rt.live.watched import WatchedRun
from epa_rt.logs.feed.feed import MARK_S
from epa_rt.logs.feed.wire import LONGEST_TEXT
from epa_rt.logs.reader import LogReader
from epa_rt.logs.recorder import Recorder
from epa_rt.logs.ring import slot_dtype
from epa_rt.loop.assembly import assemble
from epa_rt.loop.requests import STOP, OperatorRequests
from epa_rt.loop.viewers import ViewerRequests
from tests.cli.shell import EXPERIMENTS, RIGS, ROOT

SIZE = (80, 24)
TRIP = "muscle_pressure_pa: 905 kPa abs is above its limit of 901 kPa abs, seen for 20 ms, so " * 3


@pytest.fixture(scope="module")
def run():
    """Facts of a bench run, without a process behind them."""
    inputs = load_inputs(
        EXPERIMENTS / "identification_short.yaml", RIGS / "bench.yaml", None, with_plant=False
    )
    assembly = assemble(inputs.rig, inputs.experiment)
    return inputs, assembly


def watched(run, seconds: float = 3.0) -> WatchedRun:
    inputs, assembly = run
    layout = assembly.layout
    seen = WatchedRun(
        RunFacts(
            log="bench.mcap",
            layout=layout,
            slot_bytes=0,
            loop_pid=0,
            total_cycles=30_000,
            run={"rig": "bench", "experiment": "identification_short", "period_s": "0.001"},
            rig=inputs.attachments["rig.yaml"].decode(),
            takes_requests=True,
        )
    )
    slots = np.zeros(round(1000 * seconds), slot_dtype(layout))
    slots["cycle"] = np.arange(len(slots))
    slots["t_ns"] = slots["cycle"] * 1_000_000
    slots["state"], slots["phase"], slots["flags"] = 2, 1, 1
    slots["lateness_ns"] = 10_000
    slots["lateness_ns"][-1] = 700_000
    slots["values"] = 101_325.0 + 1e5
    slots["values"][:, seen.places["ref_muscle_pressure_pa"]] = np.nan
    seen.take(Rows(slots))
    return seen


def test_all_that_an_operator_needs_stands_there_with_its_unit(run):
    seen = watched(run)
    text = "\n".join(part.plain for part in (head(seen, 80), muscles(seen, 80), health(seen, 80)))
    for words in ("run", "phase 2/14 fill", "00:03 of 00:30", "100.0", "kPa gauge", "in shut"):
        assert words in text, words
    for words in ("current", " A", "mNm", "p99.9", "worst 700 us", "working counter ok, 0 bad"):
        assert words in text, words
    assert "motor travel" in plot(seen, "motor_travel_m", "ref_motor_travel_m", 60, 6).plain


def test_what_is_not_there_is_not_shown(run):
    seen = watched(run, 0.001)
    shown = muscles(seen, 80).plain
    assert "100.0 kPa gauge" in shown and "–" not in shown.splitlines()[0]
    seen.latest = None
    text = "\n".join(part.plain for part in (head(seen, 80), health(seen, 80)))
    assert "starts" in text and "waiting for the first cycle" in text
    assert "NOT ok" not in text and "phase" not in text


def test_a_trip_and_the_end_are_said_in_full(run):
    seen = watched(run)
    seen.take(Happened(1, 10, 10, "trip", TRIP))
    seen.take(Happened(2, 10, 10, "category", "stop category 1: the drive brakes"))
    seen.take(Happened(3, 10, 10, "end", TRIP, {"outcome": "tripped", "end": "end: NOT vented"}))
    said = verdict(seen).plain
    assert TRIP in said and "category 1" in said and "tripped" in said and "NOT vented" in said
    other = watched(run)
    other.take(Over(False))
    assert "went away" in verdict(other).plain


def test_old_rows_are_not_shown_as_those_of_a_run_that_is_over(run):
    """A busy machine's view may miss the last rows; what stands there is then of before."""
    seen = watched(run)
    assert " done " not in head(seen, 80).plain
    seen.take(Happened(1, 10, 10, "end", "", {"outcome": "completed", "end": "end: vented"}))
    assert " done   what is shown is of 00:0" in head(seen, 80).plain


def test_a_gap_in_the_events_is_noticed(run):
    seen = watched(run)
    seen.take(Happened(3, 1, 1, "phase", "two are missing"))
    assert seen.missed_events == 2 and "2 events not shown" in _with_status(seen)


def _with_status(seen: WatchedRun) -> str:
    seen.take(Status(0.0, 1000, "", 1, 0))
    return health(seen, 200).plain


@settings(max_examples=20, deadline=None)
@given(
    width=st.integers(1, 200),
    height=st.integers(1, 60),
    values=st.lists(st.floats(allow_nan=True, allow_infinity=True, width=32), max_size=300),
    text=st.text(max_size=300),
)
def test_nothing_is_wider_than_the_screen_or_steers_it(run, width, height, values, text):
    line = np.array(values, float)
    with np.errstate(all="ignore"):
        signs = drawn(line, width, height, -1.0, 1.0, 300)
        assert [len(row) for row in signs] == [width] * height
        assert len(spark(line, width, -1.0, 1.0)) == width
    seen = watched(run, 0.05)
    seen.take(Happened(1, 1, 1, "event", text))
    for part in (head(seen, max(width, 40)), muscles(seen, width), events(seen, width, height)):
        for row in part.plain.split("\n"):
            assert len(row) <= max(width, 40) or not row.isascii()
            assert row.isprintable() or not row


def test_the_view_fits_80_by_24_grows_and_its_keys_ask_the_run(run, tmp_path, monkeypatch):
    inputs, assembly = run
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    requests = OperatorRequests()
    viewers = ViewerRequests(requests)
    log = tmp_path / "log.mcap"
    facts = {"run": {"rig": "bench", "period_s": "0.001"}}
    recorder = Recorder(
        log, assembly.layout, inputs.attachments, facts, True, asks_fd=viewers.recorders_fd
    )
    recorder.open()
    recorder.event(0, 0, "trip", TRIP)
    groups = [dict.fromkeys(names, 1.0) for names in _groups(assembly.layout)]
    raw = (bytes(assembly.layout.inputs_bytes), bytes(assembly.layout.outputs_bytes))

    async def drive() -> None:
        with Attached(find(log)) as attached:
            for cycle in range(3000):
                recorder.sample(cycle, cycle * 1_000_000, 1, 2, 1, 0, 0, 0, 0, *raw, *groups)
            view = LiveView(attached)
            async with view.run_test(size=SIZE) as pilot:
                await _until(pilot, lambda: view.run_seen.cycles > 0)
                await pilot.pause(0.5)
                assert _bottom(view, SIZE), "something lies below the screen"
                assert TRIP.split()[-1] in verdict(view.run_seen).plain
                await pilot.press("m")
                await _until(pilot, lambda: requests.poll(1) or requests.log)
                await pilot.press("n", *"bang", "enter")
                await _until(pilot, lambda: requests.poll(1) or len(requests.log) > 1)
                await pilot.pause(MARK_S)
                _burst(view, "nStraps: n\u00e4chster qms", "backspace", "enter")
                await _until(pilot, lambda: requests.poll(1) or len(requests.log) > 2)
                await pilot.pause(MARK_S)
                _burst(view, "nstop S", "escape")
                _burst(view, "n")
                view.post_message(keys.Paste("pasted S\nas"))
                _burst(view, " " * LONGEST_TEXT, "enter")
                await _until(pilot, lambda: requests.poll(1) or len(requests.log) > 3)
                await pilot.press("s")
                await _until(pilot, lambda: requests.poll(2) == STOP)
                await pilot.resize_terminal(160, 50)
                await pilot.pause(0.5)
                assert _bottom(view, (160, 50))
                assert view.query_one("#events").size.height > 6
                await pilot.press("q")

    try:
        with viewers.taken():
            asyncio.run(drive())
    finally:
        recorder.close("stopped", "")
    said = [(kind, text) for kind, text, _ in requests.log]
    assert said == [
        ("mark", "mark 1"),
        ("mark", "bang"),
        ("mark", "Straps: n\u00e4chster qm"),
        ("mark", "pasted S as"),
        ("request", "stop, asked by the terminal view"),
    ]


def test_ctrl_c_again_and_again_keeps_the_words_of_the_runs_end():
    views = Views(Wanted())
    deaf = (
        "import signal, time; [signal.signal(n, signal.SIG_IGN) for n in (2, 15)]; time.sleep(60)"
    )
    views._terminal = view = subprocess.Popen([sys.executable, "-c", deaf])
    own = (os.getpid(), signal.SIGINT)
    presses = [threading.Timer(at_s, os.kill, own) for at_s in (1.0, 1.3, 1.6)]
    for press in presses:
        press.start()
    views.finish()  # raises no KeyboardInterrupt
    for press in presses:
        press.join()
    assert view.returncode == -signal.SIGKILL and not views.has_terminal


def _burst(view: LiveView, text: str, *after: str) -> None:
    """Keys of a terminal, all before the view looks at the first."""
    for character in text:
        view.post_message(keys.Key(character, character))
    for key in after:
        view.post_message(keys.Key(key, key if len(key) == 1 else None))


def _groups(layout) -> list[tuple[str, ...]]:
    return [layout.measured, layout.reference, layout.command, layout.estimate]


async def _until(pilot, holds) -> None:
    end_s = time.monotonic() + 60.0
    while not holds():
        assert time.monotonic() < end_s, "waited in vain"
        await pilot.pause(0.02)


def _bottom(view: LiveView, size: tuple[int, int]) -> bool:
    shown = [widget for widget in view.screen.children if widget.display]
    return all(w.region.bottom <= size[1] and w.region.right <= size[0] for w in shown)


class Tmux:
    """A server of its own with one terminal of 80 x 24 that runs a command of epa."""

    def __init__(self, folder, *arguments):
        self.socket = str(folder / "tmux")
        command = " ".join(map(str, (sys.executable, "-m", "epa_rt", *arguments)))
        size = ("-x", str(SIZE[0]), "-y", str(SIZE[1]))
        self.sent = folder / "sent"  # bytes that the terminal was given
        self("new-session", "-d", *size, f"sleep 0.5; {command}; echo exit $?; sleep 600")
        self("pipe-pane", f"cat > {self.sent}")

    def __call__(self, *words: str) -> str:
        done = subprocess.run(
            ["tmux", "-S", self.socket, *words], cwd=ROOT, capture_output=True, text=True
        )
        return done.stdout

    def wait_for(self, words: str, key: str = "") -> str:
        """The screen, once the words are on it; until then ``key`` is pressed every 3 s."""
        end_s, pressed_s = time.monotonic() + 240.0, 0.0
        while words not in (screen := self("capture-pane", "-p")):
            assert time.monotonic() < end_s, f"waited in vain for {words!r}:\n{screen}"
            if key and time.monotonic() - pressed_s > 3.0:
                self("send-keys", key)
                pressed_s = time.monotonic()
            time.sleep(0.2)
        return screen


def _command_lines() -> list[bytes]:
    """Of every process, as every user sees them."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):
            found.append(path.read_bytes())
    return found


@pytest.mark.skipif(shutil.which("tmux") is None, reason="needs tmux: apt-get install tmux")
def test_in_a_real_terminal_keys_close_the_view_and_ctrl_c_stops_the_run(tmp_path):
    out = tmp_path / "out"
    words = ("run", EXPERIMENTS / "identification_short.yaml", "--rig", RIGS / "bench.yaml")
    tmux = Tmux(tmp_path, *words, "--speed", 0.3, "-o", out, "--live", "--foxglove", 0)
    try:
        screen = tmux.wait_for("close view")
        sent = tmux.sent.read_bytes()
        # a terminal that is asked to send keys as sequences makes no signal of Ctrl-C
        assert not re.search(rb"\x1b\[[>=]\d+u", sent)
        token = re.search(rb"token for .*: ([\w-]{16,})", sent)[1]
        assert not any(token in words for words in _command_lines())
        assert "kPa gauge" in screen and all(len(row) <= SIZE[0] for row in screen.split("\n"))
        tmux.wait_for("mark 1", key="m")
        time.sleep(MARK_S)
        tmux("send-keys", "-l", "nStrap at \u00fcbung S")
        tmux("send-keys", "Enter")
        tmux.wait_for("Strap at")
        tmux.wait_for("the run goes on", key="q")
        tmux("send-keys", "C-c")
        said = tmux.wait_for("exit 130")
        assert "stopped: the operator asked to stop" in said and "log:" in said
    finally:
        tmux("kill-server")
    (log,) = out.glob("*.mcap")
    with LogReader(log) as found:
        marks = [event.text for event in found.events() if event.kind == "mark"]
        assert {"mark 1", "Strap at \u00fcbung S"} <= set(marks) and not found.missing
