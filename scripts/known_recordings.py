"""Recordings of others of which it is known what the rig has and the plant file lacks, as the
posterior's calibration takes them: brought in and checked as the command line does.

Prints a table of what the diagnosis says of each now.

  python scripts/known_recordings.py
  python scripts/known_recordings.py emps xl330
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT)]
LIST = Path(__file__).with_suffix(".yaml")
SHARED = ROOT.parent / "shared"  # where the recordings themselves are
CLEAR = 9.0  # times its detection limit: of each effect that is known to be there


def listed() -> list[dict[str, Any]]:
    """All entries of the list."""
    entries: list[dict[str, Any]] = yaml.safe_load(LIST.read_text(encoding="utf-8"))
    return entries


def known() -> list[dict[str, Any]]:
    """All entries of the list whose files are there."""
    return [one for one in listed() if is_there(one)]


def is_there(entry: dict[str, Any]) -> bool:
    """Whether all logs of an entry are there."""
    return all(path.exists() for path in _files(entry))


def truth_of(entry: dict[str, Any]) -> dict[str, Any]:
    """An entry's truth as that of a sealed case: its kind, and the families of each effect."""
    effects = [
        {"families": families, "answers": [], "multiple": CLEAR} for families in entry["truth"]
    ]
    kinds = {0: "none", 1: "single"}
    return {"kind": kinds.get(len(effects), "pair"), "effects": effects}


def logs_of(entry: dict[str, Any], folder: Path) -> tuple[Path, list[Path], list[Path]]:
    """The rig file of an entry, its logs and its held-out ones, imported into a folder."""
    return (
        at(entry["rig"]),
        _imported(entry["logs"], folder / "logs"),
        _imported(entry.get("holdout", {}), folder / "holdout"),
    )


def _imported(by_mapping: dict[str, list[Any]], folder: Path) -> list[Path]:
    from epa_rt.logs.importers.log_of import log_of

    folder.mkdir(parents=True, exist_ok=True)
    made = []
    for mapping, logs in by_mapping.items():
        for one in logs:
            files = [at(name) for name in (one if isinstance(one, list) else [one])]
            made.append(log_of(at(mapping), files, folder / f"{files[0].stem}.mcap"))
    return made


def _files(entry: dict[str, Any]) -> list[Path]:
    logs = [log for key in ("logs", "holdout") for of in entry.get(key, {}).values() for log in of]
    names = [name for log in logs for name in (log if isinstance(log, list) else [log])]
    return [at(name) for name in names]


def at(name: str) -> Path:
    """Where a file of the list lies: in this repository or beside it."""
    return (ROOT if name.startswith("config/") else SHARED) / name


def main() -> int:
    from epa_rt.cli.exits import VerbError
    from epa_rt.cli.gap.diagnose import diagnose_logs

    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    entries = {one["name"]: one for one in listed()}
    parser.add_argument("names", nargs="*", help="only these (default: all)")
    only = parser.parse_args().names or list(entries)
    if unknown := [name for name in only if name not in entries]:
        parser.error(f"found {', '.join(unknown)}, expected one of {', '.join(entries)}")
    for name in only:
        entry = entries[name]
        if not is_there(entry):
            print(f"{entry['name']}: its files are not there")
            continue
        with tempfile.TemporaryDirectory(prefix="known-") as folder:
            rig, logs, holdout = logs_of(entry, Path(folder))
            try:
                answer = diagnose_logs(rig, None, logs, holdout)[1]
            except VerbError as error:
                print(f"{entry['name']}: {error}")
                continue
        names = ", ".join(f"{one.name} {one.confidence:.2f}" for one in answer.effects)
        wanted = " and ".join("/".join(families) for families in entry["truth"]) or "nothing"
        print(f"{entry['name']}: {wanted}; said {answer.verdict} {names}: {answer.says}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
