"""YAML files read with the line of every key, and errors that say file, line, found and expected."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import yaml

Location = tuple[str | int, ...]


class ConfigError(Exception):
    """One sentence about a file that cannot be used: ``FILE:LINE: where: found X, expected Y``."""

    def __init__(self, path: Path | str, line: int, where: str, found: str, expected: str):
        self.path, self.line, self.where, self.found, self.expected = Path(path), line, where, found, expected
        super().__init__(f"{path}:{line}: {where + ': ' if where else ''}found {found}, expected {expected}")


@dataclass(frozen=True)
class Located:
    """Plain data of a YAML file (dicts, lists, scalars) and the line of each key; lines count from 1."""

    path: Path
    data: Any
    lines: Mapping[Location, int] = field(repr=False)
    text: str = field(repr=False, default="")

    def line(self, where: Location) -> int:
        """Line of a place, or of the nearest place above it that the file has."""
        while where and where not in self.lines:
            where = where[:-1]
        return self.lines.get(where, 1)

    def error(self, where: Location, found: str, expected: str) -> ConfigError:
        return ConfigError(self.path, self.line(where), show_location(where), found, expected)


def show_location(where: Location) -> str:
    """('signals', 3, 'limits') as 'signals[3].limits'."""
    text = ""
    for part in where:
        text += f"[{part}]" if isinstance(part, int) else (f".{part}" if text else str(part))
    return text


def load_yaml(path: Path | str) -> Located:
    """Reads a YAML mapping with the line of every key. Raises ConfigError (unreadable, bad YAML, a key twice)."""
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise ConfigError(path, 1, "", "no such file", "a YAML file") from None
    except IsADirectoryError:
        raise ConfigError(path, 1, "", "a folder", "a YAML file") from None
    except PermissionError:
        raise ConfigError(path, 1, "", "a file without permission to read it", "a readable YAML file") from None
    except OSError as error:
        raise ConfigError(path, 1, "", f"a file that cannot be read ({error.strerror})", "a YAML file") from None
    except UnicodeDecodeError as error:
        raise ConfigError(path, 1, "", f"bytes that are not UTF-8 text (offset {error.start})", "a YAML file") from None
    return parse_yaml(text, path)


def parse_yaml(text: str, path: Path | str) -> Located:
    """As load_yaml, from text that came from ``path`` (a log's attachment, say)."""
    path = Path(path)
    try:
        loader = yaml.SafeLoader(text)
        node = loader.get_single_node()
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
        line = mark.line + 1 if mark else 1
        problem = " ".join(str(getattr(error, "problem", None) or getattr(error, "reason", None) or error).split())
        raise ConfigError(path, line, "", f"text that is not YAML ({problem})", "YAML") from None
    if not isinstance(node, yaml.MappingNode):
        found = "an empty file" if node is None else "a list or a single value"
        raise ConfigError(path, 1, "", found, "a mapping of keys to values")
    lines: dict[Location, int] = {}
    try:
        data = _plain(node, (), lines, loader, path, 0)
    except RecursionError:
        raise ConfigError(path, 1, "", "values nested too deeply", "a file nested a few levels deep") from None
    return Located(path, data, lines, text)


def _plain(node: yaml.Node, where: Location, lines: dict, loader: yaml.SafeLoader, path: Path, depth: int) -> Any:
    lines.setdefault(where, node.start_mark.line + 1)
    if depth > 30:
        raise ConfigError(path, node.start_mark.line + 1, show_location(where), "values nested over 30 deep", "less")
    if isinstance(node, yaml.SequenceNode):
        return [_plain(item, (*where, i), lines, loader, path, depth + 1) for i, item in enumerate(node.value)]
    if not isinstance(node, yaml.MappingNode):
        return _scalar(node, where, loader, path)
    result = {}
    for key_node, value_node in node.value:
        key, line = str(key_node.value), key_node.start_mark.line + 1
        if key in result:
            raise ConfigError(path, line, show_location(where), f"the key '{key}' a second time", "each key once")
        lines[(*where, key)] = line
        result[key] = _plain(value_node, (*where, key), lines, loader, path, depth + 1)
    return result


def _scalar(node: yaml.ScalarNode, where: Location, loader: yaml.SafeLoader, path: Path) -> Any:
    try:
        value = loader.construct_object(node)
    except (yaml.YAMLError, ValueError) as error:
        problem = getattr(error, "problem", None) or str(error)
        raise ConfigError(path, node.start_mark.line + 1, show_location(where), problem, "a plain value") from None
    if value is None or isinstance(value, (str, int, float, bool)):
        return value
    return node.value  # dates and the like stay as they were written


T = TypeVar("T")


def validate(located: Located, model: type[T], context: Mapping[str, Any] | None = None) -> T:
    """The typed, frozen object of a file. Raises ConfigError for the first thing that does not fit."""
    import pydantic

    try:
        return model.model_validate(located.data, context=dict(context or {}))
    except pydantic.ValidationError as error:
        raise _first_error(located, error) from None


def _first_error(located: Located, error: Any) -> ConfigError:
    problems = error.errors(include_url=False)
    # a misspelt key also leaves the right one missing: name the misspelling, it is what the user wrote
    problem = next((p for p in problems if p["type"] == "extra_forbidden"), problems[0])
    where = tuple(part for part in problem["loc"] if _in_file(located.data, part, problem))
    kind, context = problem["type"], problem.get("ctx", {})
    if kind == "extra_forbidden":
        return located.error(where, f"an unknown key '{problem['loc'][-1]}'", "only keys that the schema knows")
    if kind == "missing":
        return located.error(where[:-1], "nothing", f"the key '{problem['loc'][-1]}'")
    message = str(context.get("error", problem["msg"]))
    if message.startswith("found ") and ", expected " in message:
        found, expected = message[6:].split(", expected ", 1)
        return located.error(where, found, expected)
    value = problem.get("input")
    shown = repr(value) if not isinstance(value, (dict, list)) else ("a mapping" if isinstance(value, dict) else "a list")
    expected = message[0].lower() + message[1:]
    for lead in ("input should be ", "value should be "):
        expected = expected.removeprefix(lead)
    return located.error(where, shown, expected)


def _in_file(data: Any, part: str | int, problem: dict) -> bool:
    # pydantic puts names of union members into the location; only what the file has is a place in it
    return not (isinstance(part, str) and ("[" in part or part.startswith("function-")))
