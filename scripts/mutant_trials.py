"""Tries mutants against tests that are collected once: each trial is a process forked from there,
with the changed function in place, and runs only the tests that touch the changed lines.

What each test touches is found by running it alone under coverage, in a forked process of its own,
so that nothing is hidden by what an earlier test left behind.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import importlib.abc
import importlib.util
import json
import os
import resource
import select
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import CodeType
from typing import Any

import coverage
import pytest
from _pytest.runner import runtestprotocol
from mutants import Mutant

LEAST_S, TIMES = 20.0, 5.0  # of processor time: a trial that takes more hangs
ALONE_S = 300.0
QUIET = ("-q", "-s", "--tb=no", "--assert=plain", "-p", "no:cacheprovider", "-o", "timeout=0")
NOT_IN_PLACE = "not in place"  # what is changed cannot be put into the function that is there


@dataclass
class Touched:
    """By test: the processor time it takes, and the lines of each file that it runs."""

    seconds: dict[str, float] = field(default_factory=dict)
    lines: dict[str, dict[str, frozenset[int]]] = field(default_factory=dict)

    def add(self, other: Touched) -> None:
        self.seconds |= other.seconds
        self.lines |= other.lines

    def to_json(self) -> str:
        lines = {
            test: {path: sorted(rows) for path, rows in by_path.items()}
            for test, by_path in self.lines.items()
        }
        return json.dumps({"seconds": self.seconds, "lines": lines})

    @classmethod
    def from_json(cls, text: str) -> Touched:
        saved = json.loads(text)
        lines = {
            test: {path: frozenset(rows) for path, rows in by_path.items()}
            for test, by_path in saved["lines"].items()
        }
        return cls(saved["seconds"], lines)

    def tests_of(self, mutant: Mutant, tests: Sequence[str]) -> list[str]:
        """Those that run a changed line, the fastest first."""
        changed = range(mutant.lines[0], mutant.lines[1] + 1)
        found = [
            test
            for test in tests
            if not self.lines[test].get(mutant.path, frozenset()).isdisjoint(changed)
        ]
        return sorted(found, key=lambda test: self.seconds[test])


@dataclass(frozen=True)
class Trial:
    """The test that failed, '' where all passed; a hang or a crash counts as a failed test."""

    mutant: Mutant
    killed_by: str


def digest(*parts: bytes) -> str:
    """One short name for texts in this order."""
    made = hashlib.sha256()
    for part in parts:
        made.update(len(part).to_bytes(8, "little") + part)
    return made.hexdigest()[:24]


class Collected:
    """A pytest plugin: hands the collected tests to ``work`` instead of running them."""

    def __init__(self, work: Callable[[dict[str, pytest.Item]], None]):
        self._work = work
        self.failure: BaseException | None = None

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        if not session.testsfailed:
            try:
                self._work({item.nodeid: item for item in session.items})
            except BaseException as error:
                self.failure = error
        return True


def with_tests(
    root: Path, paths: Sequence[str], work: Callable[[dict[str, pytest.Item]], None]
) -> None:
    """Collects the tests of a folder once and hands them over by their ids. Raises what ``work``
    raises, and SystemExit where they cannot be collected.
    """
    os.chdir(root)
    plugin = Collected(work)
    code = pytest.main([*QUIET, *paths], plugins=[plugin])
    if plugin.failure is not None:
        raise plugin.failure
    if code != pytest.ExitCode.OK:
        raise SystemExit(f"mutants: collecting the tests ends with {code}")


def failing(items: Sequence[pytest.Item]) -> str:
    """The first test that fails, in this process; '' where all pass."""
    for i, item in enumerate(items):
        following = items[i + 1] if i + 1 < len(items) else None
        if any(report.failed for report in runtestprotocol(item, log=False, nextitem=following)):
            return item.nodeid
    return ""


def touched(items: Mapping[str, pytest.Item], root: Path, files: Sequence[str]) -> Touched:
    """Each test alone under coverage. Raises SystemExit where one fails."""
    found = Touched()
    with tempfile.TemporaryDirectory() as name:
        for i, (test, item) in enumerate(items.items()):
            said = Path(name) / f"{i}.json"
            _wait(_forked(lambda item=item, said=said: _alone(item, root, files, said)), ALONE_S)
            if not said.exists():
                raise SystemExit(f"mutants: {test} fails without any mutant")
            answer = json.loads(said.read_text(encoding="utf-8"))
            found.seconds[test] = answer["seconds"]
            found.lines[test] = {path: frozenset(rows) for path, rows in answer["lines"].items()}
    return found


def _alone(item: pytest.Item, root: Path, files: Sequence[str], said: Path) -> None:
    measured = coverage.Coverage(
        data_file=None, config_file=False, include=[str(root / name) for name in files]
    )
    began_s = time.process_time()
    measured.start()
    failed = failing([item])
    measured.stop()
    seconds = time.process_time() - began_s
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a test that touches nothing
        data = measured.get_data()
    lines = {name: sorted(data.lines(str(root / name)) or ()) for name in files}
    if not failed:
        answer = {"seconds": seconds, "lines": {name: at for name, at in lines.items() if at}}
        said.write_text(json.dumps(answer), encoding="utf-8")


def tried(
    mutants: Sequence[Mutant],
    items: Mapping[str, pytest.Item],
    chosen: Callable[[Mutant], Sequence[str]],
    seconds: Mapping[str, float],
    root: Path,
    jobs: int,
) -> Iterator[Trial]:
    """Each mutant that is in a function's body, against the tests chosen for it, in this order.
    ``seconds``: what a test takes; one without is given the longest time.
    """

    def child(mutant: Mutant, said: Path) -> None:
        said.write_text(NOT_IN_PLACE, encoding="utf-8")
        put_in_place(mutant, root)
        said.write_text("hang or crash", encoding="utf-8")
        said.write_text(failing([items[test] for test in chosen(mutant)]), encoding="utf-8")

    def allowed_s(mutant: Mutant) -> float:
        return LEAST_S + TIMES * sum(seconds.get(test, 1.0) for test in chosen(mutant))

    yield from _in_children(mutants, child, allowed_s, jobs)


def tried_anew(
    mutants: Sequence[Mutant], paths: Callable[[Mutant], Sequence[str]], root: Path, jobs: int
) -> Iterator[Trial]:
    """Each mutant that is not in a function's body: the module is imported anew, and the test files
    with it.
    """

    def child(mutant: Mutant, said: Path) -> None:
        said.write_text("hang or crash", encoding="utf-8")
        os.chdir(root)
        _load_from_text(mutant, root)
        first = Failed()
        code = pytest.main(["-x", *QUIET, *paths(mutant)], plugins=[first])
        said.write_text(first.test or ("" if code == 0 else "collection"), encoding="utf-8")

    yield from _in_children(mutants, child, lambda mutant: ALONE_S, jobs)


class Failed:
    """A pytest plugin: remembers the first test that failed."""

    test = ""

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed and not self.test:
            self.test = report.nodeid


def put_in_place(mutant: Mutant, root: Path) -> None:
    """The mutant's function in the module that is already imported."""
    module = importlib.import_module(mutant.path.removesuffix(".py").replace("/", "."))
    if not str(module.__file__).startswith(str(root)):
        raise SystemExit(f"mutants: {module.__file__} is not the copy")
    owner: Any = module
    *classes, name = mutant.function.split(".")
    for each in classes:
        owner = getattr(owner, each)
    plain = vars(owner)[name]
    function = getattr(plain, "fget", None) or getattr(plain, "__func__", None) or plain
    while hasattr(function, "__wrapped__"):
        function = function.__wrapped__
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        code = compile(mutant.text, str(root / mutant.path), "exec", dont_inherit=True)
    function.__code__ = next(c for c in _codes(code) if c.co_qualname == mutant.function)


def _codes(code: CodeType) -> Iterator[CodeType]:
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield constant
            yield from _codes(constant)


def _load_from_text(mutant: Mutant, root: Path) -> None:
    name = mutant.path.removesuffix(".py").replace("/", ".")

    class Loader(importlib.abc.Loader):
        def exec_module(self, module: Any) -> None:
            code = compile(mutant.text, str(root / mutant.path), "exec", dont_inherit=True)
            exec(code, module.__dict__)

    class Finder(importlib.abc.MetaPathFinder):
        def find_spec(self, found: str, path: object, target: object = None) -> Any:
            return importlib.util.spec_from_loader(name, Loader()) if found == name else None

    assert name not in sys.modules, name
    sys.meta_path.insert(0, Finder())


def _forked(work: Callable[[], None]) -> int:
    """A silent child that does the work and nothing after it."""
    child = os.fork()
    if child:
        return child
    code = 1
    try:
        os.setsid()
        silent = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(silent, stream)
        work()
        code = 0
    finally:
        os._exit(code)


def in_a_process(work: Callable[[], None]) -> None:
    """The work in a forked process, which keeps what it imports. Raises SystemExit where it
    fails.
    """
    child = os.fork()
    if child == 0:
        code = 1
        try:
            silent = os.open(os.devnull, os.O_RDWR)
            os.dup2(silent, 1)  # pytest's own words
            work()
            code = 0
        except SystemExit as error:
            print(error, file=sys.stderr)
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(code)
    if os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]):
        raise SystemExit(2)


def _wait(child: int, longest_s: float) -> None:
    """Waits for a child; one that takes longer is killed, with all that it started."""
    descriptor = os.pidfd_open(child)
    if not select.select([descriptor], [], [], longest_s)[0]:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(child, signal.SIGKILL)
    os.close(descriptor)
    os.waitpid(child, 0)


def _in_children(
    mutants: Sequence[Mutant],
    work: Callable[[Mutant, Path], None],
    allowed_s: Callable[[Mutant], float],
    jobs: int,
) -> Iterator[Trial]:
    """So many children at a time, each for one mutant, with its own bound on processor time."""
    running: dict[int, tuple[Mutant, Path]] = {}
    waiting = list(reversed(mutants))
    with tempfile.TemporaryDirectory() as name:

        def start(mutant: Mutant) -> None:
            said, most_s = Path(name) / f"{len(waiting)}", int(allowed_s(mutant)) + 1

            def child() -> None:
                resource.setrlimit(resource.RLIMIT_CPU, (most_s, most_s + 1))
                signal.alarm(20 * most_s)  # waits that take no processor time
                work(mutant, said)

            running[_forked(child)] = (mutant, said)

        while waiting or running:
            while waiting and len(running) < jobs:
                start(waiting.pop())
            child, _ = os.wait()
            if child not in running:
                continue
            mutant, said = running.pop(child)
            yield Trial(mutant, said.read_text(encoding="utf-8") if said.exists() else "crash")


def test_file(test: str) -> str:
    """The file of a test, by its id."""
    return test.partition("::")[0]


def by_file(tests: Sequence[str]) -> dict[str, list[str]]:
    """Test ids by their file."""
    found: dict[str, list[str]] = defaultdict(list)
    for test in tests:
        found[test_file(test)].append(test)
    return dict(found)
