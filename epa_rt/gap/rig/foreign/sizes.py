"""Units of a component rig's channels, against what its rig file says of its size: found before any
effect is named.
"""

from collections.abc import Sequence

import numpy as np

from epa_rt.gap.finding import Finding, judged_rows
from epa_rt.gap.recording import Recording
from epa_rt.gap.rig.foreign.component import scaled
from epa_rt.gap.rig.foreign.rig_file import ForeignRig

LARGEST, SMALLEST = (
    20.0,
    1.0 / 300.0,
    # of the expected size: a log of small motions is one, and a unit is wrong by a thousand, or by
    # 57 (degrees for radians)
)
# no chamber stands far above its supply (pounds per square inch for bar are 14.5 times as many)
MOST_OF_SUPPLY = 5.0
MOST_ATMOSPHERES, VACUUM = 100.0, 0.02  # of an absolute pressure


def check_sizes(recordings: Sequence[Recording], rig: ForeignRig) -> list[Finding]:
    """Findings on channels that are hundreds of times larger or smaller than the rig's settings let
    expect.
    """
    sized = [
        channel
        for channel in rig.component.channels
        if channel.size and channel.role in rig.channels
    ]
    return [
        finding
        for recording in recordings
        for channel in sized
        if (finding := _checked(recording, rig, channel)) is not None
    ]


def _checked(recording: Recording, rig: ForeignRig, channel) -> Finding | None:
    name, expected, unit = (
        rig.channels[channel.role],
        scaled(channel.size, rig.settings),
        channel.unit,
    )
    values = (
        recording.columns[name][judged_rows(recording)]
        if name in recording.columns
        else np.zeros(0)
    )
    values = values[np.isfinite(values)]
    if not len(values):
        return None
    middle = (
        rig.settings.get("middle", 0.0) if channel.size == "stroke" else 0.0
    )  # a place may count from far away: the stroke says how far it goes about its middle
    ends = np.percentile(values, (1.0, 99.0))
    size, off = float(np.max(np.abs(ends))), float(np.max(np.abs(ends - middle)))
    least, most = (
        (SMALLEST, LARGEST)
        if unit != "Pa"
        else (VACUUM, MOST_OF_SUPPLY if channel.size == "supply" else MOST_ATMOSPHERES)
    )
    small = size < least * (expected + abs(middle))
    if size == 0.0 or not small and off <= most * expected:
        return None
    about = f" about its middle of {middle:.3g} {unit}" if middle else ""
    looks = (
        "they look too small"
        if small
        else "they look too large"
        if size > most * expected or not middle
        else "they lie too far from it"
    )
    other = ", or the setting 'middle'" if middle else ""
    return Finding(
        "refuse",
        "units",
        recording.name,
        name,
        f"{recording.name}: {name}: found values of up to {size:.3g} {unit}, expected about"
        f" {expected:.3g} {unit}{about} ({channel.size} in the rig file): {looks}, a unit or a"
        f" scale of the import may be wrong{other}",
    )
