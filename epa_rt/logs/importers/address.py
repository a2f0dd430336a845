"""Where a number stands in a message or in a line of JSON: 'a.b[2]', 'position[knee]'."""

import re
from typing import Any, NamedTuple

import numpy as np

_PART = re.compile(r"([^.\[\]]+)((?:\[[^\[\]]*\])*)(?:\.|$)")
_BRACKET = re.compile(r"\[([^\[\]]*)\]")
_NAME_LISTS = ("name", "names", "joint_names")
"""Fields that name the elements of the lists beside them, as sensor_msgs/JointState has one."""


class Element(NamedTuple):
    """An element of a list, by the name that the list of names beside it gives."""

    name: str


class NoSuchPlace(Exception):
    """Why an address leads nowhere; the words follow 'found'."""


def steps_of(address: str) -> tuple[str | int | Element, ...]:
    """('a', 'b', 2) of 'a.b[2]'; a name in brackets becomes an Element.

    Raises NoSuchPlace where the text is no address.
    """
    steps: list[str | int | Element] = []
    at = 0
    while at < len(address):
        match = _PART.match(address, at)
        if match is None:
            raise NoSuchPlace("an address that is none")
        steps.append(match[1])
        for inner in _BRACKET.findall(match[2]):
            steps.append(int(inner) if inner.isascii() and inner.isdigit() else Element(inner))
        at = match.end()
    return tuple(steps)


def value_at(content: Any, address: str, steps: tuple[str | int | Element, ...]) -> Any:
    """What stands at an address; a key that is the whole address goes first ('motor.pos').

    Gives None for a field that is not there. Raises NoSuchPlace for an element that is not.
    """
    if isinstance(content, dict) and address in content:
        return content[address]
    value, parent = content, content
    for step in steps:
        if isinstance(step, str):
            parent, value = value, _field(value, step)
        else:
            value = _element(value, step, (parent, content))
    return value


def _field(value: Any, name: str) -> Any:
    """A dict's or a message object's; None where it has none."""
    return value.get(name) if isinstance(value, dict) else getattr(value, name, None)


def _element(values: Any, step: int | Element, holders: tuple[Any, ...]) -> Any:
    if isinstance(values, (dict, str, bytes)) or not hasattr(values, "__len__"):
        raise NoSuchPlace(f"no element {_shown(step)}, for there is no list")
    if isinstance(step, Element):
        step = _index_of(step.name, holders)
    if step >= len(values):
        raise NoSuchPlace(f"no element {step} in a list of {len(values)}")
    return values[step]


def _shown(step: int | Element) -> str:
    return repr(step.name[:40]) if isinstance(step, Element) else str(step)


def _index_of(name: str, holders: tuple[Any, ...]) -> int:
    seen: list[str] = []
    for holder in holders:
        for field in _NAME_LISTS:
            names = _field(holder, field)
            if isinstance(names, str) or not hasattr(names, "__iter__"):
                continue
            seen = [str(one) for one in names]
            if name in seen:
                return seen.index(name)
    raise NoSuchPlace(
        f"no name {name[:40]!r} among {', '.join(seen[:8])[:120] or 'names, for there are none'}"
    )


def number_of(value: Any) -> int | float | None:
    """A number as int or float, a stamp of seconds and nanoseconds in whole ns; else None."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, (bool, int, float)):
        return value
    whole, rest = (_field(value, word) for word in ("sec", "nanosec"))
    if isinstance(whole, int) and isinstance(rest, int):
        return whole * 1_000_000_000 + rest
    return None
