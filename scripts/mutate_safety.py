"""Mutate the safety envelope and the codec, and see whether a test notices.

Every mutant is one small change (a comparison, a boundary, a constant, a sign, a removed statement,
another return value). It counts as killed when the tests of its room fail or hang. A survivor must
be explained in scripts/safety_mutants.yaml; from there this command writes docs/safety-mutants.md.
Prints JSON; exit code 1 where a survivor has no explanation or an explanation no survivor.

  python scripts/mutate_safety.py               the full run, a few minutes on two cores
  python scripts/mutate_safety.py --list        every mutant, none run
  python scripts/mutate_safety.py --only commands.py --sample 20
"""

import argparse
import json
import os
import random
import shutil
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "scripts")]

from mutants import Mutant, mutants_of

TABLE, PAGE = ROOT / "scripts" / "safety_mutants.yaml", ROOT / "docs" / "safety-mutants.md"
SAFETY = (
    "test_power.py",
    "test_trips.py",
    "test_limits_and_words.py",
    "test_thermal.py",
    "test_stopping.py",
    "test_let_down.py",
    "test_bus_budget.py",
    "test_contradiction.py",
    "test_recovery.py",
    "test_nothing_forbidden_leaves.py",
)  # fast ones first
SIGNALS = ("test_decoding.py", "test_image.py", "test_freshness.py", "test_encoding.py")
TARGETS = {
    **{
        f"epa_rt/safety/{name}.py": [f"tests/safety/{test}" for test in SAFETY]
        for name in (
            "bus_budget",
            "commands",
            "contradiction",
            "envelope",
            "let_down",
            "recovery",
            "stopping",
            "thermal",
            "trip",
        )
    },
    "epa_rt/signals/codec.py": [f"tests/signals/{test}" for test in SIGNALS],
}
COPIED = ("epa_rt", "config", "tests/safety", "tests/signals", "pyproject.toml")
TIMEOUT_S = 120.0


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


def survives(mutant: Mutant, root: Path) -> bool:
    """Whether the tests pass with the mutant in place of its module, in a child process of its
    own.
    """
    pid = os.fork()
    if pid == 0:
        os._exit(_tests_with(mutant, root))
    deadline = time.monotonic() + TIMEOUT_S
    while True:
        done, status = os.waitpid(pid, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status) == 0
        if time.monotonic() > deadline:
            os.kill(pid, 9)
            os.waitpid(pid, 0)
            return False
        time.sleep(0.02)


def _tests_with(mutant: Mutant, root: Path) -> int:
    import importlib.abc
    import importlib.util

    import pytest

    name = mutant.path.removesuffix(".py").replace("/", ".")

    class Loader(importlib.abc.Loader):
        def exec_module(self, module: object) -> None:
            exec(compile(mutant.text, str(root / mutant.path), "exec"), module.__dict__)

    class Finder(importlib.abc.MetaPathFinder):
        def find_spec(self, found: str, path: object, target: object = None) -> object:
            return importlib.util.spec_from_loader(name, Loader()) if found == name else None

    os.chdir(root)
    sys.meta_path.insert(0, Finder())
    silent = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(silent, stream)
    try:
        return int(
            pytest.main(
                [
                    "-x",
                    "-q",
                    "--tb=no",
                    "--assert=plain",
                    "-p",
                    "no:cacheprovider",
                    *TARGETS[mutant.path],
                ]
            )
        )
    except BaseException:
        return 1


def untouched() -> list[Mutant]:
    """A target as it is for each set of tests: what they must pass."""
    one_of = {tuple(tests): path for path, tests in TARGETS.items()}
    return [Mutant(path, "", (ROOT / path).read_text(encoding="utf-8")) for path in one_of.values()]


def run(mutants: list[Mutant], root: Path, jobs: int) -> list[bool]:
    """Which of them survive. What all children need is imported once, from the copy, before they
    fork.
    """
    os.environ["EPA_MUTATING"] = "1"
    sys.path.insert(0, str(root))  # before the checkout's own
    import hypothesis.strategies  # noqa: F401
    import pytest  # noqa: F401

    import epa_rt.config.rig  # noqa: F401

    with ThreadPoolExecutor(jobs) as pool:
        return list(pool.map(lambda mutant: survives(mutant, root), mutants))


def explanations() -> dict[str, str]:
    import yaml

    return yaml.safe_load(TABLE.read_text(encoding="utf-8")) or {} if TABLE.exists() else {}


def page(total: int, killed: int, survivors: list[str], reasons: dict[str, str]) -> str:
    lines = [
        "# Mutants of the safety envelope and the codec that no test notices",
        "",
        (
            "Written by `python scripts/mutate_safety.py` from `scripts/safety_mutants.yaml`;"
            " change it there."
        ),
        "",
        f"{total} mutants, {killed} killed, {len(survivors)} left, each for a reason:",
        "",
    ]
    lines += [f"- `{key}`\n  {reasons.get(key, '**not explained**')}" for key in survivors]
    return "\n".join(lines) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--list", action="store_true", help="list the mutants, run none")
    parser.add_argument("--only", default="", help="only mutants whose key has this text")
    parser.add_argument("--sample", type=int, help="so many of them, drawn at random with seed 1")
    parser.add_argument("--jobs", type=int, default=2)
    chosen = parser.parse_args()
    mutants = [mutant for mutant in all_mutants() if chosen.only in mutant.key]
    if chosen.list:
        print("\n".join(mutant.key for mutant in mutants))
        return 0
    whole = not chosen.only and chosen.sample is None
    if chosen.sample is not None:
        mutants = random.Random(1).sample(mutants, min(chosen.sample, len(mutants)))
    began_s = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        root = copied(Path(folder))
        sound = untouched()
        alive = run([*sound, *mutants], root, chosen.jobs)
    broken = [mutant.path for mutant, is_alive in zip(sound, alive, strict=False) if not is_alive]
    if broken:
        print(f"the tests of {', '.join(broken)} fail without any mutant", file=sys.stderr)
        return 2
    alive = alive[len(sound) :]
    survivors = [mutant.key for mutant, is_alive in zip(mutants, alive, strict=True) if is_alive]
    reasons = explanations()
    unexplained = [key for key in survivors if key not in reasons]
    needless = [key for key in reasons if key not in survivors] if whole else []
    if whole:
        PAGE.write_text(
            page(len(mutants), len(mutants) - len(survivors), survivors, reasons), encoding="utf-8"
        )
    print(
        json.dumps(
            {
                "mutants": len(mutants),
                "killed": len(mutants) - len(survivors),
                "survivors": survivors,
                "unexplained": unexplained,
                "explained_but_killed": needless,
                "seconds": round(time.monotonic() - began_s, 1),
            },
            indent=1,
            ensure_ascii=False,
        )
    )
    return 1 if unexplained or needless else 0


if __name__ == "__main__":
    sys.exit(main())
