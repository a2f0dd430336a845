"""Compiles what a run and a diagnosis compile, so that the first of each does not wait for it: the
plant, its links and every effect of the catalogue, on the bench, the knee and the mass.

Numba keeps it beside the sources; a change of them makes it again. env.sh calls this when it makes
an environment. Two processes share the bench, then one asks all of it of every rig: what both
compiled at once, and one of them lost, is made again there.
"""

import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from epa_rt.gap.recording import Recording, Span
from epa_rt.gap.rig.house.subject import HouseSubject
from epa_rt.gap.rig.subjects import open_subject
from epa_rt.models.groups import groups_of
from sim_backend.backend import SimBackend

ROOT = Path(__file__).resolve().parent.parent
RIGS = ("bench.yaml", "knee.yaml", "mass.yaml")
CYCLES = 200


def blank(subject: HouseSubject) -> Recording:
    """A recording of a rig that reads zero and is told nothing."""
    names = [row.name for row in (*subject.rig.signals, *subject.rig.outputs)]
    cycles = np.arange(CYCLES)
    return Recording(
        "blank",
        "",
        subject.rig.name,
        "",
        "",
        subject.rig.period_s,
        cycles,
        {name: np.zeros(CYCLES) for name in names},
        (Span("rest", 0, CYCLES, True),),
    )


def shapes_of(subject: HouseSubject) -> list[dict[str, float]]:
    """Every effect in each of its shapes, and none."""
    return [
        {},
        *(
            dict(zip(effect.knobs, start, strict=True))
            for effect in subject.catalogue
            for start in effect.starts
        ),
    ]


def compile_links(subject: HouseSubject) -> None:
    """Every link with each effect."""
    prepared = subject.prepare(blank(subject))
    for link in subject.links:
        subject.features(prepared, link.name)
    for values in shapes_of(subject):
        for link in subject.links:
            subject.residual(prepared, values, link.name)


def compile_seeded_run(subject: HouseSubject) -> None:
    """A free run with noise; the parts that all runs share come with it."""
    subject.free_run(blank(subject), {}, 1)


def compile_simulated_rig(subject: HouseSubject) -> None:
    """The rig that epa run simulates."""
    SimBackend(subject.rig, subject.plant, 1, None).model.warm_up()


def compile_free_runs(subject: HouseSubject) -> None:
    """A free run for each set of groups of effects that are on, as fine and as rough as fits."""
    recording, shapes = blank(subject), shapes_of(subject)
    together = {key: value for values in shapes for key, value in values.items()}
    of_groups = {groups_of(subject.params(values)): values for values in (*shapes, together)}
    for run in filter(None, (subject, *(subject.rougher(far) for far in (False, True)))):
        for values in of_groups.values():
            run.free_run(recording, values, None)


PARTS = (compile_links, compile_seeded_run, compile_simulated_rig, compile_free_runs)
AT_ONCE = ((compile_links, compile_seeded_run), (compile_simulated_rig, compile_free_runs))


def of_rig(name: str, *parts: Callable[[HouseSubject], None]) -> None:
    """These parts of one rig file."""
    subject = open_subject(ROOT / "config" / "rigs" / name, None)
    assert isinstance(subject, HouseSubject)
    for part in parts:
        part(subject)


def main() -> None:
    began = time.perf_counter()
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        for pair in AT_ONCE:
            list(pool.map(of_rig, [RIGS[0]] * len(pair), pair))
    for name in RIGS:
        of_rig(name, *PARTS)
    print(
        f"compiled the plant and its links in {time.perf_counter() - began:.0f} s", file=sys.stderr
    )


if __name__ == "__main__":
    main()
