"""The loop in time: the rig's own controller on a fitted model of the plant, cycle by cycle.

Sampling and hold are the cycle's; the reading is rounded to the sensor's steps, the command to the
drive's counts, and cut to its limits and its slew limit, as on the rig.
"""

from dataclasses import dataclass

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.loop.assembly import TARGET_OF_LOOP, motion_of
from epa_rt.signals.image import image_of
from epa_rt.signals.scaling import scaling_of
from epa_rt.tune.controller import Gains, Loop, written_gains
from epa_rt.tune.fit import Model


@dataclass(frozen=True)
class Situation:
    """Where a loop works: mean output and mean command in SI, one step of the output's reading."""

    output: float
    command: float
    quantum: float


@dataclass(frozen=True)
class Trace:
    """A simulated stretch, (k,) each in SI: time, reference, output, command."""

    t_s: np.ndarray
    reference: np.ndarray
    output: np.ndarray
    command: np.ndarray

    @property
    def rms_error(self) -> float:
        """RMS of reference minus output, after its mean."""
        return float(np.std(self.reference - self.output))


def simulated(
    rig: Rig,
    loop: Loop,
    gains: Gains,
    model: Model,
    situation: Situation,
    reference: np.ndarray,
    speed: np.ndarray,
    load: float = 0.0,
) -> Trace:
    """The loop over a reference (k,) and its speed (k,), one value a cycle, from rest at the
    situation. ``load``: what is added to the command from the first cycle on, behind the gate.
    """
    motion = motion_of(written_gains(rig, loop, gains), loop.name, TARGET_OF_LOOP[loop.name])
    row = rig.row(loop.command)
    place = image_of(rig, outputs=True).places[row.entry]
    count = abs(scaling_of(row, place.entry, rig).slope)
    low, high = row.limits or (-np.inf, np.inf)
    step = (row.slew or np.inf) * loop.period_s
    a, b = model.sampled(loop.period_s)
    state, travelled = np.zeros(len(a), complex), 0.0
    measured = {rig.motor.position: situation.output, loop.output: situation.output}
    motion.reset(measured, {loop.command: situation.command})
    wanted, sent = {}, situation.command
    output, command = np.empty(len(reference)), np.empty(len(reference))
    for k in range(len(reference)):
        out = float(state.sum().real)
        travelled += out * loop.period_s
        output[k] = situation.output + (travelled if model.integrators else out)
        measured[loop.output] = situation.quantum * round(output[k] / situation.quantum)
        wanted[loop.reference], wanted[loop.reference_speed] = float(reference[k]), float(speed[k])
        asked = motion.step(measured, wanted, loop.period_s)[loop.command]
        asked = min(max(asked, sent - step, low), sent + step, high)
        sent = asked
        command[k] = count * round(asked / count)
        state = a * state + b * (command[k] - situation.command + load)
    return Trace(np.arange(len(reference)) * loop.period_s, reference, output, command)
