"""What the name of a column says: its part in the loop, its quantity, its unit."""

import re
from typing import NamedTuple

from epa_rt.logs.importers.guess.units import Unit, against_of, unit_of

_BRACKETS = re.compile(r"[\[\(<{]\s*([^\[\]\(\)<>{}]+?)\s*[\]\)>}]")
_PARTS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+|[^\W\d_]+")

QUANTITIES: dict[str, tuple[str, ...]] = {
    word: quantities
    for words, quantities in (
        ("angle ang theta phi alpha beta gamma psi qpos yaw pitch roll rotation azimuth winkel",
         ("angle",)),
        ("q joint encoder enc jpos qm qg qr", ("angle", "length")),
        ("pos position positions lage present", ("angle", "length")),
        ("x y z loc location height", ("length", "angle")),
        ("travel stroke displacement disp elongation extension distance dist laser weg stretch"
         " contraction length", ("length",)),
        ("speed vel velocity velocities qvel dq qdot geschwindigkeit xdot dx",
         ("turning", "speed")),
        ("qd xd", ("turning", "speed", "angle", "length")),
        ("v", ("turning", "speed", "voltage")),
        ("omega gyro dtheta thetadot w rpm", ("turning",)),
        ("force forces kraft loadcell fx fy fz f cell druckkraft", ("force",)),
        ("torque torques tau trq tq moment tx ty tz drehmoment mx my mz", ("torque",)),
        ("effort efforts", ("torque", "force")),
        ("load", ("raw", "force", "torque")),
        ("pressure press druck", ("pressure",)),
        ("p", ("pressure", "length", "angle")),
        ("current curr cur amps iq strom motorcurrent", ("current",)),
        ("i", ("current", "raw")),
        ("voltage volt volts vbat vin supply battery spannung pwmvoltage", ("voltage",)),
        ("temp temperature temperatures temperatur", ("temperature",)),
        ("freq frequency", ("frequency",)),
        ("mass", ("mass",)),
        ("pwm duty gain ratio", ("ratio",)),
        ("status state word mode error err fault flag flags counter count id seq raw adc control"
         " statusword controlword code", ("raw",)),
        ("valve inlet exhaust", ("valve", "ratio", "pressure")),
        ("enable enabled on brake switch active running", ("switch",)),
    )
    for word in words.split()
}  # fmt: skip
_COMPOUND = 5  # letters from which a quantity's word at the end of a longer one is that word
_STEMS = ("positions", "angles", "pressures", "currents", "voltages", "speeds")


def _set(words: str) -> frozenset[str]:
    return frozenset(words.split())


_COMMANDS = _set("cmd command commanded commands ctrl control controlword")
_LIKELY_COMMANDS = _set("action goal target tgt u asked demand input")
_REFERENCES = _set("ref reference refs")
_EITHER = _set("des desired setpoint sp soll wanted set goalpos")
_CLOCKS = _set(
    "t time timestamp timestamps stamp tijd zeit clock tim elapsed millis micros seconds secs sec"
    " temps tiempo times datetime"
)
_COUNTERS = _set("index idx step frame sample k n row nr no unnamed seq iteration iter tick ticks")
_TRIALS = _set(
    "trial trials lap run episode ep rep repetition cycle segment test experiment phase pass batch"
    " session versuch"
)
_UNIT_WORDS = _set(
    "volts amps amperes newtons rpm psi psig psia kpa radians degrees celsius kelvin"
    " mbar millivolts"
)
_JOINTS = _set("joint knee hip elbow ankle wrist shoulder motor servo arm")


# no compounds: words with a meaning of their own
_WHOLE = frozenset(
    (
        *QUANTITIES,
        *_STEMS,
        *(_COMMANDS | _LIKELY_COMMANDS | _REFERENCES | _EITHER | _CLOCKS | _COUNTERS | _TRIALS),
        *(_UNIT_WORDS | _JOINTS),
    )
)


class Words(NamedTuple):
    """What a name says. ``quantities``: those that it may mean, the likeliest first; ``unit``: as
    it is written into the name; ``part``: 'measured', 'command', 'likely command', 'reference',
    'either' of the two, 'actual', 'clock', 'counter', 'trial'; ``sure``: no letter or word with two
    meanings stands for it.
    """

    quantities: tuple[str, ...]
    unit: Unit | None
    part: str
    sure: bool
    tokens: tuple[str, ...]
    against: str


def words_of(name: str) -> Words:
    """Reads a column's name, such as 'cmd_pos [mm]', 'jointVel_deg_s', '/joint/position[knee]'."""
    unit, rest = _bracketed(name)
    tokens = [word for part in _PARTS.findall(rest) for word in _apart(part.lower())]
    if unit is None:
        unit, tokens = _trailing(rest, tokens)
    if unit is None:
        unit = next((unit_of(token) for token in tokens if token in _UNIT_WORDS), None)
    quantities, sure = _quantities(tokens)
    against = against_of(tokens) or (unit.against if unit is not None else "")
    return Words(quantities, unit, _part(tokens), sure, tuple(tokens), against)


def _apart(token: str) -> tuple[str, ...]:
    """A compound's words where the last one is a quantity: 'sollposition', 'motorkraft'."""
    if token in _WHOLE:
        return (token,)
    ends = [one for one in QUANTITIES if len(one) >= _COMPOUND and token.endswith(one)]
    longest = max(ends, key=len, default="")
    head = token.removesuffix(longest)
    return (head, longest) if longest and len(head) > 1 else (token,)


def _bracketed(name: str) -> tuple[Unit | None, str]:
    for match in _BRACKETS.finditer(name):
        unit = None if match[1].isdigit() else unit_of(match[1])
        if unit is not None:
            return unit, name[: match.start()] + " " + name[match.end() :]
    head, slash, tail = name.rpartition("/")
    if slash and head and not name.startswith("/"):
        unit = unit_of(tail)
        if unit is not None:
            return unit, head
    return None, name


def _trailing(rest: str, tokens: list[str]) -> tuple[Unit | None, list[str]]:
    """A unit at the end of the name, 'pos_mm', 'speed_rad_s', 'omega_deg_per_s'."""
    parts = [part for part in re.split(r"[_\s.\-]+", rest) if part]
    for count in (3, 2, 1):
        if len(parts) > count:
            text = "_".join(parts[-count:])
            unit = unit_of(text)
            if unit is not None and (
                count == 1 or "/" in unit.text or "*" in unit.text or unit.against
            ):
                left = [p.lower() for p in _PARTS.findall(" ".join(parts[:-count]))]
                return unit, left
    camel = re.fullmatch(r".*[a-z](Ms|Us|Ns|Deg|Rad|Mm|Nm|Kpa|Bar|Psi|Rpm)", rest)
    if camel:
        return unit_of(camel[1]), tokens[:-1]
    return None, tokens


def _quantities(tokens: list[str]) -> tuple[tuple[str, ...], bool]:
    """The last word that names a quantity counts: 'motor current', 'pressure valve' aside."""
    found: list[tuple[tuple[str, ...], bool]] = []
    for token in tokens:
        word = token.removesuffix("s") if token in _STEMS else token
        if word in QUANTITIES:
            found.append((QUANTITIES[word], len(word) > 1))
    if not found:
        return (), False
    strong = [one for one in found if one[1]] or found
    kinds = [one for one in strong if one[0] != ("raw",)]
    quantities, sure = (kinds or strong)[-1]
    if _JOINTS & set(tokens) and "angle" in quantities and quantities[0] == "length":
        quantities = tuple(sorted(quantities, key=lambda one: one != "angle"))
    return quantities, sure and len(quantities) == 1


def _part(tokens: list[str]) -> str:
    if not tokens:
        return "measured"
    for words, part in (
        (_COMMANDS, "command"),
        (_LIKELY_COMMANDS, "likely command"),
        (_REFERENCES, "reference"),
        (_EITHER, "either"),
    ):
        if any(token in words for token in tokens):
            return part
    if tokens[-1] in _TRIALS or tokens[0] in _TRIALS and len(tokens) <= 2:
        return "trial"
    if tokens[0] in _CLOCKS and len(tokens) <= 2 or tokens[-1] in _CLOCKS - {"t"}:
        return "clock"
    if tokens[0] in _COUNTERS and len(tokens) <= 2:
        return "counter"
    return "actual" if tokens == ["act"] else "measured"
