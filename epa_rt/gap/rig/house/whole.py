"""The whole plant in free run: a recording's commands in, a recording out as the rig would have
made it.
"""

from dataclasses import replace

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.gap.recording import Recording
from epa_rt.gap.rig.house.channels import Channel
from epa_rt.gap.rig.house.commands import lost_rows
from epa_rt.gap.rig.house.motions import Motions, shown
from epa_rt.models.parameters import PARAMS, copied
from epa_rt.models.plant import new_state, run, run_roughly
from epa_rt.models.ports import SENSORS

DITHERED = 0.2  # noise in steps from which on a converter's rounding hangs on the noise

_EVEN = (
    0.6180339887498949,
    0.7548776662466927,
)  # spread the places of steps evenly over seeds in a row, and over channels

_NOISES = tuple(name for name in PARAMS["sensors"].names if "_noise_" in name)


def on_grid(recording: Recording) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Columns on a gapless grid of cycles (NaN where cycles were lost), and each row's place on it
    (N,).
    """
    place = place_of(recording)
    count = int(place[-1]) + 1
    if count == len(place):
        return recording.columns, place
    columns = {}
    for name, values in recording.columns.items():
        columns[name] = np.full(count, np.nan)
        columns[name][place] = values
    return columns, place


def place_of(recording: Recording) -> np.ndarray:
    """(N,) each row's place on a gapless grid of cycles."""
    return (recording.cycle - recording.cycle[0]).astype(np.int64)


def with_gaps(rig: Rig, recording: Recording, made: Recording) -> Recording:
    """A run with nothing where nothing was recorded: what is made up for gaps is made up for its
    own alike.
    """
    lost = lost_rows(rig, recording.columns)
    if not lost.any():
        return made
    names = {row.name for row in rig.inputs}
    return replace(
        made,
        columns={
            name: np.where(lost, np.nan, values) if name in names else values
            for name, values in made.columns.items()
        },
    )


def run_whole(
    channels: dict[str, Channel],
    params: np.ndarray,
    substeps: int,
    recording: Recording,
    commands: np.ndarray,
    noise: dict[str, float] | None,
    seed: int,
    hold_phase: int,
    motions: Motions,
    roughly: bool = False,
) -> Recording:
    """A recording of the plant ``params`` (1,) under the sent ``commands`` (N,), from rest.

    ``noise``: port to standard deviation; with it readings are noisy and quantised, without it
    (None) neither. ``hold_phase``: row on which the encoder first renews. Where noise does not
    dither the steps, the steps lie at a place of chance, and the readings with them: the rounding
    of a rig whose motion differs by a fraction of a count is another one, and none of it may count
    as known. ``motions``: of this recording, run so. ``roughly``: by the midpoint rule.
    """
    # of what has no gaps every row is its own place
    place = place_of(recording) if len(commands) != recording.samples else slice(None)
    params = copied(params)
    for name in _NOISES:
        params["sensors"][name] = 0.0

    def started(plant: np.ndarray) -> np.ndarray:
        state = new_state(plant)
        hold = int(plant["sensors"]["encoder_hold_s"][0] / recording.period_s + 0.5)
        state["cycle"] = -hold_phase % max(hold, 1)
        return state

    def ran(plant: np.ndarray) -> np.ndarray:
        readings = np.zeros(len(commands), SENSORS)
        (run_roughly if roughly else run)(
            plant, started(plant), commands, recording.period_s, substeps, readings
        )
        return readings

    motion = motions.of(params, ran)
    if motion is None:
        readings = ran(params)
    else:
        readings = np.zeros(len(commands), SENSORS)
        shown(params, started(params), motion, recording.period_s, readings)
    made = dict(recording.columns)
    random = np.random.default_rng(seed)
    for i, (port, channel) in enumerate(channels.items()):
        values = readings[port][place]
        if noise is not None:
            size, shift = (
                noise.get(port, 0.0),
                channel.step * ((seed * _EVEN[0] + i * _EVEN[1]) % 1.0 - 0.5),
            )
            if size >= DITHERED * channel.step:
                shift = 0.0
            values = (
                channel.quantised(values + shift + size * random.standard_normal(len(values)))
                - shift
            )
        elif channel.floors:
            values = values - 0.5 * channel.step  # as a counter shows them on average
        made[channel.column] = channel.to_column(values)
    return replace(recording, name=f"{recording.name} (free run)", columns=made, found=())
