"""A rig file's text with other gains: only the numbers change, comments and layout stay."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from epa_rt.tune.controller import JOINT, Gains, TuneError

if TYPE_CHECKING:
    from yaml import MappingNode, Node

# key of the rig file's section: field of Gains, unit as written
JOINT_KEYS = {
    "kp": ("kp", ""),
    "ki": ("ki", "1/s"),
    "kd": ("kd", "s"),
    "derivative_cutoff": ("derivative_cutoff_hz", "Hz"),
    "output_cutoff": ("output_cutoff_hz", "Hz"),
    "feedforward": ("feedforward", ""),
    "feedforward_speed": ("feedforward_speed_s", "s"),
    "feedforward_acceleration": ("feedforward_acceleration_s2", "s^2"),
}
MOTOR_KEYS = {"position_gain": ("kp", "1/s")}
SECTIONS = {JOINT: ("joint", "pid"), "motor": ("motor",)}


def keys_of(kind: str) -> dict[str, tuple[str, str]]:
    """Keys of the rig file that hold the gains of a loop: field of Gains and unit."""
    return JOINT_KEYS if kind == JOINT else MOTOR_KEYS


def written(gains: Gains, kind: str) -> dict[str, str]:
    """The gains by key as a rig file holds them: '4 1/s'. What is infinite has no key."""
    texts = {}
    for key, (field, unit) in keys_of(kind).items():
        value = float(getattr(gains, field))
        if value - value == 0.0:
            texts[key] = f"{value:.6g} {unit}".strip()
    return texts


def text_with(text: str, kind: str, gains: Gains) -> str:
    """The rig file's text with these gains. Raises TuneError where it has not the section."""
    import yaml

    node: Node | None = yaml.compose(text)
    for key in SECTIONS[kind]:
        node = dict(_pairs(node)).get(key)
    if not isinstance(node, yaml.MappingNode):
        place = ".".join(SECTIONS[kind])
        raise TuneError(f"found a rig file without '{place}', expected one with the gains in it")
    section = dict(_pairs(node))
    new, missing = [], []
    for key, value in written(gains, kind).items():
        if key in section:
            start, stop = section[key].start_mark.index, section[key].end_mark.index
            new.append((start, stop, value))
        else:
            missing.append(f"{key}: {value}")
    if missing:
        new.append(_insertion(text, node, missing))
    for start, stop, value in sorted(new, reverse=True):
        text = text[:start] + value + text[stop:]
    return text


def _pairs(node: "Node | None") -> "Iterator[tuple[str, Node]]":
    """Keys and nodes of a mapping; nothing of any other node."""
    import yaml

    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            yield str(key.value), value


def _insertion(text: str, node: "MappingNode", lines: list[str]) -> tuple[int, int, str]:
    """Where keys that the file lacks go: behind the last one of the section, in its own style."""
    last_key, last = node.value[-1]
    at = last.end_mark.index
    if node.flow_style:
        return at, at, "".join(f", {line}" for line in lines)
    margin = " " * last_key.start_mark.column
    at = len(text[:at].rstrip())  # the mark of a block scalar may stand on the next line
    end = text.find("\n", at)
    end = len(text) if end < 0 else end  # behind a comment on the same line
    return end, end, "".join(f"\n{margin}{line}" for line in lines)
