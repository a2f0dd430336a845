"""Words and bits of a rig of this house: whole numbers, and a drive that is on where the rig is
moved.
"""

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.gap.finding import Finding, judged_rows, seconds, target_moves
from epa_rt.gap.hygiene.values import entry_of
from epa_rt.gap.recording import Recording


def check_words(recording: Recording, rig: Rig) -> list[Finding]:
    """Findings on bits, words and counts that are none, and on a drive that is never on."""
    found = []
    for row in rig.signals:
        bit = entry_of(rig, row.name).code == "?"
        if row.name in recording.columns and (bit or row.name.endswith("_raw")):
            found += _no_word(recording, row.name, bit)
    return found or _never_on(recording, rig)


def _no_word(recording: Recording, name: str, bit: bool) -> list[Finding]:
    values = recording.columns[name]
    known = np.isfinite(values)
    wrong = known & ((values != 0.0) & (values != 1.0) if bit else values != np.rint(values))
    if not wrong.any():
        return []
    row = int(np.argmax(wrong))
    return [
        _of(
            recording,
            "word",
            name,
            f"found {values[row]:.6g} at {seconds(recording, row):.3f} s ({int(wrong.sum())} rows"
            f" are such), expected {'0 or 1' if bit else 'a whole number'}",
        )
    ]


def _never_on(recording: Recording, rig: Rig) -> list[Finding]:
    """A status word that never says operation enabled while the motor's target moves: no target
    would act, and all motion be unexplained.
    """
    from epa_rt.gap.rig.house.commands import is_on, status_row

    name, rows = status_row(rig), judged_rows(recording, trials_only=True)
    if name is None or name not in recording.columns:
        return []
    known = rows & np.isfinite(recording.columns[name])
    if (
        not known.any()
        or is_on(recording.columns[name][known]).any()
        or not target_moves(recording, known)
    ):
        return []
    first = int(recording.columns[name][known][0])
    return [
        _of(
            recording,
            "drive off",
            name,
            f"found the drive on in no row of the trials (the first word is {first},"
            f" 0x{first & 0xFFFF:04X}) while the motor's target moves, expected the CiA 402 status"
            " word, with 0x27 in the bits 0x6F where it is on",
        )
    ]


def _of(recording: Recording, kind: str, name: str, sentence: str) -> Finding:
    return Finding("refuse", kind, recording.name, name, f"{recording.name}: {name}: {sentence}")
