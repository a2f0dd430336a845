"""How stable the diagnosis is: recordings diagnosed again after changes that must not change the
answer, and the share of answers that stay (epa_rt/benchmark/stability.py says what that is).

Recordings of others come from scripts/known_recordings.yaml and scripts/stability.yaml; --cases
takes folders of sealed cases besides. Every answer is kept as a line of OUT.jsonl, so that an
interrupted run goes on; answers of another engine are asked again. Prints JSON: the share by kind
of change, what was not asked and why, and the answers that did not stay.

  python scripts/stability.py -o out/stability
  python scripts/stability.py -o out/stability --recordings xl330 --kinds guess lowpass
  python scripts/stability.py -o out/stability --recordings --cases out/blind/case_*
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT)]
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # one answer is one process

import yaml

from scripts.known_recordings import at, is_there, known

if TYPE_CHECKING:
    from epa_rt.benchmark.stability import Answer
    from epa_rt.logs.importers.gather import Gathered

LIST = Path(__file__).with_suffix(".yaml")
KINDS = ("guess", "lowpass", "trials", "logs", "noise", "units", "order", "seed")
AS_GIVEN = "as given"
SEED = 1  # any other than the diagnosis' own, 0
WORTH = 1.2  # by less a low-pass is not called another
HOUSE_LOG = "a log of this house stands in raw bytes, which are not rewritten"
ONE_LOG = "there is one log"


class SkippedError(Exception):
    """Why a change is not asked."""


@dataclass(frozen=True)
class Imported:
    """A recording of others before it is written as a log."""

    name: str
    mapping: Path
    files: tuple[Path, ...]
    log: Gathered


@dataclass(frozen=True)
class Asked:
    """What the diagnosis is asked. Of a recording of others the logs stand under ``fit`` and
    ``held`` and are written when it is asked; of a sealed case they are ``logs`` and ``holdout``.
    """

    rig: Path
    plant: Path
    fit: tuple[Imported, ...] = ()
    held: tuple[Imported, ...] = ()
    logs: tuple[Path, ...] = ()
    holdout: tuple[Path, ...] = ()
    leave_out: tuple[str, ...] = ()
    seed: int = 0


Change = tuple[str, str, Callable[[Path], Asked]]  # kind, name, and what is asked with it


def main() -> int:
    arguments = _arguments()
    kept = arguments.out.with_suffix(".jsonl")
    kept.parent.mkdir(parents=True, exist_ok=True)
    answers = Kept(kept, engine())
    code = 0
    try:
        cases = list(_cases(arguments))
        for kind in arguments.kinds:  # of all recordings first: a table is worth reading early
            for name, asked in cases:
                _ask_all(name, asked, kind, answers)
    except KeyboardInterrupt:
        print("stability: interrupted; the same command goes on", file=sys.stderr)
        code = 130
    print(json.dumps(_summary(answers), indent=1))
    return code


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("-o", "--out", type=Path, required=True, help="answers go to OUT.jsonl")
    parser.add_argument(
        "--recordings",
        nargs="*",
        metavar="NAME",
        help="only these, none where no name follows (default: all that are there)",
    )
    parser.add_argument("--cases", nargs="*", type=Path, default=[], metavar="DIR")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=KINDS, metavar="KIND")
    return parser.parse_args()


class Kept:
    """Lines of answers, one as soon as it is there."""

    def __init__(self, path: Path, engine: str) -> None:
        self._path, self._engine = path, engine
        self.lines: dict[tuple[str, str], dict[str, Any]] = {}
        if path.exists():
            for line in path.read_text(encoding="utf-8").splitlines():
                self._read(line)

    def _read(self, line: str) -> None:
        try:
            found = json.loads(line)
        except ValueError:  # cut off where the disk was full or the machine went down
            return
        if found["engine"] == self._engine:
            self.lines[found["recording"], found["change"]] = found

    def add(self, recording: str, kind: str, change: str, said: dict[str, Any]) -> None:
        """Keeps one answer, or why there is none."""
        line = {"recording": recording, "kind": kind, "change": change, **said}
        self.lines[recording, change] = line
        with self._path.open("a", encoding="utf-8") as file:
            file.write(f"\n{json.dumps({**line, 'engine': self._engine})}")


def engine() -> str:
    """Digest of all code that an answer comes from."""
    digest = hashlib.sha256()
    for room in ("gap", "models", "logs/importers"):
        for path in sorted((ROOT / "epa_rt" / room).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def _cases(arguments: argparse.Namespace) -> Iterator[tuple[str, Asked]]:
    for name, entry in entries_of("stability", arguments.recordings).items():
        yield name, opened_entry(entry)
    for folder in arguments.cases:
        told = json.loads((folder / "case.json").read_text(encoding="utf-8"))
        yield (
            f"{folder.parent.name}/{folder.name}",
            Asked(
                folder / told["rig"],
                folder / told["plant"],
                logs=tuple(folder / log for log in told["logs"]),
                holdout=tuple(folder / log for log in told["holdout"]),
                leave_out=tuple(told["leave_out"]),
            ),
        )


def entries_of(script: str, names: Sequence[str] | None) -> dict[str, dict[str, Any]]:
    """The listed recordings of these names (None: all) whose files are there. Raises SystemExit for
    any other name.
    """
    there = {one["name"]: one for one in [*known(), *_further()["recordings"]] if is_there(one)}
    for name in names or ():
        if name not in there:
            raise SystemExit(
                f"{script}: found no recording '{name}', expected one of"
                f" {', '.join(there) or 'those beside the repository, and none is there'}"
            )
    return there if names is None else {name: there[name] for name in names}


def _further() -> dict[str, Any]:
    found: dict[str, Any] = yaml.safe_load(LIST.read_text(encoding="utf-8"))
    return found


def opened_entry(entry: dict[str, Any]) -> Asked:
    """What is asked of a listed recording as it is."""
    rig = at(entry["rig"])
    plant = rig.parent / yaml.safe_load(rig.read_text(encoding="utf-8"))["plant"]
    return Asked(rig, plant, _gathered(entry["logs"]), _gathered(entry.get("holdout", {})))


def _gathered(by_mapping: dict[str, list[Any]]) -> tuple[Imported, ...]:
    from epa_rt.logs.importers.gather import gather
    from epa_rt.logs.importers.mapping import load_mapping

    found = []
    for mapping, logs in by_mapping.items():
        typed, located = load_mapping(at(mapping))
        for one in logs:
            files = tuple(at(name) for name in (one if isinstance(one, list) else [one]))
            name = files[0].stem if len(files) == 1 else files[0].parent.name
            found.append(Imported(name, at(mapping), files, gather(typed, located, files)))
    return tuple(found)


def _ask_all(name: str, asked: Asked, kind: str, answers: Kept) -> None:
    """Asks a recording as it is, and with each change of a kind that was not asked yet."""
    with tempfile.TemporaryDirectory(prefix="stability-") as scratch:
        changes = [(AS_GIVEN, AS_GIVEN, lambda folder: asked)]
        if kind == "guess":
            changes += _guesses(asked, Path(scratch))
        changes += [one for one in _changes(name, asked) if one[0] == kind]
        for place, (of, change, made) in enumerate(changes):
            if (name, change) in answers.lines:
                continue
            begun = time.process_time()
            folder = Path(scratch) / f"change_{place}"
            folder.mkdir()
            try:
                said: dict[str, Any] = {"answer": answered(made(folder), folder).as_json()}
            except SkippedError as reason:
                said = {"skipped": str(reason)}
            said["cpu_seconds"] = round(time.process_time() - begun, 1)
            answers.add(name, of, change, said)
            first = said["answer"]["first"] if "answer" in said else f"not asked: {said['skipped']}"
            print(
                f"{name}, {change}: {first} ({said['cpu_seconds']} s of CPU)",
                file=sys.stderr,
                flush=True,
            )


def answered(asked: Asked, folder: Path) -> Answer:
    """The diagnosis of what the command line would read, without its way to the report."""
    from epa_rt.benchmark.stability import REFUSED, Answer, answer_of
    from epa_rt.cli.exits import VerbError
    from epa_rt.cli.gap.fits import check_judged
    from epa_rt.cli.gap.inputs import opened
    from epa_rt.config.source import ConfigError
    from epa_rt.gap.diagnose import diagnose

    logs = [*asked.logs, *(_written(one, folder / "logs") for one in asked.fit)]
    holdout = [*asked.holdout, *(_written(one, folder / "held") for one in asked.held)]
    try:
        given = opened(argparse.Namespace(rig=asked.rig, plant=asked.plant, logs=logs), holdout)
        found = diagnose(
            given.subject,
            given.recordings,
            given.holdout,
            without=asked.leave_out,
            seed=asked.seed,
            how_far=False,
        )
        check_judged(found.location, given.subject)
    except (VerbError, ConfigError) as error:
        return Answer(REFUSED, says=str(error))
    return answer_of(found, {one.name: one.family for one in given.subject.catalogue})


def _written(one: Imported, folder: Path) -> Path:
    from epa_rt.logs.importers.mapping import load_mapping
    from epa_rt.logs.importers.write import attachments_of, write_log

    path = folder / f"{one.name}.mcap"
    typed, located = load_mapping(one.mapping)
    write_log(path, typed, one.log, attachments_of(typed, located, one.files), one.files)
    return path


def _changes(name: str, asked: Asked) -> list[Change]:
    """All changes but those of guesses; one that cannot be made says so when it is asked."""
    return [
        ("lowpass", "low-pass halved", lambda folder: _filtered(asked, folder, 0.5)),
        ("lowpass", "low-pass doubled", lambda folder: _filtered(asked, folder, 2.0)),
        ("trials", "a log split in two", lambda folder: _split(asked)),
        ("trials", "logs as trials of one", lambda folder: _as_trials(asked)),
        ("logs", "first log dropped", lambda folder: _dropped(asked, 0)),
        ("logs", "last log dropped", lambda folder: _dropped(asked, -1)),
        ("logs", "a log added", lambda folder: _added(name, asked)),
        ("logs", "held-out logs fitted", lambda folder: _fitted_too(asked)),
        ("noise", "noise added anew", lambda folder: _noisier(asked)),
        ("units", "other units", lambda folder: _other_units(asked, folder)),
        ("order", "logs in reverse", lambda folder: _reversed(asked)),
        ("seed", f"seed {SEED}", lambda folder: replace(asked, seed=SEED)),
    ]


def _guesses(asked: Asked, scratch: Path) -> list[Change]:
    """A plant file for each nominal guess that is moved."""
    from epa_rt.benchmark.stability import moved_guesses
    from epa_rt.cli.exits import VerbError
    from epa_rt.cli.gap.inputs import opened

    logs = [*asked.logs, *(_written(one, scratch / "guess") for one in asked.fit)]
    try:
        given = opened(argparse.Namespace(rig=asked.rig, plant=asked.plant, logs=logs))
    except VerbError:
        return []
    found: list[Change] = []
    for place, (key, value) in enumerate(moved_guesses(given.subject, given.recordings)):
        path = scratch / f"plant_{place}.yaml"
        path.write_text(given.subject.patched({key: value}, ()), encoding="utf-8")
        unit = given.subject.knobs[key].unit
        found.append(
            ("guess", f"{key} {value:.4g} {unit}", lambda _, p=path: replace(asked, plant=p))
        )
    return found


def _rig_text(asked: Asked) -> dict[str, Any]:
    if not asked.fit:
        raise SkippedError("a rig of this house has no low-pass in its file")
    text: dict[str, Any] = yaml.safe_load(asked.rig.read_text(encoding="utf-8"))
    return text


def _filtered(asked: Asked, folder: Path, factor: float) -> Asked:
    """Another low-pass. It may be half the rate at most: the rate goes with it where the logs have
    as much.
    """
    from epa_rt.config.units import parse_quantity

    text = _rig_text(asked)
    rate, lowpass = (parse_quantity(text[key], "Hz") for key in ("rate", "lowpass"))
    recorded = min(1.0 / one.log.grid.period_s for one in asked.fit)
    if 2.0 * factor * lowpass > rate:  # a whole part of the logs' own rate
        rate = max(rate, recorded / max(1, int(recorded / (2.0 * factor * lowpass) + 1e-9)))
    new = min(factor * lowpass, 0.5 * rate)
    if factor > 1.0 and new < WORTH * lowpass:
        raise SkippedError("the low-pass is at half the logs' own rate")
    text |= {"lowpass": f"{new:g} Hz", "rate": f"{rate!r} Hz", "plant": str(asked.plant)}
    rig = folder / "rig.yaml"
    rig.write_text(yaml.safe_dump(text, sort_keys=False), encoding="utf-8")
    return replace(asked, rig=rig)


def _reversed(asked: Asked) -> Asked:
    if len(asked.fit) + len(asked.logs) < 2:
        raise SkippedError(ONE_LOG)
    return replace(asked, fit=asked.fit[::-1], logs=asked.logs[::-1])


def _dropped(asked: Asked, place: int) -> Asked:
    if len(asked.fit) + len(asked.logs) < 2:
        raise SkippedError(ONE_LOG)
    fit, logs = list(asked.fit), list(asked.logs)
    (fit or logs).pop(place)
    return replace(asked, fit=tuple(fit), logs=tuple(logs))


def _added(name: str, asked: Asked) -> Asked:
    more = _further()["more"].get(name)
    if more is None:
        raise SkippedError("no further log of this rig is listed")
    return replace(asked, fit=(*asked.fit, *_gathered(more)))


def _fitted_too(asked: Asked) -> Asked:
    if not (asked.held or asked.holdout):
        raise SkippedError("no log is held out")
    return replace(
        asked,
        fit=(*asked.fit, *asked.held),
        logs=(*asked.logs, *asked.holdout),
        held=(),
        holdout=(),
    )


def _split(asked: Asked) -> Asked:
    from epa_rt.benchmark.stability import halves

    first = _first(asked)
    watched = [one for one in _rig_text(asked)["channels"].values() if one in first.log.measured]
    parts = halves(first.log, watched)
    two = tuple(replace(first, name=f"{first.name}_{i}", log=log) for i, log in enumerate(parts, 1))
    return replace(asked, fit=(*two, *asked.fit[1:]))


def _as_trials(asked: Asked) -> Asked:
    from epa_rt.benchmark.stability import joined

    first = _first(asked)
    if len(asked.fit) < 2:
        raise SkippedError(ONE_LOG)
    whole = joined([one.log for one in asked.fit])
    return replace(asked, fit=(replace(first, name="together", log=whole),))


def _noisier(asked: Asked) -> Asked:
    from epa_rt.benchmark.stability import noisy

    _first(asked)
    used = [one for one in _rig_text(asked)["channels"].values()]

    def again(one: Imported, place: int) -> Imported:
        log = one.log
        for name in (name for name in used if name in log.measured):
            log = noisy(log, name, SEED + place)
        return replace(one, log=log)

    return replace(asked, fit=tuple(again(one, i) for i, one in enumerate(asked.fit)))


def _other_units(asked: Asked, folder: Path) -> Asked:
    """The same recordings as CSV files in other units, and mappings that say so."""
    from epa_rt.benchmark.stability import in_other_units
    from epa_rt.logs.importers.gather import gather
    from epa_rt.logs.importers.mapping import load_mapping

    _first(asked)
    used = list(_rig_text(asked)["channels"].values())

    def again(one: Imported, place: str) -> Imported:
        names = [name for name in used if name in one.log.measured | one.log.commands]
        table, units = in_other_units(one.log, names)
        csv, mapping = folder / f"{one.name}_{place}.csv", folder / f"{one.name}_{place}.yaml"
        csv.write_text(table, encoding="utf-8")
        typed, _ = load_mapping(one.mapping)
        signals = {name: {"column": name, "unit": units[name]} for name in names}
        period = one.log.grid.period_s
        text = {
            "mapping": typed.mapping,
            "rig": typed.rig,
            "experiment": typed.experiment,
            "format": {"kind": "csv"},
            "clock": {"column": "t", "unit": "ms", "period": f"{period!r} s"},
            "measured": {name: signals[name] for name in names if name in one.log.measured},
            "commands": {name: signals[name] for name in names if name in one.log.commands},
            "trials": {"column": "trial"},
        }
        mapping.write_text(
            yaml.safe_dump({key: part for key, part in text.items() if part}), encoding="utf-8"
        )
        return Imported(one.name, mapping, (csv,), gather(*load_mapping(mapping), [csv]))

    return replace(
        asked,
        fit=tuple(again(one, f"fit_{i}") for i, one in enumerate(asked.fit)),
        held=tuple(again(one, f"held_{i}") for i, one in enumerate(asked.held)),
    )


def _first(asked: Asked) -> Imported:
    if not asked.fit:
        raise SkippedError(HOUSE_LOG)
    return asked.fit[0]


def _summary(answers: Kept) -> dict[str, Any]:
    """Figures of all answers that are kept, of this engine."""
    from epa_rt.benchmark.stability import REFUSED, answer_from, figures

    given = {
        name: answer_from(line["answer"])
        for (name, change), line in answers.lines.items()
        if change == AS_GIVEN
    }
    refused = {name: one.says for name, one in given.items() if one.first == REFUSED}
    found = figures(
        (name, line["kind"], change, given[name], answer_from(line["answer"]))
        for (name, change), line in answers.lines.items()
        if change != AS_GIVEN and "answer" in line and name in given and name not in refused
    )
    skipped = Counter(
        f"{line['change']}: {line['skipped']}"
        for line in answers.lines.values()
        if "skipped" in line
    )
    return {
        "recordings": len(given) - len(refused),
        "refused_as_given": refused,
        "not_asked": dict(skipped),
        **found,
    }


if __name__ == "__main__":
    sys.exit(main())
