"""Words and bits of a rig of this house: whole numbers, and a drive that is on where the rig is moved."""

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.config.rig_checks import entries_of
from epa_rt.gap.hygiene_finding import Finding, judged_rows, seconds
from epa_rt.gap.recording import Recording

_MOVES = 1e-3  # of a target, in its SI unit: less is no motion that is asked for


def check_words(recording: Recording, rig: Rig) -> list[Finding]:
    """Findings on bits, words and counts that are none, and on a drive that is never on."""
    found = []
    codes = {f"{slave.name}.{entry.name}": entry.code for slave in rig.slaves for outputs in (False, True) for entry in entries_of(slave, outputs)}
    for row in rig.signals:
        if row.name in recording.columns and (codes[row.entry] == "?" or row.name.endswith("_raw")):
            found += _no_word(recording, row.name, codes[row.entry] == "?")
    return found or _never_on(recording, rig)


def _no_word(recording: Recording, name: str, bit: bool) -> list[Finding]:
    values = recording.columns[name]
    known = np.isfinite(values)
    wrong = known & ((values != 0.0) & (values != 1.0) if bit else values != np.rint(values))
    if not wrong.any():
        return []
    row = int(np.argmax(wrong))
    return [_of(recording, "word", name, f"found {values[row]:.6g} at {seconds(recording, row):.3f} s ({int(wrong.sum())} rows are such), expected {'0 or 1' if bit else 'a whole number'}")]


def _never_on(recording: Recording, rig: Rig) -> list[Finding]:
    """A status word that never says operation enabled while the motor's target moves: no target would act, and all motion be unexplained."""
    from epa_rt.gap.house.commands import is_on, status_row

    name, rows = status_row(rig), judged_rows(recording, trials_only=True)
    if name is None or name not in recording.columns:
        return []
    known = rows & np.isfinite(recording.columns[name])
    told = [values[known & np.isfinite(values)] for other, values in recording.columns.items() if other.startswith(("cmd_motor", "ref_motor"))]
    if not known.any() or is_on(recording.columns[name][known]).any() or not any(len(values) and np.ptp(values) > _MOVES for values in told):
        return []
    first = int(recording.columns[name][known][0])
    return [_of(recording, "drive off", name, f"found the drive on in no row of the trials (the first word is {first}, 0x{first & 0xFFFF:04X}) while the motor's target moves, "
                "expected the CiA 402 status word, with 0x27 in the bits 0x6F where it is on")]


def _of(recording: Recording, kind: str, name: str, sentence: str) -> Finding:
    return Finding("refuse", kind, recording.name, name, f"{recording.name}: {name}: {sentence}")
