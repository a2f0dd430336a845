"""YAML files read with the line of every key, and errors that say file, line, found and
expected.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar, get_args

import yaml

from epa_rt.config.kinds import MAGIC_BYTES, named_by_magic
from epa_rt.config.near_names import did_you_mean, nearest

Location = tuple[str | int, ...]

_LARGEST = 1 << 20  # bytes of a file
_MOST_VALUES = 50_000  # in one file, so that aliases of aliases cannot fill the memory
# what PyYAML lets through beside its own errors, on texts such as "\\UFFFFFFFF" or !!timestamp x
_YAML_ERRORS = (yaml.YAMLError, ValueError, ArithmeticError, LookupError, AttributeError, TypeError)


def _line_of_words(text: str, longest: int) -> str:
    """Text as part of one sentence on one line, cut where it is very long."""
    text = "".join(c if c.isprintable() else " " for c in text[: longest + 1])
    return text if len(text) <= longest else text[:longest] + "..."


class ConfigError(Exception):
    """One sentence about a file that cannot be used: ``FILE:LINE: where: found X, expected Y``."""

    def __init__(self, path: Path | str, line: int, where: str, found: str, expected: str):
        where, found, expected = (
            _line_of_words(where, 200),
            _line_of_words(found, 200),
            _line_of_words(expected, 2000),
        )
        self.path, self.line, self.where, self.found, self.expected = (
            Path(path),
            line,
            where,
            found,
            expected,
        )
        super().__init__(
            f"{path}:{line}: {where + ': ' if where else ''}found {found}, expected {expected}"
        )

    def __reduce__(self) -> tuple[Any, ...]:  # else a pool that one leaves breaks
        return ConfigError, (self.path, self.line, self.where, self.found, self.expected)

    @property
    def errors(self) -> "tuple[ConfigError, ...]":
        """Every sentence about the file; of this one, itself."""
        return (self,)


class ConfigErrors(ConfigError):
    """Several sentences about one file, at least one; as text, the first of them."""

    def __init__(self, errors: "Sequence[ConfigError]"):
        first = errors[0]
        super().__init__(first.path, first.line, first.where, first.found, first.expected)
        self._errors = tuple(errors)

    def __reduce__(self) -> tuple[Any, ...]:
        return ConfigErrors, (self._errors,)

    @property
    def errors(self) -> tuple[ConfigError, ...]:
        return self._errors


@dataclass(frozen=True)
class Located:
    """Plain data of a YAML file (dicts, lists, scalars) and the line of each key; lines count from
    1.
    """

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
    """Reads a YAML mapping with the line of every key. Raises ConfigError (unreadable, bad YAML, a
    key twice).
    """
    path = Path(path)
    try:
        with path.open("rb") as file:
            content = file.read(_LARGEST + 1)
    except FileNotFoundError:
        near = did_you_mean(path)
        raise ConfigError(path, 1, "", "no such file", f"a YAML file{near}") from None
    except IsADirectoryError:
        raise ConfigError(path, 1, "", "a folder", "a YAML file") from None
    except PermissionError:
        raise ConfigError(
            path, 1, "", "a file without permission to read it", "a readable YAML file"
        ) from None
    except OSError as error:
        raise ConfigError(
            path, 1, "", f"a file that cannot be read ({error.strerror})", "a YAML file"
        ) from None
    except ValueError:  # a zero byte in the path, which another file may have named
        raise ConfigError(path, 1, "", "a path that cannot be one", "a YAML file") from None
    if known := named_by_magic(content[:MAGIC_BYTES]):
        raise ConfigError(path, 1, "", known, "a YAML file")
    if len(content) > _LARGEST:
        raise ConfigError(path, 1, "", f"more than {_LARGEST >> 20} MB", "a YAML file")
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise ConfigError(
            path, line, "", f"bytes that are not UTF-8 text (offset {error.start})", "a YAML file"
        ) from None
    return parse_yaml(text.replace("\r\n", "\n").replace("\r", "\n"), path)


def named_file(located: Located, where: Location, path: Path) -> Path:
    """The path of a file that another names. Raises ConfigError at the place that names it where no
    such file is there.
    """
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        raise located.error(
            where, f"no such file as {path}", f"one that is there{did_you_mean(path)}"
        ) from None
    except (OSError, ValueError):
        pass  # whoever opens it says what is wrong with the name
    return path


def parse_yaml(text: str, path: Path | str) -> Located:
    """As load_yaml, from text that came from ``path`` (a log's attachment, say)."""
    path = Path(path)
    loader = None
    try:
        loader = yaml.SafeLoader(text)
        node = loader.get_single_node()
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        raise ConfigError(
            path, line, "", f"the character U+{error.character:04X}", "printable text"
        ) from None
    except RecursionError:
        raise ConfigError(
            path, loader.line + 1, "", "values nested too deeply", "a file nested a few levels deep"
        ) from None
    except _YAML_ERRORS as error:
        mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
        line = mark.line + 1 if mark else loader.line + 1
        problem = " ".join(str(getattr(error, "problem", None) or error).split())
        raise ConfigError(path, line, "", f"text that is not YAML ({problem})", "YAML") from None
    if not isinstance(node, yaml.MappingNode):
        found = "an empty file" if node is None else "a list or a single value"
        raise ConfigError(path, 1, "", found, "a mapping of keys to values")
    lines: dict[Location, int] = {}
    data = _plain(node, (), lines, loader, path, 0)
    return Located(path, data, lines, text)


def _plain(
    node: yaml.Node, where: Location, lines: dict, loader: yaml.SafeLoader, path: Path, depth: int
) -> Any:
    lines.setdefault(where, node.start_mark.line + 1)
    if depth > 30:
        raise ConfigError(
            path,
            node.start_mark.line + 1,
            show_location(where),
            "values nested over 30 deep",
            "less",
        )
    if len(lines) > _MOST_VALUES:
        raise ConfigError(
            path, node.start_mark.line + 1, "", f"more than {_MOST_VALUES} values", "fewer"
        )
    if isinstance(node, yaml.SequenceNode):
        return [
            _plain(item, (*where, i), lines, loader, path, depth + 1)
            for i, item in enumerate(node.value)
        ]
    if not isinstance(node, yaml.MappingNode):
        return _scalar(node, where, loader, path)
    result = {}
    for key_node, value_node in node.value:
        line = key_node.start_mark.line + 1
        if not isinstance(key_node, yaml.ScalarNode):
            raise ConfigError(
                path,
                line,
                show_location(where),
                "a key that is a list or a mapping",
                "a word as key",
            )
        key = str(key_node.value)
        if key in result:
            raise ConfigError(
                path, line, show_location(where), f"the key '{key}' a second time", "each key once"
            )
        lines[(*where, key)] = line
        result[key] = _plain(value_node, (*where, key), lines, loader, path, depth + 1)
    return result


def _scalar(node: yaml.ScalarNode, where: Location, loader: yaml.SafeLoader, path: Path) -> Any:
    try:
        value = loader.construct_object(node)
    except _YAML_ERRORS as error:
        problem = (
            getattr(error, "problem", None)
            or f"'{node.value}', which is no {node.tag.rsplit(':', 1)[-1]}"
        )
        raise ConfigError(
            path, node.start_mark.line + 1, show_location(where), problem, "a plain value"
        ) from None
    if value is None or isinstance(value, (str, int, float, bool)):
        return value
    return node.value  # dates and the like stay as they were written


T = TypeVar("T")


def validate(located: Located, model: type[T], context: Mapping[str, Any] | None = None) -> T:
    """The typed, frozen object of a file. Raises ConfigError for the first thing that does not
    fit.
    """
    import pydantic

    try:
        return model.model_validate(located.data, context=dict(context or {}))
    except pydantic.ValidationError as error:
        raise _first_error(located, error, model) from None


_KINDS = {
    "model_type": "a mapping of keys to values",
    "dict_type": "a mapping of keys to values",
    "tuple_type": "a list",
    "string_type": "text",
    "int_type": "a whole number",
    "float_type": "a number",
    "bool_type": "true or false",
}
_LEADS = {
    "input should be ": "",
    "value should be ": "",
    "string should ": "text to ",
    "tuple should have ": "a list of ",
}


def _first_error(located: Located, error: Any, model: Any) -> ConfigError:
    problems = error.errors(include_url=False)
    # a misspelt key also leaves the right one missing: name the misspelling, it is what the user
    # wrote
    problem = next((p for p in problems if p["type"] == "extra_forbidden"), problems[0])
    where, kind, context = (
        _place(located.data, problem["loc"]),
        problem["type"],
        problem.get("ctx", {}),
    )
    if kind == "extra_forbidden":
        key = str(problem["loc"][-1])
        near = nearest(key, _keys_at(model, problem["loc"][:-1]))
        meant = f"; did you mean '{near}'?" if near else ""
        return located.error(
            where, f"an unknown key '{key}'", f"only keys that the schema knows{meant}"
        )
    if kind == "missing":
        return located.error(where, "nothing", f"the key '{problem['loc'][-1]}'")
    if kind == "union_tag_not_found":
        return located.error(where, "nothing", f"the key {context['discriminator']}")
    if kind == "union_tag_invalid":
        key = context["discriminator"].strip("'")
        return located.error(
            (*where, key), f"'{context['tag']}'", f"one of {context['expected_tags']}"
        )
    if kind == "too_short" and context["actual_length"] == 0:
        return located.error(where, "an empty list", f"at least {context['min_length']} in it")
    message = str(context.get("error", problem["msg"]))
    if message.startswith("found ") and ", expected " in message:
        found, expected = message[6:].split(", expected ", 1)
        return located.error(where, found, expected)
    return located.error(
        where, _shown(problem.get("input")), _KINDS.get(kind) or _expected(message)
    )


def _keys_at(model: Any, location: tuple) -> set[str]:
    """The keys that a section at a pydantic location may have; where a union has several kinds of
    it, those of all.
    """
    sections = [model]
    for part in location:
        fields = [one.model_fields[part] for one in sections if part in one.model_fields]
        if fields:  # else it is a place in a list, or the name of a union's member
            sections = [one for field in fields for one in _sections_in(field.annotation)]
    return {key for one in sections for key in one.model_fields}


def _sections_in(annotation: Any) -> list[Any]:
    if hasattr(annotation, "model_fields"):
        return [annotation]
    return [one for part in get_args(annotation) for one in _sections_in(part)]


def _expected(message: str) -> str:
    text = message[0].lower() + message[1:]
    lead = next((lead for lead in _LEADS if text.startswith(lead)), "")
    return _LEADS.get(lead, "") + text.removeprefix(lead)


def _shown(value: Any) -> str:
    if isinstance(value, (dict, list)):
        return "a mapping" if isinstance(value, dict) else "a list"
    if isinstance(value, int) and abs(value) > 10**40:
        return "a whole number of over 40 digits"
    return repr(value)


def _place(data: Any, location: tuple) -> Location:
    """The part of a pydantic location that the file has; names of union members and functions are
    no place in it.
    """
    where: list[str | int] = []
    for part in location:
        if (
            isinstance(data, dict)
            and part in data
            or isinstance(data, list)
            and isinstance(part, int)
            and part < len(data)
        ):
            data = data[part]
        else:
            continue
        where.append(part)
    return tuple(where)
