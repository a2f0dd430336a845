"""Re-run controllers, valves and envelope over a log's recorded inputs and compare every output
byte.

The log alone is enough: rig and experiment are in it. A log of an older version of the code shows
what that code did otherwise; a log that was cut is compared up to its last whole chunk, and ends
with exit code 1.

  epa replay out/*.mcap
"""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.damage import say_damage
from epa_rt.cli.exits import BAD_INPUT, COMPLETED, DIFFERENT, VerbError
from epa_rt.cli.inputs import EXPERIMENT, inputs_of_log
from epa_rt.cli.screen_text import filled

if TYPE_CHECKING:
    from epa_rt.logs.replay import Comparison
    from epa_rt.loop.assembly import Assembly


def add_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument(
        "logs", nargs="+", type=Path, metavar="LOG", help="MCAP logs that epa run wrote"
    )


def main(arguments: argparse.Namespace) -> int:
    from epa_rt.config.source import ConfigError
    from epa_rt.loop.assembly import WiringError

    worst = COMPLETED
    for path in arguments.logs:
        try:
            worst = max(worst, replay_log(path))
        except (VerbError, ConfigError) as error:
            print(filled(f"epa replay: {error}", sys.stderr), file=sys.stderr)
            worst = BAD_INPUT
        except WiringError as error:
            print(filled(f"epa replay: {path}: {error}", sys.stderr), file=sys.stderr)
            worst = BAD_INPUT
    return worst


def replay_log(path: Path) -> int:
    """Replays one log and prints one or two sentences; COMPLETED or DIFFERENT. Raises VerbError,
    ConfigError.
    """
    from epa_rt.logs.reader import LogError, LogReader
    from epa_rt.logs.replay import Comparison, RecordedRequests, ReplayBackend, recorded_cycles
    from epa_rt.loop.assembly import assemble
    from epa_rt.loop.run import run
    from epa_rt.realtime.process import undisturbed

    try:
        reader = LogReader(path)
        cycles = recorded_cycles(reader)
    except LogError as error:
        raise VerbError(str(error)) from None
    if not len(cycles):
        why = "".join(f" ({sentence})" for sentence in reader.missing[:1])
        raise VerbError(f"{path}: found no cycle{why}, expected a log with at least one")
    if cycles.cycle != list(range(len(cycles))):
        why = "".join(f" ({sentence})" for sentence in reader.missing[:1])
        raise VerbError(
            f"{path}: found cycles missing in the middle{why}, expected every cycle from 0 on"
        )
    if EXPERIMENT not in reader.attachments:
        raise VerbError(
            f"{path}: found no {EXPERIMENT} in it, expected a log of epa run; what was moved by"
            " hand (jog, home, calibrate) or imported cannot be run again"
        )
    inputs = inputs_of_log(path, reader.attachments)
    assembly = assemble(inputs.rig, inputs.experiment)
    comparison = Comparison(cycles)
    simulated = reader.metadata.get("run", {}).get("backend") == "sim"
    with undisturbed(None):
        run(
            assembly.rig,
            ReplayBackend(cycles, assembly.rig.period_s, simulated),
            assembly.supervisor,
            assembly.envelope,
            assembly.decoder,
            assembly.encoder,
            comparison,
            RecordedRequests(cycles),
        )
    code = say_damage(path, reader.missing)
    print(filled(f"{path}: {verdict(comparison, len(cycles), assembly)}"))
    same = comparison.first is None and comparison.compared == len(cycles)
    return code if same else DIFFERENT


def verdict(comparison: "Comparison", recorded: int, assembly: "Assembly") -> str:
    """The comparison in words, with the first entry that differs and both its values."""
    if comparison.first is None:
        if comparison.compared != recorded:
            return f"the replay ended after {comparison.compared} cycles, the log has {recorded}"
        return f"{recorded} cycles, every output byte identical"
    cycle, before, now = comparison.first
    changed = ", ".join(
        f"{name} {old!r} -> {new!r}" for name, old, new in changed_entries(assembly, before, now)
    )
    return (
        f"{comparison.different} of {comparison.compared} cycles differ, the first is cycle"
        f" {cycle}: {changed or 'same bytes, other state or flags'} (recorded -> replayed, counts)"
    )


def changed_entries(assembly: "Assembly", before: bytes, now: bytes) -> list[tuple[str, int, int]]:
    """(entry, recorded counts, replayed counts) of every output entry that differs."""
    from epa_rt.signals.image import image_of

    changed = []
    for key, place in image_of(assembly.rig, outputs=True).places.items():
        values = []
        for raw in (before, now):
            if place.entry.code == "?":
                values.append(raw[place.byte] >> place.bit & 1)
            else:
                signed = place.entry.code.islower()
                values.append(
                    int.from_bytes(
                        raw[place.byte : place.byte + place.entry.bits // 8],
                        "little",
                        signed=signed,
                    )
                )
        if values[0] != values[1]:
            changed.append((key, values[0], values[1]))
    return changed
