"""Compiles what a run and a diagnosis compile, so that the first of each does not wait for it: the
plant, its links and every effect of the catalogue, on the bench, the knee and the mass.

Numba keeps it beside the sources; a change of them makes it again. env.sh calls this when it makes
an environment.
"""

import sys
import time
from pathlib import Path

import numpy as np

from epa_rt.gap.recording import Recording, Span
from epa_rt.gap.rig.subjects import open_subject
from epa_rt.models.groups import groups_of
from sim_backend.backend import SimBackend

ROOT = Path(__file__).resolve().parent.parent
RIGS = ("bench.yaml", "knee.yaml", "mass.yaml")
CYCLES = 200


def blank(subject) -> Recording:
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


def compile_all(rig: Path) -> None:
    """Every link of a rig with each effect in each of its shapes, and its run for each set of
    groups of effects.
    """
    subject = open_subject(rig, None)
    SimBackend(subject.rig, subject.plant, 1, None).model.warm_up()
    recording = blank(subject)
    prepared = subject.prepare(recording)
    shapes = [
        {},
        *(
            dict(zip(effect.knobs, start, strict=True))
            for effect in subject.catalogue
            for start in effect.starts
        ),
    ]
    for link in subject.links:
        subject.features(prepared, link.name)
    for values in shapes:
        for link in subject.links:
            subject.residual(prepared, values, link.name)
    subject.free_run(recording, {}, 1)
    together = {key: value for values in shapes for key, value in values.items()}
    of_groups = {groups_of(subject.params(values)): values for values in (*shapes, together)}
    for run in filter(None, (subject, *(subject.rougher(far) for far in (False, True)))):
        for values in of_groups.values():
            run.free_run(recording, values, None)


def main() -> None:
    began = time.perf_counter()
    for name in RIGS:
        compile_all(ROOT / "config" / "rigs" / name)
    print(
        f"compiled the plant and its links in {time.perf_counter() - began:.0f} s", file=sys.stderr
    )


if __name__ == "__main__":
    main()
