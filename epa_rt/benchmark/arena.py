"""What the rivals share: a case's logs as one residual over one vector of parameters, and how a
fitted vector is read.

One amplitude per effect (0 off, 1 typical) stands beside the nominal parameters. Logs are looked at
whole: a drive's integrator and a leak have a history that a stretch cut out of a log has not.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

LEAST = 0.02  # share of the RMSE that an effect must be worth to be named
REACH = 3.0  # amplitudes run from -REACH or 0 to REACH, nominal parameters so many of their spreads
# by which 0 lies within the bounds of a one-sided amplitude; the knobs themselves stay at neutral
INSIDE = 1e-3
MOST = 1e3  # times the noise, beyond which a residual counts no more


class Arena:
    """The logs of a case against the whole catalogue."""

    def __init__(self, rig: Path, plant: Path, logs: Sequence[Path], leave_out: Sequence[str]):
        from epa_rt.config.rig import load_rig
        from epa_rt.gap.rig.read import read_recordings
        from epa_rt.gap.rig.subjects import open_subject

        self.subject = open_subject(rig, plant)
        self.prepared = [
            self.subject.prepare(recording)
            for recording in read_recordings(list(logs), load_rig(rig))
        ]
        self.effects = [effect for effect in self.subject.catalogue if effect.name not in leave_out]
        self.nominal = list(self.subject.nominal)
        self.size = len(self.nominal) + len(self.effects)
        self._kept: dict[str, dict[tuple, np.ndarray]] = {}
        self.links, self.good, self.scale = [], {}, {}
        for name in (link.name for link in self.subject.links):
            raw = [self.subject.residual(p, {}, name) for p in self.prepared]
            steps = np.concatenate([np.diff(part) for part in raw])
            steps = steps[np.isfinite(steps)]
            noise = float(1.4826 * np.median(np.abs(steps)) / np.sqrt(2.0)) if len(steps) else 0.0
            if noise > 0.0:
                self.links.append(name)
                self.scale[name], self.good[name] = noise, np.isfinite(np.concatenate(raw))
        self.strength = {effect.name: self._strength(effect) for effect in self.effects}
        n = len(self.nominal)
        self.high = np.full(self.size, REACH)
        self.low = np.array(
            [-REACH] * n
            + [-REACH if self._two_sided(effect) else -INSIDE for effect in self.effects]
        )

    def _two_sided(self, effect) -> bool:
        """Whether every knob that gives it its strength may lie on either side of neutral."""
        knobs = [self.subject.knobs[key] for key in self.strength[effect.name]]
        return all(knob.low < knob.value < knob.high for knob in knobs)

    def values(self, z: np.ndarray) -> dict[str, float]:
        """Knob values of a parameter vector."""
        out = {
            k.key: float(np.clip(k.value + zi * k.spread, k.low, k.high))
            for k, zi in zip(self.nominal, z, strict=False)
            if zi != 0.0
        }
        for effect, amplitude in zip(self.effects, z[len(self.nominal) :], strict=True):
            if amplitude != 0.0:
                out |= self.switched(effect, effect.starts[0], amplitude)
        return out

    def switched(self, effect, start: Sequence[float], amplitude: float) -> dict[str, float]:
        """Knobs of one effect: those that switch it off, an amplitude of the way from neutral to a
        start; the others as the start says.
        """
        out = {}
        for key, wanted in zip(effect.knobs, start, strict=True):
            knob, share = (
                self.subject.knobs[key],
                (amplitude if key in self.strength[effect.name] else 1.0),
            )
            out[key] = float(
                np.clip(knob.value + share * (wanted - knob.value), knob.low, knob.high)
            )
        return out

    def _strength(self, effect) -> set[str]:
        """Knobs that switch an effect off on their own; all where none does."""
        if len(effect.knobs) == 1:
            return set(effect.knobs)
        start = dict(zip(effect.knobs, effect.starts[0], strict=True))
        links = {link for key in effect.knobs for link in self.subject.touched(key)}
        off = {
            key
            for key in effect.knobs
            if start[key] != self.subject.knobs[key].value
            and all(
                np.array_equal(
                    self.link({**start, key: self.subject.knobs[key].value}, link),
                    self.link({}, link),
                )
                for link in self.links
                if link in links
            )
        }
        return off or set(effect.knobs)

    def touched(self, i: int) -> list[str]:
        """Links that entry i of the vector may change."""
        n = len(self.nominal)
        keys = (self.nominal[i].key,) if i < n else self.effects[i - n].knobs
        found = {link for key in keys for link in self.subject.touched(key)}
        return [link for link in self.links if link in found]

    def link(self, values: dict[str, float], link: str) -> np.ndarray:
        """One link over all logs in units of its noise; samples that are not judged are left
        out.
        """
        key = tuple(
            sorted(item for item in values.items() if link in self.subject.touched(item[0]))
        )
        kept = self._kept.setdefault(link, {})
        if key not in kept:
            whole = (
                np.concatenate([self.subject.residual(p, values, link) for p in self.prepared])[
                    self.good[link]
                ]
                / self.scale[link]
            )
            while len(kept) > 3:
                kept.pop(next(iter(kept)))
            kept[key] = np.clip(np.nan_to_num(whole, nan=MOST), -MOST, MOST)
        return kept[key]

    def residual(self, values: dict[str, float]) -> np.ndarray:
        """All links in a row."""
        return np.concatenate([self.link(values, link) for link in self.links])

    def jacobian(self, z: np.ndarray, step: float) -> np.ndarray:
        """Finite differences of the residual; each column asks for the links that it touches
        only.
        """
        edges = np.cumsum([0, *(int(self.good[link].sum()) for link in self.links)])
        base, out = self.values(z), np.zeros((edges[-1], self.size))
        here = {link: self.link(base, link) for link in self.links}
        for i in range(self.size):
            moved = z.copy()
            moved[i] += step if z[i] + step <= self.high[i] else -step
            values = self.values(moved)
            for link in self.touched(i):
                k = self.links.index(link)
                out[edges[k] : edges[k + 1], i] = (self.link(values, link) - here[link]) / (
                    moved[i] - z[i]
                )
                self._kept[link] = {
                    key: value for key, value in self._kept[link].items() if value is here[link]
                }
        return out

    def rmse(self, values: dict[str, float]) -> float:
        """Root mean square of all links over all logs, in units of their noise. Raises ValueError
        where no link has noise.
        """
        return float(np.sqrt(np.mean(self.residual(values) ** 2)))

    def answer(self, z: np.ndarray) -> dict:
        """Names what matters most in a fitted vector: the effect whose switching off raises the
        RMSE most, first.
        """
        n, before, after = len(self.nominal), self.rmse({}), self.rmse(self.values(z))
        rises = []
        for i, effect in enumerate(self.effects):
            if z[n + i] != 0.0:
                without = z.copy()
                without[n + i] = 0.0
                rises.append((self.rmse(self.values(without)) - after, effect))
        rises.sort(key=lambda item: -item[0])
        return self.said(before, after, [effect for rise, effect in rises if rise > LEAST * before])

    def said(self, before: float, after: float, effects: Sequence) -> dict:
        """An answer in the diagnosis' own words; nothing is named where the RMSE falls by less than
        LEAST.
        """
        rough = {link: float(np.sqrt(np.mean(self.link({}, link) ** 2))) for link in self.links}
        worst = sorted(
            (link for link in self.subject.links if link.name in rough),
            key=lambda link: -rough[link.name],
        )
        found = effects if after < (1.0 - LEAST) * before else []
        return {
            "verdict": "explained" if found else "no_gap",
            "says": f"RMSE {before:.3g} to {after:.3g} times the noise",
            "effects": [
                {
                    "name": e.name,
                    "family": e.family,
                    "block": e.block,
                    "confidence": 1.0,
                    "parameters": [],
                }
                for e in found
            ],
            "location": [{"block": link.block, "channel": link.channel} for link in worst],
            "shrinkage": [],
        }
