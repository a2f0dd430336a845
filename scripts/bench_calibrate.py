"""Calibrations of simulated rigs with wrong gains, as JSON: is the truth found, and how often does
the stated 95 % uncertainty hold it; are a swapped, a noisy and a wrong-unit point refused.

Gains are off by up to 5 %, zeros by up to 1 % of the range; every reference has an error of its
own, drawn from its stated uncertainty. Force and joint: the unpowered rig through its bytes;
pressure: the muscle filled in steps. Beside a count stands its 95 % binomial interval.

  python scripts/bench_calibrate.py [--tries 200] [--pressure-tries 40]
"""

import argparse
import json
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from epa_rt.calibrate.calibration import Calibration, calibrate
from epa_rt.calibrate.point import CalibrationError, Point
from epa_rt.calibrate.points_file import Asked
from epa_rt.calibrate.readings import chosen_row, native_line, scale_of
from epa_rt.calibrate.refusals import Scale
from epa_rt.calibrate.taking import Step, Stepping, Taking, points_of
from epa_rt.cli.references import FileAnswers, GaugeAnswers
from epa_rt.config.rig import load_rig
from epa_rt.experiments.jogging import Fill, Vent
from epa_rt.loop.by_hand import assemble_jog
from epa_rt.loop.requests import OperatorRequests
from epa_rt.loop.run import run
from epa_rt.loop.unpowered import watch_unpowered
from epa_rt.models.plant_file import load_plant
from epa_rt.signals.codec import Decoder
from sim_backend.backend import SimBackend
from sim_backend.reference_standard import ReferenceStandard

# kind: rig, port, references (SI), standard uncertainty of each (SI), largest error of the zero
CASES = {
    "force": ("bench", "force_n", 50.0 * np.arange(7), 0.1, 5.0),
    "joint": ("knee", "joint_angle_rad", np.radians([-30, -20, -10, 0, 10, 20, 30]), 5e-4, 7e-3),
    "pressure": ("bench", "muscle0_gauge_pa", 1e3 * np.array([0, 150, 300, 450, 600]), 300.0, 5e3),
}
GAIN, RECORD_S, SETTLE_S = 0.05, 0.25, 0.05


class Unrecorded:
    """A recording that keeps nothing."""

    failure = None

    def sample(self, *values: object) -> None: ...

    def event(self, cycle: int, t_ns: int, kind: str, text: str, /, **data: object) -> None: ...


class Bench:
    """One rig whose sensor is drawn wrong anew for each try."""

    def __init__(self, kind: str):
        name, self.port, self.references, self.u, self.zero = CASES[kind]
        self.kind = kind
        path = ROOT / f"config/rigs/{name}.yaml"
        self.rig = load_rig(path)
        self.plant = load_plant(path.parent / self.rig.plant)
        self.row = chosen_row(self.rig, kind, None)
        self.scale: Scale = scale_of(self.rig, self.row)

    def points(self, seed: int) -> tuple[list[Point], float, float]:
        """The points of one try, the true gain and the true offset (SI per native, SI)."""
        noise = np.random.default_rng([seed, 57])
        gain = 1.0 + GAIN * noise.uniform(-1.0, 1.0)
        zero = self.zero * noise.uniform(-1.0, 1.0)
        plant = load_plant(ROOT / "config/plants" / Path(self.rig.plant).name)
        stem, unit = self.port.rsplit("_", 1)
        plant.params["sensors"][f"{stem}_gain_ratio"] = gain
        plant.params["sensors"][f"{stem}_offset_{unit}"] = zero
        standard = ReferenceStandard(self.port)
        backend = SimBackend(self.rig, plant, seed, physics=standard)
        taken = (
            self._filled(backend, standard, noise)
            if self.kind == "pressure"
            else self._applied(backend, standard, noise)
        )
        return taken, self.scale.gain / gain, (self.scale.offset - zero) / gain

    def _taking(self, steps, answers) -> Taking:
        line = native_line(self.rig, self.row)
        period_s = self.rig.period_s
        return Taking(self.row.name, line, self.scale, steps, answers, period_s, SETTLE_S, RECORD_S)

    def _applied(self, backend, standard, noise) -> list[Point]:
        up_down = [*self.references, *self.references[-2::-1]]
        asked = [Asked(float(y), self.u, None, False, "") for y in up_down]
        answers = FileAnswers(asked, standard, noise)
        taking = self._taking(answers.steps, answers)
        decoder, requests = Decoder(self.rig), OperatorRequests()
        ended = watch_unpowered(self.rig, backend, decoder, taking, Unrecorded(), requests)
        assert ended.outcome == "completed", ended.cause
        return points_of(taking.taken)

    def _filled(self, backend, standard, noise) -> list[Point]:
        muscle, rig = self.rig.muscles[0].name, self.rig
        up_down = [*self.references, *self.references[-2::-1]]
        orders = [
            Fill(muscle, y + rig.atmosphere_pa) if y > 0 else Vent((muscle,)) for y in up_down
        ]
        answers = GaugeAnswers(standard, self.u, noise, 0.0)
        steps = [Step((o,), f"{y / 1e3:g} kPa") for o, y in zip(orders, up_down, strict=True)]
        taking = self._taking(iter(steps), answers)
        parts, _ = assemble_jog(rig, Stepping(taking, rig, self.row.name))
        result = run(
            rig, backend, parts.supervisor, parts.envelope, parts.decoder, parts.encoder,
            Unrecorded(), OperatorRequests(),
        )  # fmt: skip
        assert result.outcome == "completed", result.cause
        return points_of(taking.taken)


def interval(held: int, tries: int) -> list[float]:
    """Clopper and Pearson's 95 % interval of a share."""
    from scipy.special import betaincinv

    low = float(betaincinv(held, tries - held + 1, 0.025)) if held else 0.0
    high = float(betaincinv(held + 1, tries - held, 0.975)) if held < tries else 1.0
    return [round(low, 4), round(high, 4)]


def coverage(kind: str, tries: int) -> dict[str, object]:
    """Tries on sensors drawn anew: the worst gain found, and how often 95 % held gain and zero."""
    bench, refused = Bench(kind), 0
    errors, held_gain, held_zero = [], 0, 0
    for seed in range(tries):
        print(f"\r{kind}: {seed + 1} of {tries} ", end="", file=sys.stderr, flush=True)
        points, gain, offset = bench.points(seed)
        try:
            line = calibrate(points, bench.scale).line
        except CalibrationError:
            refused += 1
            continue
        errors.append(abs(line.gain / gain - 1.0))
        held_gain += abs(line.gain - gain) <= line.k * line.gain_u
        # where the true line reads zero: the zero, free of the gain's error
        native = np.array(-offset / gain)
        held_zero += abs(float(line.value(native))) <= line.k * float(line.std(native))
    done = tries - refused
    return {
        "tries": tries,
        "refused": refused,
        "largest_gain_error_percent": round(100.0 * max(errors), 4),
        "gain_held": int(held_gain),
        "gain_held_share": round(held_gain / done, 4),
        "gain_interval": interval(int(held_gain), done),
        "zero_held": int(held_zero),
        "zero_held_share": round(held_zero / done, 4),
        "zero_interval": interval(int(held_zero), done),
    }


def _said(points: list[Point], scale: Scale) -> str:
    try:
        found: Calibration = calibrate(points, scale)
    except CalibrationError as error:
        return str(error)
    return f"TAKEN: {found.line.gain}"


def refusals(kind: str, seeds: int) -> dict[str, dict[str, object]]:
    """Spoilt points of sound tries: how many were refused, and one sentence of each kind."""
    from dataclasses import replace

    bench = Bench(kind)
    factors = {"N": 9.80665, "Pa": 6.894757, "rad": 57.29578}
    found: dict[str, dict[str, object]] = {}

    def spoil(name: str, points: list[Point], *words: str) -> None:
        text = _said(points, bench.scale)
        entry = found.setdefault(name, {"tries": 0, "refused": 0, "named": 0, "says": text})
        entry["tries"] += 1
        entry["refused"] += not text.startswith("TAKEN")
        entry["named"] += all(word in text for word in words)

    for seed in range(seeds):
        points, *_ = bench.points(seed)
        noise = np.random.default_rng([seed, 58])
        i, j = sorted(noise.choice(len(bench.references), 2, replace=False))
        a, b = points[i], points[j]
        swapped = list(points)
        swapped[i] = replace(a, reference=b.reference)
        swapped[j] = replace(b, reference=a.reference)
        spoil("swapped", swapped, a.where, b.where, "look swapped")
        noisy = list(points)
        noisy[i] = replace(a, scatter=10.0 * max(a.scatter, bench.scale.step))
        spoil("noisy", noisy, "noisy")
        factor = factors[bench.scale.si_unit]
        unit = [replace(p, reference=p.reference * factor) for p in points]
        spoil("wrong unit", unit, f"by {factor:.4g}")
        k = len(bench.references) - 1
        one = list(points)
        one[k] = replace(points[k], reference=points[k].reference / factor)
        spoil("one point in a wrong unit", one, f"by {factor:.4g}")
    return found


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--tries", type=int, default=200)
    arguments.add_argument("--pressure-tries", type=int, default=40)
    arguments.add_argument("--spoilt", type=int, default=20)
    chosen = arguments.parse_args()
    result = {
        kind: coverage(kind, chosen.pressure_tries if kind == "pressure" else chosen.tries)
        for kind in CASES
    }
    spoilt = {kind: refusals(kind, chosen.spoilt) for kind in CASES}
    print(file=sys.stderr)
    print(json.dumps({"coverage": result, "refusals": spoilt}, indent=1))


if __name__ == "__main__":
    main()
