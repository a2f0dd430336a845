"""Whether links that are off together share a wrong length: play, slip or a spool that is not round feeds all that a line's length feeds.

No law is asked: an error of length that hangs on the motor's travel, its direction and its memory, or on the line's pull, moves each link by
that link's own slope over length. Where one such error explains what two links show, the place is what makes the length.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from epa_rt.gap.diagnosis import Place
from epa_rt.gap.floor import Floor
from epa_rt.gap.localise import unbiased
from epa_rt.gap.stop_operator import stop_over_log
from epa_rt.gap.subject import Subject, Values

HALVES = (0.002, 0.005, 0.01, 0.02, 0.05)   # half widths of memories, as parts of the travel's range
TURNS = (1, 2, 3)
OF_TRAVEL = 3 + 2 * len(TURNS) + len(HALVES)   # columns of ``_of_travel``
STEP_M = 1e-5
RIDGE = 1e-4            # per sample
SHARED, OWN = 0.6, 0.15  # of all excess over noise that one error of length must explain, and of each link's
MOSTLY = 0.5            # of what an error of length of a link's own would explain there
WOUND = 0.5             # of what travel and pull explain together that travel alone must: play 0.99, straps that give way 0.14, 0.25 and 0.27


class Line(NamedTuple):
    """Links that one length feeds, and link and name of the states that an error of it may hang on: the motor's travel, the line's pull.
    ``winds``, ``gives``: blocks that make such an error, by the travel alone or where the pull has a part in it."""

    links: tuple[str, ...]
    travel: tuple[str, str]
    pull: tuple[str, str]
    winds: str = "transmission"
    gives: str = "muscle"


def share_a_length(subject: Subject, prepared: Mapping[str, object], values: Values, floors: Mapping[str, Floor], line: Line, knob: str) -> str | None:
    """Block that makes the one error of length which explains what a line's links show at ``values``; None where none does.

    ``knob``: key of a number that shifts their length, in m.
    """
    def shapes(one: object) -> np.ndarray:
        travel = _of_travel(subject.features(one, line.travel[0])[line.travel[1]])
        pull = subject.features(one, line.pull[0]).get(line.pull[1])
        return travel if pull is None else np.column_stack([travel, _of_pull(pull)])

    made = [_normal(subject, prepared, values, floors[link], link, knob, shapes) for link in line.links]
    explained = _by_one_error(made)
    if explained is None:
        return None
    by_travel = _by_one_error([(matrix[:OF_TRAVEL, :OF_TRAVEL], right[:OF_TRAVEL], *rest) for matrix, right, *rest in made])
    return line.winds if by_travel is not None and by_travel > WOUND * explained else line.gives


def _by_one_error(made: Sequence[tuple]) -> float | None:
    """Chi-square that one error of length explains of several links' normal equations; None where it is not what they share."""
    excess = [square - samples for _, _, square, samples in made]
    if len(made) < 2 or min(excess) <= 0.0:
        return None
    matrix, right = sum(m for m, *_ in made), sum(b for _, b, *_ in made)
    shared = solved(matrix, right, sum(samples for *_, samples in made))
    explained = [float(2.0 * b @ shared - shared @ m @ shared) for m, b, *_ in made]
    alone = [float(b @ solved(m, b, samples)) for m, b, _, samples in made]
    shared_by_all = sum(explained) > SHARED * sum(excess) and all(
        part > max(OWN * whole, MOSTLY * own) for part, whole, own in zip(explained, excess, alone, strict=True))
    return sum(explained) if shared_by_all else None


def length_first(subject: Subject, prepared: Mapping[str, object], points: Sequence[Values], floors: Mapping[str, Floor], places: Sequence[Place]) -> tuple[Place, ...]:
    """``places`` with what makes a line's length first, where the links of that line share a wrong one at any of the ``points``. ``subject.lines``,
    where it has any: a number that shifts a line's length to that line."""
    for knob, line in (getattr(subject, "lines", None) or {}).items():
        if not all(link in floors for link in line.links):
            continue
        for values in points:
            block = share_a_length(subject, prepared, values, floors, line, knob)
            if block is not None:
                return _with_first(places, block, line)
    return tuple(places)


def _with_first(places: Sequence[Place], block: str, line: Line) -> tuple[Place, ...]:
    """A block's own place first; where it has none, that of the line's links which shows most, in its name."""
    own = [place for place in places if place.block == block and place.link in line.links]
    if own:
        return (*own, *(place for place in places if place not in own))
    return (replace(max((place for place in places if place.link in line.links), key=lambda place: place.significance), block=block), *places)


def solved(matrix: np.ndarray, right: np.ndarray, samples: int) -> np.ndarray:
    """Factors (k,) of normal equations (k, k), (k,) over so many samples, held a little so that columns may be alike."""
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-30))
    return np.linalg.solve(matrix / np.outer(scale, scale) + RIDGE * np.eye(len(right)), right / scale) / scale


def beyond_the_joint(subject: Subject, prepared: Mapping[str, object], values: Values, floor: Floor, link: str) -> float:
    """Significance of what a link shows beyond an error of length that hangs on the joint's angle: a lever's, a joint sensor's.

    ``subject.joint``: a number that shifts the line's length, and link and name of the joint's angle among the features.
    """
    knob, at, name = subject.joint
    matrix, right, square, samples = _normal(subject, prepared, values, floor, link, knob, lambda one: _of_joint(subject.features(one, at)[name]))
    left = square - float(right @ solved(matrix, right, samples))
    return (left - samples) / float(np.sqrt(2.0 * samples)) / floor.scatter


def _of_joint(angle: np.ndarray) -> np.ndarray:
    """(n, k) powers of an angle."""
    z = (angle - np.nanmean(angle)) / max(float(np.nanstd(angle)), 1e-9)
    return np.column_stack([np.ones(len(z)), z, z**2, z**3])


def _normal(subject: Subject, prepared: Mapping[str, object], values: Values, floor: Floor, link: str, knob: str, shapes: Callable[[object], np.ndarray]):
    """Normal equations of a link over errors of length of these ``shapes``: (k, k), (k,), chi-square and samples, whitened."""
    at = subject.number(knob)
    matrix, right, square, samples = 0.0, 0.0, 0.0, 0
    for name, one in prepared.items():
        here = subject.residual(one, values, link)
        slope = (subject.residual(one, {**values, knob: at + STEP_M}, link) - here) / STEP_M
        columns = slope[:, None] * shapes(one)
        white = floor.whiten(np.column_stack([unbiased(here, floor, name), columns]))
        white = white[np.isfinite(white).all(axis=1)]
        matrix, right = matrix + white[:, 1:].T @ white[:, 1:], right + white[:, 1:].T @ white[:, 0]
        square, samples = square + float(white[:, 0] @ white[:, 0]), samples + len(white)
    return matrix, right, square, samples


def _of_travel(travel: np.ndarray) -> np.ndarray:
    """(n, k) what an error of the spool's length may hang on: travel, its turns, its direction and memories of several widths."""
    known = np.isfinite(travel)
    whole = np.where(known, travel, travel[known][0] if known.any() else 0.0)
    reach = max(float(np.ptp(whole)), 1e-9)
    z = (whole - whole.mean()) / reach
    memories = [stop_over_log(np.ascontiguousarray(z), half) / half for half in HALVES]
    turns = [f(k * whole) for k in TURNS for f in (np.sin, np.cos)]
    found = np.column_stack([np.ones(len(z)), z, z * z, *turns, *memories])
    found[~known] = np.nan
    return found


def _of_pull(force: np.ndarray) -> np.ndarray:
    """(n, k) what an error of length may hang on where the line gives way: its pull and the square of it."""
    z = (force - np.nanmean(force)) / max(float(np.nanstd(force)), 1e-9)
    return np.column_stack([z, z * z])
