"""The arrows of docs/architecture.md, and what keeps the house small."""

import ast
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
CODE = ("epa_rt", "sim_backend", "drivers")

# who stands above whom; rooms of one line may see each other
LEVELS = (
    ("cli", "api"),
    ("drivers", "sim_backend"),
    ("benchmark",),
    ("gap", "study", "identify", "report", "runs", "live", "calibrate", "tune"),
    ("loop", "logs"),
    ("control", "experiments", "models", "safety"),
    ("backend", "realtime"),
    ("signals",),
    ("config",),
)
ABOVE = {room: level for level, rooms in enumerate(LEVELS) for room in rooms}
# the rooms of gap in the order of their flow: none asks a later one
GAP = (
    "side_by_side",
    "recording",
    "subject",
    "finding",
    "diagnosis",
    "likelihood",
    "rig.menu",
    "rig.read",
    "rig.house",
    "hygiene",
    "rig.foreign",
    "rig.subjects",
    "posterior",
    "answer",
    "where",
    "held_out",
    "next",
    "diagnose",
    "report",
)
HEAVY = (
    "numba",
    "scipy",
    "pydantic",
    "plotly",
    "rich",
    "numpy",
    "yaml",
    "mcap",
    "google.protobuf",
    "pysoem",
)


@cache
def tracked() -> tuple[str, ...]:
    found = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True)
    if found.returncode != 0:
        pytest.skip("not a git checkout")
    return tuple(name for name in found.stdout.split("\0") if name and (ROOT / name).is_file())


def sources() -> list[str]:
    return sorted(
        p.relative_to(ROOT).as_posix() for package in CODE for p in (ROOT / package).rglob("*.py")
    )


def room_of(module: str) -> str:
    parts = module.split(".")
    if parts[0] != "epa_rt":
        return parts[0]
    return parts[1] if len(parts) > 1 else "epa_rt"


@cache
def tree(path: str) -> ast.Module:
    return ast.parse((ROOT / path).read_text(encoding="utf-8"))


def imports(path: str) -> list[tuple[str, int]]:
    """Modules that a file imports anywhere, also inside functions and for type checking, with the
    line.
    """
    package = path.removesuffix(".py").replace("/", ".").rsplit(".", 1)[0]
    found = []
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import):
            found += [(alias.name, node.lineno) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                base = ".".join(
                    [*package.split(".")[: len(package.split(".")) - node.level + 1], base]
                ).strip(".")
            found += [
                (f"{base}.{alias.name}" if base == "epa_rt" else base, node.lineno)
                for alias in node.names
            ]
    return found


def test_nothing_imports_against_an_arrow():
    wrong = []
    for path in sources():
        room = room_of(path.removesuffix(".py").replace("/", "."))
        for module, line in imports(path):
            other = room_of(module)
            if (
                module.split(".")[0] not in CODE
                or other in (room, "epa_rt")
                or room in ("__init__", "__main__")
            ):
                continue
            if room not in ABOVE or other not in ABOVE:
                wrong.append(f"{path}:{line}: {room} or {other} has no place among the rooms")
            elif ABOVE[other] < ABOVE[room]:
                wrong.append(f"{path}:{line}: {room} imports {other}")
    assert not wrong, "\n".join(wrong)


def gap_room(module: str) -> str:
    parts = module.split(".")[2:]
    return ".".join(parts[:2] if parts[0] == "rig" else parts[:1])


def test_no_room_of_the_diagnosis_asks_a_later_one():
    wrong = []
    for path in sources():
        module = path.removesuffix(".py").replace("/", ".")
        if not module.startswith("epa_rt.gap.") or module.endswith("__init__"):
            continue
        for other, line in imports(path):
            if other.startswith("epa_rt.gap."):
                here, there = gap_room(module), gap_room(other)
                if GAP.index(there) > GAP.index(here):
                    wrong.append(f"{path}:{line}: {here} imports {there}")
    assert not wrong, "\n".join(wrong)


def test_safety_knows_no_controller_and_no_experiment():
    for path in sources():
        if path.startswith("epa_rt/safety/"):
            assert {room_of(m) for m, _ in imports(path) if m.startswith("epa_rt")} <= {
                "safety",
                "signals",
                "config",
            }, path


def test_only_the_command_line_and_the_drivers_own_code_know_hardware_and_simulation():
    for path in sources():
        if path.startswith("epa_rt/") and not path.startswith("epa_rt/cli/"):
            assert not [
                m for m, _ in imports(path) if m.split(".")[0] in ("drivers", "sim_backend")
            ], path
        if not path.startswith("drivers/"):
            assert not [m for m, _ in imports(path) if m.split(".")[0] == "pysoem"], path


def test_nothing_above_the_backend_reads_a_clock():
    """The backend owns time; progress on a screen and recording on a disk have their own."""
    for path in sources():
        if path.startswith(
            (
                "epa_rt/loop/",
                "epa_rt/control/",
                "epa_rt/experiments/",
                "epa_rt/safety/",
                "epa_rt/signals/",
                "epa_rt/models/",
            )
        ):
            assert not [m for m, _ in imports(path) if m.split(".")[0] in ("time", "datetime")], (
                path
            )


@pytest.mark.parametrize(
    "statement",
    [
        "import epa_rt.cli.main",
        "import epa_rt.cli.main as m; m.parser()",
        "import epa_rt.control.pid, epa_rt.safety.trip",
    ],
)
def test_the_command_line_answers_before_anything_heavy_is_loaded(statement):
    found = subprocess.run(
        [sys.executable, "-c", f"import sys; {statement}; print(*sys.modules)"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    assert not set(found.stdout.split()) & set(HEAVY)


@pytest.mark.parametrize(
    "arguments", [("check",), ("format", "--check")], ids=lambda words: words[0]
)
def test_ruff_has_nothing_to_say(arguments):
    """Rules, complexity and format of pyproject.toml, over the whole tree."""
    command = [sys.executable, "-m", "ruff", *arguments, "--no-cache", "."]
    found = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert found.returncode == 0, found.stdout + found.stderr


def test_no_file_is_called_utils():
    bad = [
        path
        for path in tracked()
        if Path(path).stem in ("util", "utils", "helper", "helpers", "misc", "common")
    ]
    assert not bad


def test_no_class_stands_on_more_than_two_of_ours():
    bases = {}
    for path in sources():
        for node in ast.walk(tree(path)):
            if isinstance(node, ast.ClassDef):
                bases[node.name] = [b.id for b in node.bases if isinstance(b, ast.Name)]

    def depth(name: str) -> int:
        return max(
            (1 + depth(base) for base in bases.get(name, []) if base in bases and base != name),
            default=0,
        )

    assert {name: depth(name) for name in bases if depth(name) > 2} == {}


def test_nothing_private_stands_in_a_tracked_file():
    """No folders of the machine that it was written on."""
    private = [
        marker.encode()
        for marker in ("." + "library", "/" + "work/", "/" + "root/", "/" + "home/", "/tmp/" + "v/")
    ]
    found = [
        f"{path}: {marker.decode()}"
        for path in tracked()
        for marker in private
        if marker in (ROOT / path).read_bytes()
    ]
    assert not found, "\n".join(found)


def test_every_module_says_what_it_is_for():
    silent = [
        path
        for path in sources()
        if (ROOT / path).stat().st_size
        and not path.endswith("__init__.py")
        and not ast.get_docstring(tree(path))
    ]
    assert not silent
