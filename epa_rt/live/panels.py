"""The words and lines of the terminal view, each from a watched run and a width in columns."""

from __future__ import annotations

import math

from rich.text import Text

from epa_rt.live.attach import Happened
from epa_rt.live.plot import bounds, drawn, spark
from epa_rt.live.watched import KEPT_S, STEP_NS, WatchedRun
from epa_rt.report.shown import Shown

_DECIMALS = {"m": 2, "m/s": 2, "rad": 2, "rad/s": 1, "Pa": 1, "N": 1, "N*m": 1, "A": 2}
_LEAST = {"m": 1e-3, "rad": 0.01, "N": 2.0, "Pa": 10e3}  # what a plot shows at least, SI
_MEASURED, _REFERENCE = "bright_green", "bright_yellow"
_WARN, _BAD, _GOOD, _DIM = "bold yellow", "bold white on red", "green", "dim"
_STATE_STYLES = {"run": "bold black on green", "done": "bold white on blue"}
_STOPPING = ("stop", "brake", "vent", "let_down", "disable", "safe")
_KIND_STYLES = {"trip": _BAD, "error": _BAD, "mark": "bold magenta", "request": _WARN}
_HIDDEN = ("realtime",)  # said once at the start, and for the log
_GAUGE = " kPa gauge"


def quantity(run: WatchedRun, value: float, si_unit: str, wide: int = 0) -> str:
    """A value with its unit, as a person reads it: mm, deg, kPa gauge."""
    scale = Shown(run.rig.atmosphere_pa, gauge=True).scale(si_unit)
    decimals = _DECIMALS.get(si_unit, 2)
    shown = round(float(scale.of(value)), decimals) + 0.0  # no -0.00
    text = f"{shown:.{decimals}f}" if math.isfinite(shown) else "–"
    return f"{text:>{wide}} {scale.unit}".rstrip()


def spoken(name: str) -> str:
    """'muscle force' for muscle_force_n; its unit stands beside it."""
    for suffix in ("_rad_s", "_m_s", "_nm", "_pa", "_rad", "_n", "_m", "_a"):
        if name.endswith(suffix):
            return name.removesuffix(suffix).replace("_", " ")
    return name.replace("_", " ")


def clock(seconds: float) -> str:
    """'00:12', '1:02:03'."""
    whole = max(round(seconds), 0)
    hours, minutes = divmod(whole // 60, 60)
    tail = f"{minutes:02d}:{whole % 60:02d}"
    return f"{hours}:{tail}" if hours else tail


def head(run: WatchedRun, width: int) -> Text:
    """Rig, experiment, backend; state, phase, time."""
    facts = run.facts.run
    speed = facts.get("speed", "")
    pace = {"unpaced": "as fast as it goes", "": ""}.get(speed, f"at {speed} x real time")
    what = [facts.get("rig", run.rig.name), facts.get("experiment", ""), facts.get("backend", "")]
    text = Text(" · ".join(filter(None, [*what, pace])), style="bold", no_wrap=True)
    text.truncate(width, overflow="ellipsis")
    state, phases = run.state, run.facts.layout.phases
    is_over = bool(run.outcome) and state != "done"  # rows after the newest shown were left out
    if is_over:
        state = "done"
    style = _STATE_STYLES.get(state, _WARN if state in _STOPPING else "bold")
    if run.trip and state != "done":
        style = _BAD
    phase = run.phase
    if phase in phases:
        phase = f"{phases.index(phase) + 1}/{len(phases)} {phase}"
    second = Text.assemble((f" {state} ", style), no_wrap=True)
    if run.latest is None:
        second = Text(" starts", no_wrap=True)
    elif is_over:
        second.append(f"  what is shown is of {clock(run.t_s)}", "bold")
    elif phase != "-":
        second.append("  phase ").append(phase, "bold")
    second.truncate(width - 26, overflow="ellipsis")
    second.append(_time(run).rjust(width - second.cell_len))
    return Text("\n", no_wrap=True).join([text, second])


def _time(run: WatchedRun) -> str:
    total, left = run.total_s, run.left_s
    of = f" of {clock(total)}" if total else ""
    rest = f", {clock(left)} left" if left is not None and not run.outcome else ""
    return f"{clock(run.t_s)}{of}{rest}"


def plots(run: WatchedRun) -> list[tuple[str, str | None]]:
    """What is drawn: (signal, its reference), the controlled axis first, then forces, else the
    motor's travel.
    """
    rig = run.rig
    axis = rig.joint.position if rig.joint is not None else rig.motor.position
    found: list[tuple[str, str | None]] = [(axis, f"ref_{axis}")]
    found += [(row.name, None) for row in rig.inputs if row.si_unit == "N"][:1]
    if len(found) < 2 and rig.joint is not None:
        found.append((rig.motor.position, f"ref_{rig.motor.position}"))
    return [(name, ref if ref in run.places else None) for name, ref in found]


def plot(run: WatchedRun, name: str, reference: str | None, width: int, height: int) -> Text:
    """The last KEPT_S of a signal and its reference, under a line with their newest values."""
    unit = run.units[name]
    line = run.recent(name)
    ref = run.recent(reference) if reference else line[:0]
    low, high = bounds([line, ref], _LEAST.get(unit, 0.0))
    title = Text(f"{spoken(name)} ", no_wrap=True)
    title.append(quantity(run, run.value(name), unit), f"bold {_MEASURED}")
    if reference and math.isfinite(run.value(reference)):  # none is asked for outside of a trial
        title.append(", ref ")
        title.append(quantity(run, run.value(reference), unit), _REFERENCE)
    rows, of = max(height - 2, 1), round(KEPT_S * 1e9 / STEP_NS)
    signs = drawn(line, width, rows, low, high, of)
    behind = drawn(ref, width, rows, low, high, of)
    body = [_overlaid(a, b) for a, b in zip(signs, behind, strict=True)]
    span = f"last {KEPT_S:g} s, {quantity(run, low, unit)} to {quantity(run, high, unit)}"
    lines = [title, *body, Text(span, _DIM, no_wrap=True)]
    for one in lines:
        one.truncate(width)
    return Text("\n", no_wrap=True).join(lines)


def _overlaid(line: str, behind: str) -> Text:
    """Measured before reference, one sign each: dots of both, in the colour of the measured."""
    text = Text(no_wrap=True)
    for a, b in zip(line, behind, strict=True):
        is_measured = ord(a) > 0x2800
        sign = chr(ord(a) | ord(b))
        text.append(sign, _MEASURED if is_measured else _REFERENCE)
    return text


def muscles(run: WatchedRun, width: int) -> Text:
    """A line per muscle: pressure, what was asked for, valves as sent; then the motor's figures."""
    sent, lines = run.sent(), []
    for muscle in run.rig.muscles:
        reference = f"ref_{muscle.pressure}"
        line = Text(f"{muscle.name:<10.10} ", no_wrap=True)
        value, asked = (run.value(name) for name in (muscle.pressure, reference))
        line.append(quantity(run, value, "Pa", 6).removesuffix(_GAUGE), f"bold {_MEASURED}")
        if math.isfinite(asked):
            line.append(f" of {quantity(run, asked, 'Pa', 6)}", _REFERENCE)
        else:
            line.append(_GAUGE.ljust(len(" of ") + 6 + len(_GAUGE)), _MEASURED)
        for noun, row in (("in", muscle.inlet), ("out", muscle.exhaust)):
            line.append_text(_valve(noun, sent.get(row)))
        low, high = bounds([run.recent(muscle.pressure)], _LEAST["Pa"])
        room = max(min(width - line.cell_len - 1, 60), 0)
        line.append(" " + spark(run.recent(muscle.pressure), room, low, high), _MEASURED)
        line.truncate(width)
        lines.append(line)
    lines.append(_motor(run, width))
    return Text("\n", no_wrap=True).join(lines)


def _valve(noun: str, value: float | None) -> Text:
    if value is None:
        return Text("")
    is_open = value > 0.5
    word = "open" if is_open else "shut"
    return Text.assemble(f" {noun} ", (word, "bold black on cyan" if is_open else _DIM))


def _motor(run: WatchedRun, width: int) -> Text:
    motor, rig = run.rig.motor, run.rig
    parts = []
    torque = next((row.name for row in rig.inputs if row.si_unit == "N*m"), None)
    travel = motor.position if rig.joint is not None else None
    for noun, name in (
        ("current", motor.current),
        ("torque", torque),
        ("speed", motor.speed),
        ("travel", travel),
    ):
        if name is not None and name in run.places:
            parts.append(f"{noun} {quantity(run, run.value(name), run.units[name])}")
    text = Text(f"{'motor':<10} " + "  ".join(parts), no_wrap=True)
    text.truncate(width)
    return text


def health(run: WatchedRun, width: int) -> Text:
    """Lateness, working counter, recorder, what this view was not given."""
    late, status = run.lateness(), run.status
    first = Text("lateness ", no_wrap=True)
    if run.latest is None:
        first = Text("waiting for the first cycle", _DIM, no_wrap=True)
        first.truncate(width)
        return first
    first.append(f"p99.9 {late.p999_us:.0f} us, worst {run.worst_ns / 1e3:.0f} us", "bold")
    first.append(f", {run.late_cycles} late ", _WARN if run.late_cycles else "")
    first.append("| working counter ")
    first.append("ok" if run.bus_ok else "NOT ok", _GOOD if run.bus_ok else _BAD)
    first.append(f", {run.bad_cycles} bad", _WARN if run.bad_cycles else "")
    second = Text("recorder ", no_wrap=True)
    if status is not None:
        if status.failure:
            second.append(status.failure, _BAD)
        else:
            second.append(
                f"buffer {100 * status.ring_ratio:.0f} % full, log {status.log_bytes / 1e6:.1f} MB"
            )
        second.append(f" | {status.viewers} viewer{'s' * (status.viewers != 1)}")
    if run.skipped_rows:
        second.append(f" | {run.skipped_rows} cycles not shown here", _WARN)
    if run.missed_events:
        second.append(f" | {run.missed_events} events not shown here", _WARN)
    for one in (first, second):
        one.truncate(width)
    return Text("\n", no_wrap=True).join([first, second])


def events(run: WatchedRun, width: int, height: int) -> Text:
    """The newest events, one line each, newest last; none longer than the width."""
    shown = [event for event in run.events if event.kind not in _HIDDEN and event.text]
    lines = [_event(event, width) for event in shown[-max(height, 1) :]]
    return Text("\n", no_wrap=True).join(lines)


def _event(event: Happened, width: int) -> Text:
    text = Text(f"{event.t_ns / 1e9:8.3f} s  ", _DIM, no_wrap=True)
    text.append(f"{event.kind:<11.11} ", _KIND_STYLES.get(event.kind, "cyan"))
    text.append(printable(event.text), "default")
    text.truncate(width, overflow="ellipsis")
    return text


def verdict(run: WatchedRun) -> Text:
    """Trip cause, stop category, outcome and how the rig was left, all in full; empty while
    nothing is to be said.
    """
    parts: list[tuple[str, str]] = []
    if run.trip:
        parts.append((f"trip: {run.trip}", _BAD))
    if run.category:
        parts.append((run.category, _WARN))
    if run.outcome:
        cause = "" if run.cause == run.trip else run.cause
        parts.append((f"{run.outcome}{': ' + cause if cause else ''}", "bold"))
    if run.left:
        parts.append((run.left, ""))
    if run.over is not None and not run.outcome:
        parts.append(("the run went away: no end of it was said", _BAD))
    return Text("\n").join(Text(printable(words), style) for words, style in parts)


def printable(text: str) -> str:
    """Text of a log, which must not steer the terminal."""
    encoded = text.encode("utf-8", "replace").decode()
    return "".join(c if c.isprintable() else " " for c in encoded)
