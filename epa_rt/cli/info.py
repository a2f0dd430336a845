"""Say in a few lines what a log holds: outcome, cause, duration, topics, attachments, and what is
missing.

  epa info out/*.mcap
  epa info out/knee_chirp-knee-001.mcap --events     every event
  epa info out/knee_chirp-knee-001.mcap --check      compare every checksum, exit 1 on damage
"""

import argparse
import json
import math
import sys
from pathlib import Path
from typing import Any

from epa_rt.cli.damage import NOT_WHOLE
from epa_rt.cli.exits import BAD_INPUT, COMPLETED, DIFFERENT
from epa_rt.cli.outputs import add_json_argument, is_screen
from epa_rt.cli.screen_text import filled
from epa_rt.cli.write import check_writable, write_whole


def add_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("logs", nargs="+", type=Path, metavar="LOG", help="logs of runs (*.mcap)")
    verb.add_argument("--events", action="store_true", help="list every event")
    verb.add_argument(
        "--check",
        action="store_true",
        help="compare every checksum, and exit 1 where the log is not whole (takes as long as"
        " reading the file)",
    )
    add_json_argument(verb, "for machines, a list with one object for each log")


def main(arguments: argparse.Namespace) -> int:
    from epa_rt.logs.reader import LogError

    check_writable(arguments.json, (".json",))
    found, broken = [], 0
    for path in arguments.logs:
        try:
            found.append(facts_of(path, arguments.events, arguments.check))
        except LogError as error:
            broken += 1
            print(filled(f"epa info: {error}", sys.stderr), file=sys.stderr)
    if arguments.json:
        write_whole(arguments.json, json.dumps(found, indent=2) + "\n")
    if not is_screen(arguments.json):
        text = "\n\n".join(text_of(facts) for facts in found)
        print(filled(text), end="\n" if found else "")
    if broken:
        return BAD_INPUT
    return DIFFERENT if arguments.check and any(facts["missing"] for facts in found) else COMPLETED


def facts_of(path: Path, with_events: bool = False, check: bool = False) -> dict[str, Any]:
    """What a log says of itself; times in s. Raises LogError where it is none."""
    from epa_rt.logs.reader import LogReader

    with LogReader(path) as log:
        check = check or not log.has_end
        events, late = log.events(), int(log.timing()["overruns"].sum())
        topics = log.counts()
        missing = log.missing if check else log.missing_at_a_glance
        run, summary = (
            log.metadata.get("run", {}),
            next((e.data for e in reversed(events) if e.kind == "summary"), {}),
        )
        trips = [event for event in events if event.kind == "trip"]
        ending = log.ending
        outcome = (
            (ending.outcome, ending.cause)
            if ending
            else ("tripped", trips[0].text)
            if trips
            else ("still being recorded" if log.is_being_recorded else "unknown", "")
        )
        facts = {
            "log": str(path),
            "size_bytes": path.stat().st_size,
            "outcome": outcome[0],
            "cause": outcome[1],
            "cycles": topics.get("/cycle", 0),
            "duration_s": _duration_s(log, topics, run),
            **{
                key: run.get(key)
                for key in ("experiment", "rig", "plant", "backend", "seed", "speed", "period_s")
            },
            "queue": log.metadata.get("queue"),
            "goes_on_from": _earlier(log.attachments),
            "overruns": summary.get("overruns", late),
            "trips": [event.text for event in trips],
            "topics": topics,
            "whole": not missing,
            "checked": check,
            "record": _record(log.attachments),
            "attachments": {name: len(data) for name, data in log.attachments.items()},
            "missing": missing,
        }
        if with_events:
            facts["events"] = [
                {"t_s": event.t_ns / 1e9}
                | {key: getattr(event, key) for key in ("cycle", "kind", "text", "data")}
                for event in events
            ]
        return facts


def _earlier(attachments: dict[str, bytes]) -> list[str]:
    """Names of the broken-off logs that this one goes on from."""
    from epa_rt.runs.resume import ATTACHMENT, earlier_logs

    if ATTACHMENT not in attachments:
        return []
    try:
        return [one.name for one in earlier_logs(attachments[ATTACHMENT])]
    except ValueError as error:
        return [str(error)]


def _record(attachments: dict[str, bytes]) -> dict[str, Any] | None:
    """Who ran what, when, with which code; None where the log does not say it."""
    from epa_rt.logs.run_record import record_of

    record = record_of(attachments)
    return record and {**vars(record), "muscles": dict(record.muscles), "notes": list(record.notes)}


def text_of(facts: dict[str, Any]) -> str:
    """The same for a person."""
    outcome = f"{facts['outcome']}{': ' + facts['cause'] if facts['cause'] else ''}"
    asked = f"{facts['experiment'] or 'not recorded'} on the rig {facts['rig'] or 'not recorded'}"
    lasted = (
        f"{facts['duration_s']:.3f} s, {facts['cycles']} cycles, {facts['overruns']} late cycles"
    )
    pairs = [
        ("outcome", outcome),
        ("experiment", asked),
        ("backend", _backend(facts)),
        ("duration", lasted),
    ]
    pairs += [("goes on", f"from {name}") for name in facts["goes_on_from"]]
    if queue := facts["queue"]:
        notes = f" ({queue['notes']})" if queue.get("notes") else ""
        pairs.append(("queue", f"{queue.get('id', 'without id')}{notes}"))
    pairs += _who(facts["record"]) if facts["record"] else []
    pairs += [("trip", text) for text in facts["trips"] if text not in outcome]
    pairs.append(
        ("topics", ", ".join(f"{name} {count}" for name, count in facts["topics"].items()))
    )
    pairs.append(
        (
            "attached",
            ", ".join(f"{name} ({size} bytes)" for name, size in facts["attachments"].items())
            or "nothing",
        )
    )
    sound = (
        "nothing, every checksum compared"
        if facts["checked"]
        else "nothing (the file ends as it should; --check compares checksums)"
    )
    lacks = [f"{NOT_WHOLE}: {sentence}" for sentence in facts["missing"]]
    pairs += [("missing", sentence) for sentence in lacks or [sound]]
    lines = [
        f"{facts['log']} ({facts['size_bytes'] / 1e6:.1f} MB)",
        *(f"  {name:<11}{value}" for name, value in pairs),
    ]
    lines += [
        f"  {e['t_s']:>10.3f} s  {e['cycle']:>9}  {e['kind']:<12} {e['text']}"
        for e in facts.get("events", ())
    ]
    return "\n".join(line.translate(_CONTROL) for line in lines)


def _who(record: dict[str, Any]) -> list[tuple[str, str]]:
    changed = " with changes" if record["changed"] else ""
    pairs = [
        ("run by", " ".join(filter(None, (record["operator"], record["started"])))),
        ("serial", record["rig_serial"]),
        *(("muscle", f"{name}: {words}") for name, words in record["muscles"].items()),
        *(("note", note) for note in record["notes"]),
        ("code", f"{record['commit'][:12]}{changed}" if record["commit"] else ""),
    ]
    return [(name, text) for name, text in pairs if text]


_CONTROL = dict.fromkeys(
    (*range(0x20), *range(0x7F, 0xA0)), "?"
)  # a log's text must not steer the terminal


def _backend(facts: dict[str, Any]) -> str:
    speed = {None: "", "unpaced": ", as fast as it goes"}.get(
        facts["speed"], f", at {facts['speed']} x real time"
    )
    plant = f", plant {facts['plant']}, seed {facts['seed']}" if facts["plant"] else ""
    return f"{facts['backend'] or 'not recorded'}{plant}{speed}"


def _duration_s(log: Any, topics: dict[str, int], run: dict[str, str]) -> float:
    try:
        period_s = float(run.get("period_s", "nan"))
    except ValueError:
        period_s = math.nan
    if 0.0 < period_s < math.inf:
        return topics.get("/cycle", 0) * period_s
    t_ns = log.columns("/cycle", ["t_ns"])["t_ns"]
    return (int(t_ns[-1]) - int(t_ns[0])) / 1e9 if len(t_ns) else 0.0
