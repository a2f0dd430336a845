"""Making blind cases: worker processes that record, one after the other, and the seal over what
they hid.
"""

import json
import shutil
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING
from zlib import crc32

from epa_rt.cli.exits import FAILED, VerbError
from epa_rt.cli.gap.blind.places import PARTS
from epa_rt.cli.gap.blind.side_by_side import side_by_side
from epa_rt.cli.write import write_whole

if TYPE_CHECKING:
    import numpy as np

    from sim_backend.backend import SimBackend
    from sim_backend.stand_in.draw import Spec

REDRAWS = 6
REDRAW_SEED = 1000003  # between the seeds of one draw and the next


def make_all(
    seed: int,
    cases: int,
    kinds: tuple[str, ...],
    out: Path,
    sealed: Path,
    config: Path,
    jobs: int,
    laws: int,
    short: bool = False,
) -> None:
    """Draws, records and seals; ends with one line on standard output. ``laws``: which of the
    hidden formulas, 1 to 6. ``short``: trials of a quarter of the length where much is excited.
    """
    from epa_rt.benchmark.plans import RICH, SHORT
    from sim_backend.stand_in.draw import draw

    specs = draw(seed, cases, kinds, laws)
    if short:
        specs = [s._replace(plan=SHORT) if s.plan == RICH else s for s in specs]
    record_all(seed, specs, out, sealed, config, jobs)


def make_each(
    seed: int, multiple: float, out: Path, sealed: Path, config: Path, jobs: int, laws: int
) -> None:
    """Every hidden effect that has a name, alone, on every rig that shows it; one that cannot be
    that strong is recorded half as strong.
    """
    from sim_backend.stand_in.draw import each_alone

    record_all(seed, each_alone(multiple, laws), out, sealed, config, jobs, weaker=True)


def make_matrix(seed: int, out: Path, sealed: Path, config: Path, jobs: int, of: str) -> None:
    """One withheld case for every hidden effect; ``of`` "catalogue": for every other effect of the
    catalogue, by its own law.
    """
    from sim_backend.stand_in.draw import one_of_each, one_of_the_others

    own = of == "catalogue"
    record_all(
        seed, one_of_the_others() if own else one_of_each(), out, sealed, config, jobs, weaker=own
    )


def check_matrix(seed: int, out: Path, sealed: Path, of: str) -> None:
    """That what was made is what is asked for. Opens the truth; raises VerbError, SealError."""
    from epa_rt.benchmark.seal import opened

    truth = opened(sealed, out)
    made = (
        truth["seed"],
        "catalogue" if any(case["same_law"] for case in truth["cases"]) else "stand_in",
    )
    if made != (seed, of):
        raise VerbError(
            f"{out}: found cases of --seed {made[0]} --of {made[1]}, expected those of --seed"
            f" {seed} --of {of}; give these, or another folder (-o)"
        )


def record_all(
    seed: int,
    specs: "list[Spec]",
    out: Path,
    sealed: Path,
    config: Path,
    jobs: int,
    weaker: bool = False,
) -> None:
    """Records every case in a process of its own and seals the truth. ``weaker``: what does not fit
    is made half as strong, not drawn again.

    Until then each case's truth lies beside the seal, so that a making that was interrupted goes on
    where it was.
    """
    from epa_rt.benchmark.seal import seal
    from sim_backend.stand_in.draw import KINDS

    began_s = time.monotonic()
    out.mkdir(parents=True, exist_ok=True)
    parts = sealed / PARTS
    parts.mkdir(parents=True, exist_ok=True)
    sealed.chmod(0o700)
    truths = list(
        side_by_side(
            jobs, _one, [(seed, spec, out, config, parts, weaker) for spec in specs], "cases made"
        )
    )
    truths = [truth for truth in truths if truth is not None]
    truths.sort(key=lambda truth: truth["case"])
    found = seal({"seed": seed, "cases": truths}, sealed, out)
    counts = {kind: sum(t["kind"] == kind for t in truths) for kind in KINDS}
    shutil.rmtree(parts)
    seconds = time.monotonic() - began_s
    print(
        f"{len(truths)} cases in {seconds:.0f} s:"
        f" {', '.join(f'{n} {kind}' for kind, n in counts.items() if n)}; truth in {sealed}, sha256"
        f" {found[:16]}"
    )


def _one(
    seed: int, spec: "Spec", out: Path, config: Path, parts: Path, weaker: bool = False
) -> "dict | None":
    """One case; where its candidates do not fit, the next draw of the same kind, or (``weaker``)
    the same one half as strong. None where nothing fits.
    """
    from sim_backend.stand_in.make import make_case
    from sim_backend.stand_in.strengths import Unfit

    path, reason = out / f"case_{spec.index:03d}", ""
    part = (
        parts / f"{seed}-{path.name}-{crc32(repr(spec).encode()):08x}.json"
    )  # another draw of the same seed is no part of this one
    if part.exists() and (path / "case.json").exists():
        return json.loads(part.read_text(encoding="utf-8"))
    for turn in range(REDRAWS if spec.kind != "same_law" else 2):
        try:
            truth = {
                **make_case(seed + REDRAW_SEED * turn, spec, path, config, _record),
                "redrawn": turn,
            }
            write_whole(part, json.dumps(truth))
            return truth
        except Unfit as error:
            reason = str(error)
            shutil.rmtree(path, ignore_errors=True)
            spec = (
                spec._replace(multiple=0.5 * spec.multiple)
                if weaker
                else _another(spec, seed + REDRAW_SEED * (turn + 1))
            )
    print(f"\n{path.name}: left out ({reason})", file=sys.stderr)
    return None


def record_again(cases: Path, sealed: Path, config: Path, jobs: int) -> None:
    """The logs of a sealed set where they are not, as they were; ends with one line on standard
    output. Raises VerbError, SealError.
    """
    from epa_rt.benchmark.seal import opened

    truth = opened(sealed, cases)
    missing = [one for one in truth["cases"] if not (cases / one["case"] / "case.json").exists()]
    asked = [(truth["seed"], one, cases, config) for one in missing]
    for _ in side_by_side(jobs, _again, asked, "cases recorded"):
        pass
    there = len(truth["cases"]) - len(missing)
    print(f"{cases}: {len(missing)} cases recorded, {there} were there")


def _again(seed: int, truth: dict, out: Path, config: Path) -> None:
    from sim_backend.stand_in.make import make_again
    from sim_backend.stand_in.strengths import Unfit

    path = out / truth["case"]
    try:
        make_again(seed + REDRAW_SEED * truth["redrawn"], truth, path, config, _record)
    except Unfit as error:
        shutil.rmtree(path, ignore_errors=True)
        raise VerbError(str(error)) from None


def _another(spec: "Spec", seed: int) -> "Spec":
    """What is made where a case does not fit: the next draw of its kind."""
    from sim_backend.stand_in.draw import draw

    again = draw(seed, 40, (spec.kind,), spec.laws)
    fitting = [other for other in again if other.rig == spec.rig] or again
    same = {"index": spec.index, "noise": spec.noise, "multiple": spec.multiple, "plan": spec.plan}
    return fitting[0]._replace(**same)


class _Listener:
    """Takes the recorder's place where only what was sent is wanted."""

    failure = None

    def __init__(self) -> None:
        self.outputs: list[bytes] = []

    def sample(self, *values: object) -> None:
        self.outputs.append(bytes(values[10]))

    def event(self, *_: object, **__: object) -> None: ...

    def poll(self, _: int) -> int:
        return 0


def _record(
    experiment: Path, rig: Path, plant: Path, backend: "SimBackend", log: Path | None
) -> "tuple[str, np.ndarray]":
    """One run through the whole loop; the log carries the plant that is believed, and nothing of
    the one behind the bytes.

    Raises KeyboardInterrupt where the operator stopped it and VerbError where its recorder failed:
    neither is a trip of the rig, by which a case would change.
    """
    import numpy as np

    from epa_rt.cli.inputs import load_inputs
    from epa_rt.cli.run import run_recorded

    inputs = load_inputs(experiment, rig, plant, with_plant=True, protected=False)
    if log is None:
        from epa_rt.loop.assembly import assemble
        from epa_rt.loop.run import run

        a, listener = assemble(inputs.rig, inputs.experiment), _Listener()
        result = run(
            a.rig, backend, a.supervisor, a.envelope, a.decoder, a.encoder, listener, listener
        )
        return result.outcome, np.frombuffer(b"".join(listener.outputs), np.uint8).reshape(
            len(listener.outputs), -1
        )
    facts = {
        "rig": inputs.rig.name,
        "experiment": inputs.experiment.name,
        "plant": inputs.plant.name,
        "backend": "sim",
        "seed": "0",
        "speed": "unpaced",
        "period_s": f"{inputs.rig.period_s:g}",
    }
    summary, result = run_recorded(inputs, backend, log, facts, paced=False, progress=False)
    if result.outcome == "stopped":
        raise KeyboardInterrupt  # the run itself took the operator's Ctrl-C
    if summary.failure:
        raise VerbError(f"recorder: {summary.failure}", FAILED)
    return result.outcome, np.zeros((0, 0), np.uint8)
