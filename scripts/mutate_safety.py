"""Mutate the safety envelope and the codec, and see whether a test notices.

Every mutant is one small change (a comparison, a boundary, a constant, a sign, a removed statement,
another return value). It counts as killed when a test of its room that runs a changed line fails or
hangs. A survivor must be explained in scripts/safety_mutants.yaml; from there this command writes
docs/safety-mutants.md. Prints JSON; exit code 1 where a survivor has no explanation or an
explanation no survivor.

What was found is kept in out/mutants: a run that was interrupted goes on, and a run after an edit
tries what the edit can change. A kill stands while the mutant's file, the killing test's file and
what the tests stand on are as they were; --anew forgets all.

  python scripts/mutate_safety.py               the full run
  python scripts/mutate_safety.py --list        every mutant, none run
  python scripts/mutate_safety.py --only commands.py --sample 20
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "scripts")]

import mutant_trials as trials
from mutants import Mutant, mutants_of

TABLE, PAGE = ROOT / "scripts" / "safety_mutants.yaml", ROOT / "docs" / "safety-mutants.md"
RECORD = ROOT / "out" / "mutants"
NOT_OF_A_ROOM = ("test_coverage.py", "test_mutants.py")  # they run the others
SAFETY = (
    "trip",
    "thermal",
    "bus_budget",
    "commands",
    "contradiction",
    "envelope",
    "recovery",
    "index_guard",
    "stopping",
    "let_down",
    "in_motion",
    "fill_watch",
    "muscle_law",
    "hose_watch",
    "at_rest",
    "motion_watch",
    "gas_watch",
)
TARGETS = {"epa_rt/signals/codec.py": "tests/signals"} | {
    f"epa_rt/safety/{name}.py": "tests/safety" for name in SAFETY
}
ROOMS = tuple(sorted(set(TARGETS.values())))
COPIED = (
    "epa_rt",
    "config",
    "tests/__init__.py",
    "tests/conftest.py",
    "tests/turns.py",
    "tests/safety",
    "tests/signals",
    "pyproject.toml",
)
FEW = 50  # mutants: for these it takes longer to find what each test touches than to run it
TELL_S = 10.0  # between two lines of progress


def all_mutants() -> list[Mutant]:
    return [
        mutant
        for path in TARGETS
        for mutant in mutants_of(path, (ROOT / path).read_text(encoding="utf-8"))
    ]


def copied(folder: Path) -> Path:
    """What the tests need, copied, so that nobody's edit in the meantime counts as a kill."""
    for name in COPIED:
        source, target = ROOT / name, folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if source.is_dir():
            shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(source, target)
    return folder


def test_files(root: Path, room: str) -> list[str]:
    """The test files of a room, by their paths in the copy."""
    return [
        f"{room}/{path.name}"
        for path in sorted((root / room).glob("test_*.py"))
        if path.name not in NOT_OF_A_ROOM
    ]


def own_tests(mutant: Mutant) -> str:
    """How the name of the file begins that has a module's own tests, if there is one."""
    return f"/test_{Path(mutant.path).stem}"


class Record:
    """What was found before: by mutant, the test that killed it; by test file, what it touches.

    That a mutant was left stands while all tests of its room are as they were. What a test touches
    stands while it and every mutated file are.
    """

    def __init__(self, root: Path, folder: Path):
        self._root, self._folder = root, folder
        folder.mkdir(parents=True, exist_ok=True)
        self._sources = self._digest(sorted(TARGETS))
        self._files = {
            name: self._digest([name, *self._stands_on(name)])
            for room in ROOMS
            for name in test_files(root, room)
        }
        self._rows: dict[str, dict[str, str]] = {}
        self.read()

    def read(self) -> None:
        """Takes what is in the folder, written by another process, say."""
        path = self._folder / "mutants.jsonl"
        for text in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
            row = json.loads(text)
            self._rows[row["mutant"]] = row

    def _digest(self, names: Iterable[str]) -> str:
        return trials.digest(*((self._root / name).read_bytes() for name in names))

    def _stands_on(self, test_file: str) -> list[str]:
        """The files of its room beside tests that a test file names, and those that they name."""
        room = (self._root / test_file).parent
        beside = [path for path in room.iterdir() if path.is_file() and path.name[:5] != "test_"]
        others = {path.stem: path for path in beside}
        found: set[str] = {"conftest"}
        texts = [(self._root / test_file).read_text(encoding="utf-8")]
        while texts:
            text = texts.pop()
            named = {name for name in others if name in text} - found
            found |= named
            texts += [others[name].read_text(encoding="utf-8") for name in named]
        return [others[name].relative_to(self._root).as_posix() for name in sorted(found)]

    def _name(self, mutant: Mutant) -> str:
        source = (self._root / mutant.path).read_bytes()
        return trials.digest(source, mutant.key.encode(), mutant.part.encode())

    def _tests(self, mutant: Mutant, killed_by: str) -> str:
        """What a verdict hangs on: the killing test's file, or all files of the room."""
        files = test_files(self._root, TARGETS[mutant.path])
        if trials.test_file(killed_by) in files:
            files = [trials.test_file(killed_by)]
        return trials.digest(*(self._files[name].encode() for name in files))

    def killed_by(self, mutant: Mutant) -> str | None:
        """The test that killed it, '' where it was left; None where that has to be found."""
        row = self._rows.get(self._name(mutant))
        if row is None or row["tests"] != self._tests(mutant, row["killed_by"]):
            return None
        return row["killed_by"]

    def add(self, trial: trials.Trial) -> None:
        row = {
            "mutant": self._name(trial.mutant),
            "key": trial.mutant.key,
            "killed_by": trial.killed_by,
            "tests": self._tests(trial.mutant, trial.killed_by),
        }
        self._rows[row["mutant"]] = row
        with (self._folder / "mutants.jsonl").open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")

    def _touched_path(self, test_file: str) -> Path:
        parts = (self._sources, self._files[test_file])
        return self._folder / f"touched-{trials.digest(*(part.encode() for part in parts))}.json"

    def touched(self) -> trials.Touched:
        """What the tests touch, as far as it is known."""
        found = trials.Touched()
        for path in map(self._touched_path, self._files):
            if path.exists():
                found.add(trials.Touched.from_json(path.read_text(encoding="utf-8")))
        return found

    def find_touched(self, items: Mapping[str, trials.pytest.Item]) -> trials.Touched:
        """The same, found anew where it is not known."""
        by_file = trials.by_file(list(items))
        for i, (name, tests) in enumerate(by_file.items()):
            path = self._touched_path(name)
            if not path.exists():
                say(f"what tests touch: {name}, {i + 1} of {len(by_file)}")
                made = trials.touched({t: items[t] for t in tests}, self._root, [*TARGETS])
                path.write_text(made.to_json(), encoding="utf-8")
        return self.touched()


def say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


class Progress:
    """A line every few seconds: how many of how many, and how many were left."""

    def __init__(self, count: int):
        self._count, self._done, self._left = count, 0, 0
        self._began_s = self._told_s = time.monotonic()

    def one(self, trial: trials.Trial) -> None:
        self._done += 1
        self._left += not trial.killed_by
        now_s = time.monotonic()
        if now_s > self._told_s + TELL_S:
            self._told_s = now_s
            rate = self._done / (now_s - self._began_s)
            say(f"{self._done} of {self._count}, {rate:.1f} a second, {self._left} left alive")


def try_inside(
    mutants: Sequence[Mutant], record: Record, root: Path, jobs: int, touch: bool
) -> None:
    """Tries those in functions against tests that are collected once. Without ``touch`` every test
    of the room is asked, those of the module's own file first.
    """
    progress = Progress(len(mutants))

    def work(items: dict[str, trials.pytest.Item]) -> None:
        found = record.find_touched(items) if touch else trials.Touched()

        def chosen(mutant: Mutant) -> Sequence[str]:
            room = [test for test in items if test.startswith(f"{TARGETS[mutant.path]}/")]
            if touch:
                return found.tests_of(mutant, room)
            return sorted(room, key=lambda test: own_tests(mutant) not in test)

        for trial in trials.tried(mutants, items, chosen, found.seconds, root, jobs):
            if trial.killed_by != trials.NOT_IN_PLACE:
                record.add(trial)
                progress.one(trial)

    rooms = {TARGETS[mutant.path] for mutant in mutants}
    trials.with_tests(root, [name for room in rooms for name in test_files(root, room)], work)


def try_anew(mutants: Sequence[Mutant], record: Record, root: Path, jobs: int) -> None:
    """Tries the others, each against the test files of its room, those first that touch most."""
    progress = Progress(len(mutants))
    most: dict[str, Counter[str]] = {path: Counter() for path in TARGETS}
    for test, by_path in record.touched().lines.items():
        for path, rows in by_path.items():
            most[path][trials.test_file(test)] += len(rows)

    def files(mutant: Mutant) -> Sequence[str]:
        room = test_files(root, TARGETS[mutant.path])
        return sorted(room, key=lambda at: (-most[mutant.path][at], own_tests(mutant) not in at))

    for trial in trials.tried_anew(mutants, files, root, jobs):
        record.add(trial)
        progress.one(trial)


def run(mutants: Sequence[Mutant], record: Record, root: Path, jobs: int, touch: bool) -> None:
    """Tries the mutants of which nothing is known yet, and records what becomes of them."""
    os.environ["EPA_MUTATING"] = "1"
    sys.path.insert(0, str(root))  # before the checkout's own
    import hypothesis.strategies  # noqa: F401

    import epa_rt.config.rig  # noqa: F401

    unknown = [mutant for mutant in mutants if record.killed_by(mutant) is None]
    inside = [mutant for mutant in unknown if mutant.function]
    if inside:
        trials.in_a_process(lambda: try_inside(inside, record, root, jobs, touch))
        record.read()
    late = [mutant for mutant in unknown if record.killed_by(mutant) is None]
    if late:
        try_anew(late, record, root, jobs)


def explanations() -> dict[str, str]:
    import yaml

    return yaml.safe_load(TABLE.read_text(encoding="utf-8")) or {} if TABLE.exists() else {}


def page(found: Mapping[str, tuple[int, list[str]] | None], reasons: Mapping[str, str]) -> str:
    """The page: by file its mutants and the keys of those left, None where not all were tried."""
    lines = [
        "# Mutants of the safety envelope and the codec that no test notices",
        "",
        "For whoever asks how far the tests of the safety envelope can be trusted. A mutant is",
        "its code with one small mistake put in; a test must fail on it.",
        (
            "Written by `python scripts/mutate_safety.py` from `scripts/safety_mutants.yaml`;"
            " change it there."
        ),
        "",
        "| File | Mutants | Killed | Left, each for a reason |",
        "|---|---|---|---|",
    ]
    tried = {path: row for path, row in found.items() if row is not None}
    for path, (count, left) in tried.items():
        lines.append(f"| `{path}` | {count} | {count - len(left)} | {len(left)} |")
    count = sum(row[0] for row in tried.values())
    left = [key for row in tried.values() for key in row[1]]
    lines += [f"| all | {count} | {count - len(left)} | {len(left)} |", ""]
    missing = [path for path, row in found.items() if row is None]
    if missing:
        lines += [f"Not tried since they changed last: {', '.join(f'`{p}`' for p in missing)}.", ""]
    lines += [f"- `{key}`\n  {reasons.get(key, '**not explained**')}" for key in left]
    return "\n".join(lines) + "\n"


def write_page(record: Record) -> None:
    """The page of what is recorded for the present code."""
    found: dict[str, tuple[int, list[str]] | None] = {}
    for path in TARGETS:
        mutants = mutants_of(path, (ROOT / path).read_text(encoding="utf-8"))
        killers = [record.killed_by(mutant) for mutant in mutants]
        left = [m.key for m, killer in zip(mutants, killers, strict=True) if killer == ""]
        found[path] = None if None in killers else (len(mutants), left)
    PAGE.write_text(page(found, explanations()), encoding="utf-8")


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--list", action="store_true", help="list the mutants, run none")
    parser.add_argument("--only", default="", help="only mutants whose key has this text")
    parser.add_argument("--sample", type=int, help="so many of them, drawn at random with seed 1")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--record", type=Path, default=RECORD, help="where findings are kept")
    parser.add_argument("--page", action="store_true", help="write the page of what was found")
    parser.add_argument("--anew", action="store_true", help="forget what was found before")
    chosen = parser.parse_args()
    mutants = [mutant for mutant in all_mutants() if chosen.only in mutant.key]
    if chosen.list:
        print("\n".join(mutant.key for mutant in mutants))
        return 0
    whole = not chosen.only and chosen.sample is None
    if chosen.sample is not None:
        mutants = random.Random(1).sample(mutants, min(chosen.sample, len(mutants)))
    if chosen.anew:
        shutil.rmtree(chosen.record, ignore_errors=True)
    began_s = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        root = copied(Path(folder).resolve())
        record = Record(root, chosen.record)
        if chosen.page:
            write_page(record)
            return 0
        run(mutants, record, root, chosen.jobs, touch=len(mutants) > FEW)
        if whole:
            write_page(record)
        survivors = [mutant.key for mutant in mutants if not record.killed_by(mutant)]
    reasons = explanations()
    unexplained = [key for key in survivors if key not in reasons]
    needless = [key for key in reasons if key not in survivors] if whole else []
    answer = {
        "mutants": len(mutants),
        "killed": len(mutants) - len(survivors),
        "survivors": survivors,
        "unexplained": unexplained,
        "explained_but_killed": needless,
        "seconds": round(time.monotonic() - began_s, 1),
    }
    print(json.dumps(answer, indent=1, ensure_ascii=False))
    return 1 if unexplained or needless else 0


if __name__ == "__main__":
    sys.exit(main())
