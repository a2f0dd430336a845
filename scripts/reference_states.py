"""docs/states.md from the code: its enumerations, and what its statements trip on and report.

The words are here; a state, a cause or a kind of event that the code has and this module has not,
or the other way round, is a KeyError.
"""

import ast
from collections import defaultdict
from collections.abc import Iterator, Mapping
from enum import Enum
from pathlib import Path

from reference_table import WRITTEN, index, table

from epa_rt.cli.exits import OF_OUTCOME
from epa_rt.control.cia402 import DriveState
from epa_rt.control.valve_settings import ValveCause, ValveState
from epa_rt.loop import supervisor, unpowered
from epa_rt.safety import stopping
from epa_rt.safety.trip import OVER_RANGE_CAUSE

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = ("epa_rt", "drivers", "sim_backend")
HEAD = """# States, trips, events

To look up which state a run is in, what tripped it, and what an event of its log means.
{written}
How a run ends: [operator.md](operator.md). What to do about each trip:
[after a trip](after-a-trip.md). Why stops have categories:
[decision 16](decisions/0016-stops-by-category.md).

{index}"""
STATES = {
    "bring_up": ("safe outputs; inputs are judged", "sound inputs for 0.1 s"),
    "enable": ("the drive is walked up, targets on actual values", "operation enabled"),
    "run": ("the experiment's phases", "the last phase is over, the motor stands"),
    "stop": ("the operator asked; the motion brakes", "the motor stands"),
    "brake": ("after a trip: air out, the drive brakes", "the motor stands"),
    "vent": ("held under power while the muscles vent", "vented and at rest"),
    "let_down": ("slowly to the rest place, where something pulls", "there, and stands"),
    "disable": ("valves without current, the drive is taken down", "the drive is off"),
    "safe": ("safe outputs, watched", "at rest, vented, off"),
    "done": ("the log is closed", ""),
    "unpowered": ("calibrate --by hand: only safe outputs leave", "the points are taken"),
}
CATEGORIES = {
    stopping.BRAKING: (
        "the drive brakes and holds while the muscles vent, then power goes",
        "drive, bus and position are sound and power was on",
    ),
    stopping.OFF: (
        "power off and air out at once, for good",
        "one of them is lost, or on the operator's second stop",
    ),
}
OUTCOMES = {
    "completed": "it ended by itself",
    "stopped": "the operator, or overrun: {policy: stop}",
    "tripped": "a cause of the table above",
    "failed": "the bus, the program or the log failed",
    "died": "the loop's process died; the recorder closed the log",
}
CAUSES = {
    "NaN": "a measured value is no number",
    "NaN command": "a command is no number",
    "bad command": "a switch neither 0 nor 1, a control word or mode not in use here",
    "contradiction": "position and speed do not agree",
    "drive": "it cannot be enabled, left operation enabled, or has another mode than asked for",
    "experiment": "a phase timed out, or cannot be begun",
    "following error": "motor or joint is too far from what is asked for",
    "forbidden combination": "inlet and exhaust open together, or a pair of never_together",
    "implausible sensor": "a reading contradicts the others",
    "internal error": "a fault of this program; the log has its text",
    "invalid sensor": "a broken wire, a value outside of valid, the terminal's error",
    "jump at enable": "a target is not where the motor is as power comes on",
    "let-down": "the motor does not go to its rest place as told",
    "lost working counter": "process data were not sound, in a row or too often",
    "mode change": "the mode is changed under power",
    "motor overload": "i²t of the motor's current",
    "operator": "the second stop",
    "out of limits": "a row with another unit left its limits",
    "overrun": "late cycles, with policy: trip",
    "position jump": "the position jumps",
    "recorder": "it died, lost samples, or the disk is full",
    "sensor at rest": "a reading of the rig at rest is too far off",
    "stale": "an analog value was not renewed",
    "unreferenced": "travel has no zero",
    "valve": "the set-and-hold of a muscle failed",
    **{cause: f"a row in {unit} left its limits" for unit, cause in OVER_RANGE_CAUSE.items()},
    "over-travel": "a row in m or rad left its limits",
    "over-speed": "a row in m/s or rad/s left its limits",
}
VALVES = {
    ValveState.CLOSED: "both shut, nothing is set",
    ValveState.FILLING: "the inlet is open",
    ValveState.EXHAUSTING: "the exhaust is open, towards a pressure",
    ValveState.SETTLING: "both shut, waiting for the average",
    ValveState.TRIMMING: "single pulses",
    ValveState.HOLDING: "both shut, watched",
    ValveState.VENTING: "the exhaust is open, towards the atmosphere",
    ValveState.VENTED: "at the atmosphere",
    ValveState.FAILED: "it gave up; the run trips",
}
VALVE_CAUSES = {
    ValveCause.NONE: "",
    ValveCause.TIME_OUT: "not there in time",
    ValveCause.OVER_PRESSURE: "above its highest pressure",
    ValveCause.INLET_STUCK_CLOSED: "the inlet is open and nothing rises",
    ValveCause.INLET_STUCK_OPEN: "the pressure rises with both shut",
    ValveCause.EXHAUST_STUCK_CLOSED: "the exhaust is open and nothing falls",
    ValveCause.EXHAUST_STUCK_OPEN: "the pressure falls with both shut",
    ValveCause.SUPPLY_EMPTY: "a fill ends below its target",
    ValveCause.BAD_PRESSURE: "the reading is no number",
}
DRIVE = {
    DriveState.NOT_READY: "it starts up",
    DriveState.SWITCH_ON_DISABLED: "no power, and not asked for",
    DriveState.READY: "no power, asked for",
    DriveState.SWITCHED_ON: "power stage on, no torque",
    DriveState.OPERATION_ENABLED: "under power, it follows its target",
    DriveState.QUICK_STOP_ACTIVE: "it brakes by its own ramp, then holds",
    DriveState.FAULT_REACTION: "it reacts to a fault of its own",
    DriveState.FAULT: "a fault stands; 0x603F says which",
    DriveState.UNKNOWN: "a status word of none of these",
}
EVENTS = {
    "accept": "a pressure was taken as it settled",
    "brake": "a motion brakes for a stop",
    "bus": "a note of the bus: bring-up, closing",
    "calibration_drop": "a point of a calibration was dropped",
    "calibration_point": "a point of a calibration was taken",
    "calibration_skip": "a step of a calibration was left out",
    "category": "the category of a stop",
    "clock": "the distributed clock: lock, jumps, missed cycles",
    "drift": "a held pressure drifts",
    "emergency": "an emergency message of a slave",
    "error": "a failure of bus or program",
    "failed": "a valve's set-and-hold gave up",
    "failure": "why a phase failed",
    "finished": "the last phase is over",
    "gap": "cycles that the loop did not see",
    "hint": "advice to calibrate a sensor",
    "import": "what was done on the way of an import",
    "jog": "what a jog did or did not do",
    "let_down": "a let-down begins, or is refused",
    "mark": "a mark that somebody set from a live view",
    "order": "an order of a jog",
    "phase_end": "a phase ends",
    "phase_start": "a phase begins",
    "realtime": "what the loop could not get of the kernel",
    "recovery": "a slave left operation, or is back",
    "request": "a stop asked for from a live view",
    "sensor": "a sensor at rest that is refused",
    "state": "a state was entered, of the run or of a valve",
    "summary": "counts at the end",
    "switch": "a valve was opened or shut",
    "touch": "homing touched its stop",
    "trip": "a cause was latched",
    "unprotected": "a protection that the rig file leaves out, with its reason",
    "zero": "the zero of travel that the run takes",
}


def page() -> str:
    """docs/states.md as text. Raises KeyError where words and code differ."""
    states = (*supervisor.STATES, *unpowered.STATES)
    causes, events = found()
    _same("states", STATES, states)
    _same("causes", CAUSES, causes)
    _same("events", EVENTS, events)
    _same("outcomes", OUTCOMES, (*OF_OUTCOME, "died"))
    sections = {
        "States of a run": table(
            ("State", "What happens", "Ends when"), [(f"`{s}`", *STATES[s]) for s in states]
        ),
        "Stop categories": table(
            ("Category", "What happens", "When"),
            [(str(number), *words) for number, words in CATEGORIES.items()],
        ),
        "Causes of a trip": table(
            ("Cause", "When", "Found by"), [(c, CAUSES[c], _by(causes[c])) for c in sorted(causes)]
        ),
        "Outcomes": table(
            ("Outcome", "When", "Exit code"),
            [(o, words, str(OF_OUTCOME.get(o, ""))) for o, words in OUTCOMES.items()],
        ),
        "Valves": _enumeration("State", VALVES, ValveState),
        "Why a valve fails": _enumeration("Cause", VALVE_CAUSES, ValveCause),
        "Drive": _enumeration("State (CiA 402)", DRIVE, DriveState),
        "Kinds of events": table(
            ("Kind", "What it says", "Written by"),
            [(f"`{kind}`", EVENTS[kind], _by(events[kind])) for kind in sorted(events)],
        ),
    }
    body = "".join(f"\n## {title}\n\n{text}" for title, text in sections.items())
    return HEAD.format(written=WRITTEN, index=index([list(sections)])) + body


def _enumeration(head: str, words: Mapping[Enum, str], kind: type[Enum]) -> str:
    _same(kind.__name__, words, kind)
    return table((head, "What it means"), [(one.value, words[one]) for one in kind if words[one]])


def _same(what: str, words: object, code: object) -> None:
    differ = set(words) ^ set(code)  # type: ignore[call-overload]
    if differ:
        raise KeyError(f"{what}: {sorted(map(str, differ))} only in the code, or only in the words")


def _by(modules: set[str]) -> str:
    names = sorted(modules)
    return ", ".join(f"`{name}`" for name in names[:2]) + (" and others" if names[2:] else "")


def found() -> tuple[dict[str, set[str]], dict[str, set[str]]]:
    """Causes of trips and kinds of events that statements name, each with its modules."""
    causes: dict[str, set[str]] = defaultdict(set)
    events: dict[str, set[str]] = defaultdict(set)
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*.py")):
            module = str(path.relative_to(ROOT))
            tree = ast.parse(path.read_text(encoding="utf-8"))
            watches = module.startswith(("epa_rt/safety", "epa_rt/loop"))
            named = _NAMED | _constants(tree)
            for node in ast.walk(tree):
                for name in _texts(_causes(node, watches), named):
                    causes[name].add(module)
                for name in _texts(_events(node), named):
                    events[name].add(module)
    for cause in OVER_RANGE_CAUSE.values():
        causes[cause].add("epa_rt/safety/envelope.py")
    causes["out of limits"].add("epa_rt/safety/envelope.py")
    return dict(causes), dict(events)


# constants of other modules that stand for a cause
_NAMED = {
    "CAUSE": "implausible sensor",
    "INTERNAL": "internal error",
    "LET_DOWN": "let-down",
    "LET_DOWN_CAUSE": "let-down",
}


_FAULTS = ("fault", "refusal")  # what is latched as cause, signal, sentence


def _constants(tree: ast.Module) -> dict[str, str]:
    """Texts that the module itself gives a name."""
    return {
        target.id: node.value.value
        for node in tree.body
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Constant)
        for target in node.targets
        if isinstance(target, ast.Name) and isinstance(node.value.value, str)
    }


def _causes(node: ast.AST, watches: bool) -> Iterator[ast.AST]:
    """Of ``envelope.trip(cause, ...)``, ``fault = (cause, ...)``, and in the rooms that watch
    ``return cause, signal, sentence``.
    """
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
        if node.func.attr == "trip" and node.args:
            yield node.args[0]
    elif isinstance(node, ast.Return) and watches and isinstance(node.value, ast.Tuple):
        if len(node.value.elts) == 3:
            yield node.value.elts[0]
    elif isinstance(node, ast.Assign) and ast.unparse(node.targets[0]).endswith(
        ("fault", "refusal")
    ):
        last = node.value.values[-1] if isinstance(node.value, ast.BoolOp) else node.value
        if isinstance(last, ast.Tuple) and len(last.elts) == 3:
            yield last.elts[0]


def _events(node: ast.AST) -> Iterator[ast.AST]:
    """Of ``events.append((kind, ...))``, ``events += [(kind, ...)]``, ``event(.., kind, ..)`` and
    ``requests.say(kind, ...)``.
    """
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
        on = ast.unparse(node.func.value)
        if node.func.attr == "append" and on.endswith(("events", "hints")):
            yield from _first(node.args[0])
        elif node.func.attr == "event" and len(node.args) >= 4:
            yield node.args[2]
        elif node.func.attr == "say" and on.endswith("requests"):
            yield node.args[0]
    elif isinstance(node, (ast.Assign, ast.AugAssign)):
        target = node.targets[0] if isinstance(node, ast.Assign) else node.target
        if ast.unparse(target).removesuffix("[:0]").endswith("events"):
            value = node.value.elt if isinstance(node.value, ast.ListComp) else node.value
            for one in value.elts if isinstance(value, ast.List) else [value]:
                yield from _first(one)


def _first(node: ast.AST) -> Iterator[ast.AST]:
    if isinstance(node, ast.Tuple) and len(node.elts) == 3:
        yield node.elts[0]


def _texts(nodes: Iterator[ast.AST], named: Mapping[str, str]) -> Iterator[str]:
    """Texts that stand there, or that a name stands for."""
    for node in nodes:
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value
        elif isinstance(node, ast.Name) and node.id in named:
            yield named[node.id]
