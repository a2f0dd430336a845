"""A room whose files each add something by being there: what they hold, or what is wrong with
them.
"""

import ast
import importlib
import math
import traceback
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TypeVar

from epa_rt.config.source import ConfigError
from epa_rt.config.units import UnitError, suffix_of, unit

Kind = TypeVar("Kind")
Found = TypeVar("Found")
Bounds = tuple[float, float]
RUNS = "a law that runs"


class Fault(Exception):
    """What is found and what is expected of a file of a room. ``word``: a function of it, or a
    keyword or a text of what makes its constant, which says the line.
    """

    def __init__(self, word: str, found: str, expected: str) -> None:
        super().__init__(word, found, expected)
        self.word, self.found, self.expected = word, found, expected


def held(
    room: str, folders: Iterable[str], name: str, kind: type[Kind], how: str
) -> list[tuple[Path, Kind]]:
    """File and constant ``name``, a ``kind``, of every module of the package ``room`` in
    ``folders``, in order of the files' names. ``how``: what makes such a constant.

    Raises ConfigError, with file and line, for one that cannot be imported or has no such constant.
    """
    found = []
    files = (file for folder in folders for file in Path(folder).glob("*.py"))
    for file in sorted(files, key=lambda one: one.stem):
        if file.stem == "__init__":
            continue
        try:
            constant = vars(importlib.import_module(f"{room}.{file.stem}")).get(name)
        except Exception as error:
            said = f"{type(error).__name__}: {error}"
            raise ConfigError(
                file, _line(error, file) or 1, "", said, "Python that runs"
            ) from error
        if not isinstance(constant, kind):
            raise ConfigError(file, 1, "", f"no {name}", f"{name} = {how}")
        found.append((file, constant))
    return found


def sound(file: Path, name: str, of: str, check: Callable[[], Found]) -> Found:
    """What a check finds of the constant ``name`` of a file, which is the effect ``of``. Raises
    ConfigError, with file and line, for its Fault or for whatever else the file raises in it.
    """
    try:
        return check()
    except Fault as fault:
        line = _line(fault, file) or line_of(file, name, fault.word)
        raise ConfigError(file, line, of, fault.found, fault.expected) from None
    except Exception as error:
        line = _line(error, file) or line_of(file, name)
        said = f"{type(error).__name__}: {error}"
        raise ConfigError(file, line, of, said, RUNS) from error


def check_starts(starts: object, names: Sequence[str], bounds: Sequence[Bounds], each: str) -> None:
    """That there are starts, each a value for each of ``names``, within its ``bounds``. ``each``:
    what a name is of. Raises Fault.
    """
    if not isinstance(starts, (tuple, list)) or not starts:
        raise Fault("starts", f"starts {starts}", f"one or more, each a value for each {each}")
    for start in starts:
        check_start(start, names, bounds)


def check_start(start: object, names: Sequence[str], bounds: Sequence[Bounds]) -> None:
    if not isinstance(start, (tuple, list)) or len(start) != len(names):
        raise Fault("starts", f"a start {start}", f"a value for each of {', '.join(names)}")
    for value, name, (low, high) in zip(start, names, bounds, strict=True):
        if not low <= value <= high:
            raise Fault("starts", f"a start of '{name}' at {value:g}", f"{low:g} to {high:g}")


def check_unit(name: str, si_unit: str) -> None:
    """That a number counts in an SI unit and ends in it. Raises Fault."""
    try:
        factor, _ = unit(si_unit)
    except UnitError as error:
        found, _, expected = str(error).removeprefix("found ").partition(", expected ")
        raise Fault(name, f"'{name}' with {found}", expected) from None
    if not math.isclose(factor, 1.0):
        raise Fault(name, f"'{name}' with unit '{si_unit}'", "an SI unit such as N, m or N*s/m")
    if not name.endswith(suffix_of(si_unit)):
        ending = f"a name that ends in its unit, {suffix_of(si_unit)}"
        raise Fault(name, f"'{name}' with unit '{si_unit}'", ending)


def line_of(file: Path, name: str, word: str = "") -> int:
    """Line of ``word`` in a file that runs: a function of it, or a keyword or a text of what makes
    its constant ``name``; else the constant's own.
    """
    for made in ast.parse(file.read_bytes()).body:
        if isinstance(made, ast.FunctionDef) and made.name == word:
            return made.lineno
        names = made.targets if isinstance(made, ast.Assign) else [getattr(made, "target", None)]
        if not any(isinstance(one, ast.Name) and one.id == name for one in names):
            continue
        for node in ast.walk(made) if word else ():
            if isinstance(node, ast.keyword) and node.arg == word:
                return node.lineno
            if isinstance(node, ast.Constant) and node.value == word:
                return node.lineno
        return made.lineno
    return 1


def _line(error: Exception, file: Path) -> int:
    """The last line of the file that led to an error, 0 where none did."""
    if isinstance(error, SyntaxError) and error.filename == str(file):
        return error.lineno or 1
    frames = traceback.extract_tb(error.__traceback__)
    return next((f.lineno or 1 for f in reversed(frames) if f.filename == str(file)), 0)
