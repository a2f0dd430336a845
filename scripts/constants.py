"""Which numeric constants of the diagnosis decide anything: each halved and doubled, recordings of
others diagnosed again, and whether the answer stays (epa_rt/benchmark/stability.py says what that
is). A number between 0 and 1 is changed in its odds, a whole number stays one of at least 1.

Recordings are those of scripts/known_recordings.yaml and scripts/stability.yaml. What calibration
sets (epa_rt/gap/posterior/calibrated.py) is not asked, nor what is no choice (NO_CHOICE). Answers
are kept as lines of OUT.jsonl: an interrupted run goes on; those of another engine are asked again.
Prints JSON: how many answers stay, and by constant those that did not.

  python scripts/constants.py -o out/constants
  python scripts/constants.py -o out/constants --recordings emps xl330 --constants posterior.decide
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import CodeType
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT)]
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from scripts.stability import AS_GIVEN, Kept, answered, engine, entries_of, opened_entry

GAP = ROOT / "epa_rt/gap"
ROOMS = ("likelihood", "posterior", "answer", "where", "held_out", "next")
FACTORS = (0.5, 2.0)
NO_CHOICE = {
    "CALIBRATED": "set by calibration",
    "CASES": "how many cases that was",
    "RECORDINGS": "how many recordings that was",
    "START": "where calibration begins",
    "TWO_SIDED_95": "a quantile",
    "CHI_95": "its square",
    "INTERVAL": "percentiles",
    "THIRD": "third differences",
    "QUARTERS": "a quarter turn",
    "SEEDS": "seeds",
    "FLOOR_SEEDS": "seeds",
    "TWIN_SEED": "a seed",
    "WORKERS": "processors",
    "KEPT": "memory",
}
LONGEST_S = 1800  # of one answer


@dataclass(frozen=True)
class Constant:
    """``module``: its dotted name below epa_rt.gap; ``place``: of a name among those of one
    assignment; ``value`` as it is written.
    """

    module: str
    name: str
    place: int | None
    value: str

    @property
    def label(self) -> str:
        return f"{self.module}.{self.name}"


def main() -> int:
    given = _arguments()
    if given.ask:
        recording, label, factor = given.ask
        print(json.dumps(_asked_here(recording, label, float(factor))))
        return 0
    kept = given.out.with_suffix(".jsonl")
    kept.parent.mkdir(parents=True, exist_ok=True)
    answers, code = Kept(kept, engine()), 0
    wanted = [
        one for one in constants() if any(word in one.label for word in given.constants or [""])
    ]
    names = entries_of("constants", given.recordings)
    try:
        for one in wanted:
            for name in names:
                _ask(name, one, given.factors, answers)
    except KeyboardInterrupt:
        print("constants: interrupted; the same command goes on", file=sys.stderr)
        code = 130
    print(json.dumps(summary(answers.lines), indent=1))
    return code


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("-o", "--out", type=Path, default=Path("out/constants"))
    parser.add_argument("--recordings", nargs="+", metavar="NAME")
    parser.add_argument("--constants", nargs="+", metavar="WORD", help="of their dotted names")
    parser.add_argument("--factors", nargs="+", type=float, default=FACTORS, metavar="X")
    parser.add_argument("--ask", nargs=3, help=argparse.SUPPRESS)  # by this script itself
    return parser.parse_args()


def constants() -> list[Constant]:
    """All named numbers of the diagnosis' rooms that are a choice."""
    paths = [*GAP.glob("*.py"), *(path for room in ROOMS for path in (GAP / room).rglob("*.py"))]
    return [one for path in sorted(paths) for one in _of_module(path)]


def _of_module(path: Path) -> Iterator[Constant]:
    module = ".".join(path.relative_to(GAP).with_suffix("").parts)
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if not isinstance(node, ast.Assign) or not any(map(_is_number, ast.walk(node.value))):
            continue
        target = node.targets[0]
        several = isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple)
        parts = target.elts if isinstance(target, ast.Tuple) else [target]
        for place, part in enumerate(parts):
            value = node.value.elts[place] if several else node.value
            is_choice = isinstance(part, ast.Name) and part.id not in NO_CHOICE
            if is_choice and part.id.isupper():
                yield Constant(module, part.id, place if several else None, ast.unparse(value))


def _is_number(node: ast.AST) -> bool:
    return (
        isinstance(node, ast.Constant)
        and isinstance(node.value, int | float)
        and not isinstance(node.value, bool)
    )


def changed(value: float, factor: float) -> float:
    """A number so many times larger: a whole one rounded, one between 0 and 1 in its odds."""
    if isinstance(value, int):
        return max(round(value * factor), min(value, 1))
    if 0.0 < value < 1.0:
        odds = factor * value / (1.0 - value)
        return odds / (1.0 + odds)
    return value * factor


class _Numbers(ast.NodeTransformer):
    def __init__(self, factor: float) -> None:
        self._factor = factor

    def visit_Constant(self, node: ast.Constant) -> ast.Constant:
        return ast.Constant(changed(node.value, self._factor)) if _is_number(node) else node


def altered(source: str, one: Constant, factor: float) -> ast.Module:
    """A module's text with one constant changed."""
    tree = ast.parse(source)
    for node in tree.body:
        if not isinstance(node, ast.Assign):
            continue
        target = node.targets[0]
        names = target.elts if isinstance(target, ast.Tuple) else [target]
        if one.name not in {part.id for part in names if isinstance(part, ast.Name)}:
            continue
        if one.place is None:
            node.value = _Numbers(factor).visit(node.value)
        elif isinstance(node.value, ast.Tuple):
            node.value.elts[one.place] = _Numbers(factor).visit(node.value.elts[one.place])
    return ast.fix_missing_locations(tree)


class _Loader(SourceFileLoader):
    """Loads a module with a constant changed."""

    def __init__(self, name: str, path: str, one: Constant, factor: float) -> None:
        super().__init__(name, path)
        self._one, self._factor = one, factor

    def get_code(self, fullname: str) -> CodeType:
        source = Path(self.path).read_text(encoding="utf-8")
        return compile(altered(source, self._one, self._factor), self.path, "exec")


class _Finder:
    """Finds the one module whose constant is changed."""

    def __init__(self, one: Constant, factor: float) -> None:
        self._one, self._factor = one, factor

    def find_spec(self, name: str, path: Any, target: Any = None) -> ModuleSpec | None:
        if name != f"epa_rt.gap.{self._one.module}":
            return None
        spec = PathFinder.find_spec(name, path, target)
        if spec is not None and spec.origin is not None:
            spec.loader = _Loader(name, spec.origin, self._one, self._factor)
        return spec


def _asked_here(recording: str, label: str, factor: float) -> dict[str, Any]:
    """The answer of this process, with a constant changed before anything is imported."""
    for one in constants():
        if one.label == label:
            sys.meta_path.insert(0, _Finder(one, factor))
    with tempfile.TemporaryDirectory(prefix="constants-") as folder:
        return answered(
            opened_entry(entries_of("constants", [recording])[recording]), Path(folder)
        ).as_json()


def _ask(recording: str, one: Constant, factors: Sequence[float], answers: Kept) -> None:
    changes = [
        (AS_GIVEN, ""),
        *((f"{one.label} x {factor:g}", f"{factor:g}") for factor in factors),
    ]
    for change, factor in changes:
        if (recording, change) in answers.lines:
            continue
        label = one.label if factor else "none"
        answers.add(
            recording,
            one.label if factor else AS_GIVEN,
            change,
            said := _answer_of(recording, label, factor or "1"),
        )
        first = said["answer"]["first"] if "answer" in said else "failed"
        print(f"{recording}, {change}: {first}", file=sys.stderr, flush=True)


def _answer_of(recording: str, label: str, factor: str) -> dict[str, Any]:
    """The answer of a process of its own, or why there is none."""
    words = [sys.executable, __file__, "--ask", recording, label, factor]
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=LONGEST_S)
    except subprocess.TimeoutExpired:
        return {"failed": f"no answer within {LONGEST_S} s"}
    if done.returncode != 0:
        return {"failed": done.stderr.strip().splitlines()[-1:]}
    return {"answer": json.loads(done.stdout)}


def summary(lines: dict[tuple[str, str], dict[str, Any]]) -> dict[str, Any]:
    """Answers that stay, in all, and by constant those that turned or failed."""
    from epa_rt.benchmark.stability import answer_from, stays

    turned: dict[str, list[dict[str, Any]]] = {}
    asked = stayed = same = 0
    for (recording, change), line in lines.items():
        if change == AS_GIVEN or "answer" not in lines[recording, AS_GIVEN]:
            continue
        asked += 1
        before = answer_from(lines[recording, AS_GIVEN]["answer"])
        after = answer_from(line["answer"]) if "answer" in line else None
        if after is not None and stays(before, after):
            stayed += 1
            same += before.first == after.first
            continue
        turned.setdefault(line["kind"], []).append(
            {
                "recording": recording,
                "change": change,
                "before": before.first,
                "after": after.first if after else f"failed: {line['failed']}",
            }
        )
    return {
        "constants": len({line["kind"] for line in lines.values()} - {AS_GIVEN}),
        "asked": asked,
        "stay": stayed,
        "same_first": same,
        "share": round(stayed / asked, 4) if asked else None,
        "turned": turned,
    }


if __name__ == "__main__":
    sys.exit(main())
