"""Calibrate the numbers of the diagnosis' posterior on sealed cases, and write them down.

Every case is searched for models once, by processes that do not see the truth; what they find is
kept in OUT, so that an interrupted run goes on. Then the truth is opened, and the numbers are those
that give it the highest log score. Prints JSON: scores before and after, scores of cases that the
numbers were not calibrated on, and how often a name of a given probability is right.

With --withhold each effect that a case has alone is then left out of the catalogue, and the case
searched once more: how well wrong laws do, singly and in pairs, is known from no other. Each kind
of case is weighed so that it has the share that a draw gives it.

With --recordings recordings of others count as well of which it is known what is missing
(scripts/known_recordings.yaml): what right and wrong laws leave of a real gap no simulation tells.

  epa gap blind make --seed 7 --cases 40 -o out/cases
  python scripts/calibrate_posterior.py out/cases -o out/tables            what it would give
  python scripts/calibrate_posterior.py out/cases -o out/tables --withhold --recordings --write
                                                                           and takes it
"""

from __future__ import annotations

import argparse
import json
import pickle
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from epa_rt.benchmark.calibrate import Example

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT)]
MODULE = ROOT / "epa_rt/gap/posterior/calibrated.py"
ENDS = (".pickle", ".error")  # of what is known of a case
RECORDINGS = "recordings"  # folder of what is found in recordings of others
WITHHELD = ".withheld"  # ends the name of a case that is searched without its effect


def main() -> int:
    arguments = _arguments()
    if arguments.one:
        return _search(*arguments.cases, arguments.out, arguments.leave_out)
    recordings = _recordings(arguments.out / RECORDINGS) if arguments.recordings else []
    arguments.out.mkdir(parents=True, exist_ok=True)
    for cases in arguments.cases:
        _search_all(cases, arguments.out / cases.name, arguments.jobs)
        if arguments.withhold:
            _search_all(cases, arguments.out / cases.name, arguments.jobs, _withheld(cases))
    answer, numbers = _calibrate(arguments.cases, arguments.out, recordings)
    if arguments.write:
        MODULE.write_text(_module(numbers, answer), encoding="utf-8")
        subprocess.run([sys.executable, "-m", "ruff", "format", "-q", str(MODULE)], check=True)
    print(json.dumps(answer, indent=1))
    return 0


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("cases", nargs="+", type=Path, help="folders of sealed cases")
    parser.add_argument("-o", "--out", type=Path, required=True, help="folder of what is found")
    parser.add_argument("--jobs", type=int, default=2, help="processes at once (default: 2)")
    parser.add_argument("--write", action="store_true", help=f"write {MODULE.name}")
    parser.add_argument("--withhold", action="store_true", help="each single once more without it")
    parser.add_argument("--recordings", action="store_true", help="and recordings of others")
    parser.add_argument("--leave-out", nargs="*", default=None, help=argparse.SUPPRESS)
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    return parser.parse_args()


def _withheld(cases: Path) -> dict[str, list[str]]:
    """Case to the families of its one effect, of those in which it is as strong as a draw has them
    that are withheld.
    """
    from sim_backend.stand_in.draw import MULTIPLES

    return {
        one["case"]: one["effects"][0]["families"]
        for one in _truth(cases)["cases"]
        if one["kind"] in ("single", "same_law")
        and one["effects"][0]["multiple"] >= MULTIPLES["withheld"][0]
    }


def _truth(cases: Path) -> dict:
    from epa_rt.benchmark.seal import opened

    return opened(cases.with_name(f"{cases.name}.sealed"), cases)


def _search_all(
    cases: Path, out: Path, jobs: int, without: dict[str, list[str]] | None = None
) -> None:
    """Searches what was not searched yet: all cases, or those of ``without`` without these."""
    from epa_rt.benchmark.kept import telling
    from epa_rt.benchmark.seal import NOT_HIDDEN, can_hide, hidden_command

    out.mkdir(exist_ok=True)
    waiting = [
        case
        for case in sorted(cases.glob("case_*"))
        if without is None or case.name in without
        if not any((out / f"{_named(case, without)}{end}").exists() for end in ENDS)
    ]
    hidden = telling(cases.with_name(f"{cases.name}.sealed"), out) if can_hide() else []
    if not hidden:
        print(NOT_HIDDEN, file=sys.stderr)
    running: list[subprocess.Popen[bytes]] = []
    done, of, began_s = 0, len(waiting), time.monotonic()
    while waiting or running:
        while waiting and len(running) < jobs:
            case = waiting.pop(0)
            words = [sys.executable, __file__, str(case), "-o", str(out), "--one"]
            if without is not None:
                words += ["--leave-out", *without[case.name]]
            command = hidden_command(hidden, words) if hidden else words
            running.append(subprocess.Popen(command, stdout=subprocess.DEVNULL))
        time.sleep(0.5)
        still = [process for process in running if process.poll() is None]
        if len(still) < len(running):
            done += len(running) - len(still)
            print(f"{done} of {of}, {time.monotonic() - began_s:.0f} s", file=sys.stderr)
        running = still


def _named(case: Path, without: object) -> str:
    return case.name if without is None else f"{case.name}{WITHHELD}"


def _search(case: Path, out: Path, without: list[str] | None) -> int:
    """All models of one case, kept; the reason where its logs are refused. ``without``: families
    that are withheld from it.
    """
    from epa_rt.cli.exits import VerbError
    from epa_rt.cli.gap.diagnose import table_of_logs

    name = _named(case, without)
    told = json.loads((case / "case.json").read_text(encoding="utf-8"))
    logs, holdout = ([case / name for name in told[kind]] for kind in ("logs", "holdout"))
    try:
        began_s = time.process_time()
        table = table_of_logs(
            case / told["rig"],
            case / told["plant"],
            logs,
            holdout,
            (*told["leave_out"], *(without or ())),
        )
        found = {"table": table, "cpu_s": time.process_time() - began_s}
    except VerbError as error:
        (out / f"{name}.error").write_text(str(error), encoding="utf-8")
        return 0
    (out / f"{name}.part").write_bytes(pickle.dumps(found))
    (out / f"{name}.part").rename(out / f"{name}.pickle")
    return 0


def _recordings(out: Path) -> list[Example]:
    """Recordings of others with what they have, each searched once."""
    from epa_rt.benchmark.calibrate import Example
    from epa_rt.cli.gap.diagnose import table_of_logs
    from scripts.known_recordings import known, logs_of, truth_of

    out.mkdir(parents=True, exist_ok=True)
    found = []
    for entry in known():
        kept = out / f"{entry['name']}.pickle"
        if not kept.exists():
            print(entry["name"], file=sys.stderr)
            with tempfile.TemporaryDirectory(prefix="known-") as folder:
                rig, logs, holdout = logs_of(entry, Path(folder))
                table = table_of_logs(rig, None, logs, holdout)
            kept.write_bytes(pickle.dumps(table))
        found.append(Example(entry["name"], pickle.loads(kept.read_bytes()), truth_of(entry)))
    return found


def _calibrate(
    folders: list[Path], out: Path, recordings: list[Example]
) -> tuple[dict[str, object], object]:
    import numpy as np

    from epa_rt.benchmark.calibrate import (
        Example,
        as_drawn,
        calibrated,
        left_out,
        log_score,
        mean_log,
        of_links_alone,
        of_names,
        probabilities,
    )
    from epa_rt.gap.posterior.evidence import START
    from sim_backend.stand_in.draw import SHARES

    examples, seconds, seeds = [], [], []
    for cases in folders:
        sealed = _truth(cases)
        truth = {one["case"]: one for one in sealed["cases"]}
        seeds.append(sealed["seed"])
        for path in sorted((out / cases.name).glob("*.pickle")):
            found = pickle.loads(path.read_bytes())
            told = truth[path.stem.removesuffix(WITHHELD)]
            if path.stem.endswith(WITHHELD):
                told = {**told, "kind": "withheld"}
            examples.append(Example(f"{cases.name}/{path.stem}", found["table"], told))
            seconds.append(found["cpu_s"])
    examples = [*as_drawn(examples, SHARES), *recordings]
    numbers = calibrated(examples, START)
    others = left_out(examples, START)
    before, after = probabilities(examples, START), probabilities(examples, numbers)
    answer = {
        "cases": sum(not one.name.endswith(WITHHELD) for one in examples) - len(recordings),
        "recordings": len(recordings),
        "withheld_again": sum(one.name.endswith(WITHHELD) for one in examples),
        "seeds": seeds,
        "cpu_s_median": round(float(np.median(seconds)), 1),
        "log_score": {
            "start": log_score(examples, START),
            "calibrated": log_score(examples, numbers),
            "on_cases_left_out": mean_log(examples, others),
            "of_links_alone": log_score([of_links_alone(one) for one in examples], numbers),
            "of_recordings": log_score(recordings, numbers) if recordings else None,
            "of_recordings_left_out": mean_log(recordings, others[-len(recordings) :])
            if recordings
            else None,
        },
        "reliability": of_names(examples, numbers),
        "numbers": vars(numbers),
        "by_case": {
            one.name: {
                "kind": one.truth["kind"],
                "start": round(a, 3),
                "calibrated": round(b, 3),
                "left_out": round(c, 3),
            }
            for one, a, b, c in zip(examples, before, after, others, strict=True)
        },
    }
    return answer, numbers


def _module(numbers: object, answer: dict[str, object]) -> str:
    values = "".join(f"    {name}={value:.3g},\n" for name, value in vars(numbers).items())
    seeds = ", ".join(map(str, answer["seeds"]))
    score = answer["log_score"]
    return (
        '"""The posterior\'s numbers, written by scripts/calibrate_posterior.py: not to be edited.'
        f"\n\nFrom {answer['cases']} sealed cases of `epa gap blind make` (seeds {seeds}),"
        f" {answer['withheld_again']} of them\nonce more with their effect withheld, and"
        f" {answer['recordings']} recordings of others. Mean log\nprobability of the truth"
        f" {score['calibrated']:.3f}, on what they were not calibrated on"
        f" {score['on_cases_left_out']:.3f}.\n"
        '"""\n\nfrom epa_rt.gap.posterior.evidence import Numbers\n\n'
        f"CASES, RECORDINGS = {answer['cases']}, {answer['recordings']}\n"
        f"CALIBRATED = Numbers(\n{values})\n"
    )


if __name__ == "__main__":
    sys.exit(main())
