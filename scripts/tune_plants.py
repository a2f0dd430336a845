"""Tunes the loops of plants drawn within engineering ranges and tries the gains on the same plants:
tracking in the full simulated rig beside the shipped gains, and margins on the plant itself.

The margins are not read off the response that the tuning saw. They come from another run in open
loop, with other lines and the plant's own angle or travel before noise and rounding. And the loop
is run with its gain doubled, which Ms <= 1.6 says that it must stand. Where present gains that
break the bound stay with a warning, the gains that it offers to hold the margin are tried too.

python scripts/tune_plants.py --plants 10 [--rigs knee bench] [--first N] [--jobs 2] [--json PATH]
"""

import argparse
import json
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
NO_WORSE = 1.0  # of the shipped gains' tracking error
STRESS = 2.0  # on the loop gain; Ms of 1.6 keeps a gain margin of 2.67
OUT_OF_HAND = 3.0  # of the shipped gains' error: a loop with its gain doubled that exceeds it rings
OPEN_GAIN = 0.01  # 1/s: within the two minutes of a run a loop this slow does nothing
# open loop, other lines than the tuning's: from Hz, to Hz, lines, period s, duration s, height
BANDS = {
    "knee": ((0.1, 1.0, 9, 20.0, 44.0, "8 mm"), (1.0, 4.9, 15, 10.0, 34.0, "3.4 mm"),
             (4.0, 13.0, 9, 4.0, 20.0, "4 mm")),
    "bench": ((0.3, 2.1, 7, 10.0, 24.0, "3 mm"), (2.2, 11.4, 8, 5.0, 14.0, "0.7 mm"),
              (11.0, 49.0, 9, 2.0, 8.0, "0.05 mm")),
}  # fmt: skip
MEAN = {"knee": "", "bench": "14 mm"}


@dataclass(frozen=True)
class Case:
    """One rig as it is tried: which loop, set up and judged by which experiment."""

    rig: str
    kind: str
    experiment: str


CASES = {
    "knee": Case("knee", "joint", "knee_chirp_short"),
    "bench": Case("bench", "motor", "identification_short"),
}


def one_plant(name: str, seed: int) -> dict[str, Any]:
    """Figures of one drawn plant: tracking and margins with shipped and proposed gains."""
    from epa_rt.tune.answer import decision_word, tuned
    from epa_rt.tune.controller import TuneError, loop_of
    from epa_rt.tune.rig_text import written

    case = CASES[name]
    inputs, base, motion = _inputs(case, seed)
    row: dict[str, Any] = {"rig": name, "seed": seed}
    shipped, own = _run(inputs, seed)
    if own != "completed":
        return {**row, "unfit": f"with the shipped gains the experiment ended {own}"}
    excited, end = _run(_exciting(inputs, case, base), seed)
    if end != "completed":
        return {**row, "failure": f"the excitation ended {end}"}
    try:
        answer = tuned([excited], inputs.rig, case.kind, motion)
    except TuneError as error:
        return {**row, "failure": str(error)}
    gains, loop = answer.after.gains, loop_of(inputs.rig, case.kind)
    after, new = _run(_with(inputs, case, gains), seed)
    stress, doubled = _run(_with(inputs, case, _louder(gains, case.kind)), seed)
    errors = [_tracking(one, loop) for one in (shipped, after, stress)]
    holding = answer.holding.gains if answer.holding else gains
    truth, before, held = _true_margins(case, inputs, shipped, (gains, loop.gains, holding), seed)
    row |= {
        "decision": decision_word(answer.proposal),
        "warned": answer.warning is not None,
        "warning": answer.warning,
        "gains": written(gains, case.kind),
        "outcomes": {"shipped": own, "proposed": new, "doubled": doubled},
        "tracking_shipped": errors[0],
        "tracking_proposed": errors[1],
        "tracking_doubled": errors[2],
        "ratio": errors[1] / errors[0],
        "expected_ratio": answer.after.trial.rms_error / answer.present.trial.rms_error,
        "stated_peak": _known(answer.after.margins.worst_peak),
        "true_peak": truth.peak,
        "true_peak_shipped": before.peak,
        "true_gain_margin": _known(truth.gain),
        "true_phase_margin_rad": _known(truth.phase_rad),
        "true_delay_margin_s": _known(truth.delay_s),
        "stable": truth.stable,
    }
    if answer.holding:
        ran, end = _run(_with(inputs, case, holding), seed)
        row["holding"] = {
            "gains": written(holding, case.kind),
            "outcome": end,
            "ratio": _tracking(ran, loop) / errors[0],
            "expected_ratio": answer.holding.trial.rms_error / answer.present.trial.rms_error,
            "true_peak": held.peak,
            "stable": held.stable,
        }
    row["tracks"] = bool(new == "completed" and row["ratio"] <= NO_WORSE)
    return {**row, "holds": _holds(row)}


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _holds(row: dict[str, Any]) -> bool:
    """Whether Ms on the plant keeps its bound and the doubled loop neither trips nor rings. Of kept
    gains only the first is asked; where the operator was warned of them, it is asked of the gains
    that were offered. An answer that nothing is known promises nothing.
    """
    from epa_rt.tune.design import MS_LIMIT

    if row["decision"] == "unknown":
        return True
    if row["warned"]:
        held = row.get("holding")
        return bool(
            held is None
            or (held["outcome"] == "completed" and held["stable"] and held["true_peak"] <= MS_LIMIT)
        )
    if row["decision"] == "keep":
        return bool(row["stable"] and row["true_peak"] <= MS_LIMIT)
    calm = row["tracking_doubled"] <= OUT_OF_HAND * row["tracking_shipped"]
    stands = row["outcomes"]["doubled"] == "completed" and calm
    return bool(row["stable"] and row["true_peak"] <= MS_LIMIT and stands)


def _inputs(case: Case, seed: int) -> tuple[Any, Any, Any]:
    """Files of the run with the drawn plant; the experiment as data; reference and speed."""
    from epa_rt.cli.inputs import load_inputs
    from epa_rt.config.source import load_yaml
    from sim_backend.plant_draw import drawn_plant

    path = ROOT / f"config/experiments/{case.experiment}.yaml"
    inputs = load_inputs(path, ROOT / f"config/rigs/{case.rig}.yaml", None, with_plant=True)
    inputs = replace(inputs, plant=drawn_plant(inputs.plant, seed))
    trial = inputs.experiment.trials[0].motion.planned
    times = np.arange(0.0, trial.duration_s, inputs.rig.period_s)
    return inputs, load_yaml(path).data, trial.sample(times)


def _exciting(inputs: Any, case: Case, base: Any) -> Any:
    from epa_rt.tune.controller import loop_of
    from epa_rt.tune.excitation import Asked, excitation_text

    rig = inputs.rig
    return _of_text(inputs, excitation_text(rig, loop_of(rig, case.kind), base, Asked()))


def _of_text(inputs: Any, text: str) -> Any:
    from epa_rt.experiments.experiment import experiment_from_text

    experiment = experiment_from_text(text, "experiment.yaml", inputs.rig)
    attachments = {**inputs.attachments, "experiment.yaml": text.encode()}
    return replace(inputs, experiment=experiment, attachments=attachments)


def _with(inputs: Any, case: Case, gains: Any) -> Any:
    """The same run with other gains, in the rig and in the text that its log carries."""
    from epa_rt.config.rig import rig_from
    from epa_rt.config.source import parse_yaml
    from epa_rt.tune.rig_text import text_with

    text = text_with(inputs.attachments["rig.yaml"].decode(), case.kind, gains)
    attachments = {**inputs.attachments, "rig.yaml": text.encode()}
    return replace(inputs, rig=rig_from(parse_yaml(text, "rig.yaml")), attachments=attachments)


def _louder(gains: Any, kind: str) -> Any:
    """STRESS times the loop gain; where the derivative brakes the wanted motion by so much more,
    the feedforward gives it back.
    """
    more = (STRESS - 1.0) * gains.kd if kind == "joint" else 0.0
    return replace(
        gains,
        kp=STRESS * gains.kp,
        ki=STRESS * gains.ki,
        kd=STRESS * gains.kd,
        feedforward_speed_s=gains.feedforward_speed_s + more,
    )


class Columns:
    """A Recording of the loop in memory: what a tuning reads, without a file between."""

    failure = None

    def __init__(self) -> None:
        self.rows: list[tuple[Any, ...]] = []
        self.phases: list[int] = []
        self.sent: list[bytes] = []

    def sample(self, *values: Any) -> None:
        cycle, _, _, state, phase, _, _, _, _, _, outputs_raw, measured, reference, _, _ = values
        self.rows.append((cycle, *measured.values(), *reference.values()))
        self.names = (*measured, *reference)
        self.phases.append(phase if state == RUN else -1)
        self.sent.append(outputs_raw)

    def event(self, cycle: int, t_ns: int, kind: str, text: str, /, **data: object) -> None: ...

    def recording(self, inputs: Any) -> Any:
        """What read_recording would give of the log; readings are not masked where invalid."""
        from epa_rt.gap.recording import Recording, Span
        from epa_rt.signals.sent import sent_columns

        rows = np.array(self.rows)
        columns = {name: rows[:, i + 1] for i, name in enumerate(self.names)}
        raw = np.frombuffer(b"".join(self.sent), np.uint8).reshape(len(rows), -1)
        phases = np.array(self.phases)
        edges = [0, *(np.flatnonzero(np.diff(phases)) + 1).tolist(), len(phases)]
        planned = inputs.experiment.phases
        spans = tuple(
            Span(planned[phases[a]].name, a, b, planned[phases[a]].trial_index is not None)
            for a, b in zip(edges, edges[1:], strict=False)
            if phases[a] >= 0
        )
        name = inputs.experiment.name
        own = (inputs.rig.name, inputs.plant.name, name, inputs.rig.period_s)
        columns |= sent_columns(inputs.rig, raw)
        return Recording(name, name, *own, rows[:, 0].astype(np.int64), columns, spans)


RUN = 2  # the supervisor's state in which phases go on


class Nobody:
    """An operator who asks for nothing."""

    def poll(self, cycle: int) -> int:
        return 0


def _run(inputs: Any, seed: int, backend: Any = None) -> tuple[Any, str]:
    """A run of the simulated rig through the loop; its columns and how it ended."""
    from epa_rt.loop.assembly import assemble
    from epa_rt.loop.run import run
    from sim_backend.backend import SimBackend

    parts, columns = assemble(inputs.rig, inputs.experiment), Columns()
    backend = backend or SimBackend(inputs.rig, inputs.plant, seed + 1)
    result = run(
        inputs.rig, backend, parts.supervisor, parts.envelope, parts.decoder, parts.encoder,
        columns, Nobody(),
    )  # fmt: skip
    outcome = result.outcome if result.trip is None else f"{result.outcome}: {result.trip}"
    return columns.recording(inputs), outcome


def _tracking(recording: Any, loop: Any) -> float:
    """RMS of reference minus output over the trials."""
    errors = [
        (recording.columns[loop.reference] - recording.columns[loop.output])[span.start : span.stop]
        for span in recording.spans
        if span.trial
    ]
    return float(np.sqrt(np.nanmean(np.concatenate(errors) ** 2))) if errors else float("nan")


def _true_margins(
    case: Case, inputs: Any, run: Any, sets: tuple[Any, ...], seed: int
) -> tuple[Any, ...]:
    """Margins of each set of gains on the plant itself, by a run in open loop."""
    from epa_rt.tune.controller import controller_of, loop_of
    from epa_rt.tune.fit import fitted
    from epa_rt.tune.margins import interpolated, margins_of
    from epa_rt.tune.response import Excited, response_of

    loop = loop_of(inputs.rig, case.kind)
    span = next(span for span in run.spans if span.trial)
    mean_m = float(np.mean(run.columns["motor_travel_m"][span.start : span.stop]))
    opened = _of_text(_without_loop(inputs, case), _open_text(case, mean_m))
    recording, outcome, true_output = _run_truth(opened, case, seed)
    if outcome != "completed":
        raise RuntimeError(f"{case.rig} {seed}: the run in open loop ended {outcome}")
    command = recording.columns[loop.command]
    trials = [
        Excited(*(column[s.start : s.stop] for column in (command, command, true_output)))
        for s in recording.spans
        if s.trial
    ]
    # what was asked repeats exactly, what was sent is rounded: the reference finds the periods
    asked = recording.columns["ref_motor_travel_m"]
    pairs = zip(trials, (s for s in recording.spans if s.trial), strict=True)
    trials = [replace(t, reference=asked[s.start : s.stop]) for t, s in pairs]
    response = response_of(trials, loop.period_s, 50.0)
    model = fitted(
        response.frequency_hz, response.plant, np.sqrt(response.variance), int(case.kind == "motor")
    )
    none = np.zeros(len(response.frequency_hz))
    grid = interpolated(response.frequency_hz, response.plant, none, model.at)
    return tuple(
        margins_of(grid, controller_of(loop, gains, grid.frequency_hz).feedback) for gains in sets
    )


def _without_loop(inputs: Any, case: Case) -> Any:
    """The bench's travel loop with next to no gain: the speed asked for is the speed sent. No rig
    file may hold so little.
    """
    from epa_rt.tune.controller import Gains, loop_of, written_gains

    if case.kind != "motor":
        return inputs
    loop = loop_of(inputs.rig, case.kind)
    return replace(inputs, rig=written_gains(inputs.rig, loop, Gains(OPEN_GAIN)))


def _open_text(case: Case, mean_m: float) -> str:
    """An experiment that moves the command itself, about where the trial's command lay."""
    import yaml

    path = ROOT / f"config/experiments/{case.experiment}.yaml"
    data = yaml.safe_load(path.read_text("utf-8"))
    loop = "motor_position" if case.kind == "joint" else "motor_speed"
    values = {k: v[len(v) // 2] for k, v in data.get("repeat", {}).items()}
    phases = [*data.get("before", []), *data["phases"]]
    before = [p for p in phases if p["name"] in ("go_to_no_load", "fill", "settle", "trim")]
    text = yaml.safe_dump([{**phase, "loop": loop} for phase in before], width=1000)
    for key, value in values.items():
        text = text.replace(f"${key}", value)
    mean = MEAN[case.rig] or f"{1e3 * mean_m:.3f} mm"
    trials = [
        {"name": f"band{i}", "trial": True, "seed": 100 + i,
         "for": f"{duration_s} s",
         "multisine": {"mean": mean, "peak_to_peak": height, "from": f"{low} Hz",
                       "to": f"{high} Hz", "lines": lines, "period": f"{period_s} s",
                       "fade": "0.5 s"}}
        for i, (low, high, lines, period_s, duration_s, height) in enumerate(BANDS[case.rig])
    ]  # fmt: skip
    file = {
        "experiment": "open",
        "loop": loop,
        "phases": [
            *yaml.safe_load(text),
            {"name": "go", "move": {"to": mean, "speed": "20 mm/s"}, "valves": {"all": "hold"}},
            {"name": "rest", "for": "2 s"},
            *trials,
            {"name": "back", "move": {"to": "no_load", "speed": "20 mm/s"}},
        ],
    }
    return str(yaml.safe_dump(file, sort_keys=False))


def _run_truth(inputs: Any, case: Case, seed: int) -> tuple[Any, str, np.ndarray]:
    """A recorded run without noise, and the plant's own output (N,) beside what its sensor says."""
    from sim_backend.backend import SimBackend

    params = inputs.plant.params.copy()
    for field in params["sensors"].dtype.names:
        if field.endswith(("_noise_pa", "_noise_n", "_noise_a", "_noise_rad", "_noise_m")):
            params["sensors"][field] = 0.0
    plant = replace(inputs.plant, params=params)

    class Truthful(SimBackend):
        """Keeps the load's own angle of every cycle."""

        output: list[float] = []

        def exchange(self, outputs_raw: bytes) -> Any:
            exchange = super().exchange(outputs_raw)
            self.output.append(float(self.model.sensors["joint_angle_rad"][0]))
            return exchange

    Truthful.output = []
    recording, outcome = _run(inputs, seed, Truthful(inputs.rig, plant, seed + 1))
    output = np.array(Truthful.output[: recording.samples])
    if case.kind == "motor":
        output = recording.columns["motor_travel_m"]
    return recording, outcome, output


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """All rows and what they come to; ``holds``: no plant is worse and every margin holds. A plant
    on which the shipped experiment itself ends early is counted apart.
    """
    figures = {}
    for name in dict.fromkeys(row["rig"] for row in rows):
        own = [row for row in rows if row["rig"] == name]
        good = [row for row in own if not {"failure", "unfit"} & row.keys()]
        ratios = [row["ratio"] for row in good]
        held = [row["holding"] for row in good if "holding" in row]
        figures[name] = {
            "plants": len(own),
            "unfit": sum("unfit" in row for row in own),
            "changed": sum(row["decision"] == "change" for row in good),
            "kept_and_warned": sum(row["warned"] for row in good),
            "tracking_no_worse": sum(row["tracks"] for row in good),
            "margins_hold": sum(row["holds"] for row in good),
            "ratio_median": float(np.median(ratios)) if ratios else None,
            "ratio_worst": max(ratios, default=None),
            "true_peak_worst": max((row["true_peak"] for row in good), default=None),
            "held_offered": len(held),
            "held_ratio_median": float(np.median([h["ratio"] for h in held])) if held else None,
            "held_ratio_worst": max((h["ratio"] for h in held), default=None),
            "held_true_peak_worst": max((h["true_peak"] for h in held), default=None),
        }
    is_good = all("unfit" in row or (row.get("tracks") and row.get("holds")) for row in rows)
    return {"holds": is_good, "rigs": figures, "plants": rows}


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--plants", type=int, default=10, help="how many of each rig")
    parser.add_argument("--first", type=int, default=1, help="seed of the first; 0 is as shipped")
    parser.add_argument("--rigs", nargs="+", choices=tuple(CASES), default=list(CASES))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--json", type=Path, help="write the figures there too")
    arguments = parser.parse_args()
    jobs = [(r, arguments.first + i) for r in arguments.rigs for i in range(arguments.plants)]
    rows = []
    with ProcessPoolExecutor(arguments.jobs) as pool:
        for row in pool.map(one_plant, *zip(*jobs, strict=True)):
            rows.append(row)
            print(json.dumps(row), file=sys.stderr, flush=True)
    text = json.dumps(summary(rows), indent=1)
    print(text)
    if arguments.json is not None:
        arguments.json.write_text(text + "\n", "utf-8")
    return 0 if summary(rows)["holds"] else 1


if __name__ == "__main__":
    sys.exit(main())
