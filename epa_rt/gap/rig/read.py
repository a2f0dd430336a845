"""Logs as the diagnosis reads them: measured columns, commands as they were sent, trials, and what
the file itself lacks.
"""

import dataclasses
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from epa_rt.config.rig import Rig, rig_from
from epa_rt.config.source import ConfigError, parse_yaml
from epa_rt.gap.recording import Recording, Span
from epa_rt.logs.layout import FLAG_WORKING_COUNTER_OK
from epa_rt.logs.reader import Event, LogError, LogReader
from epa_rt.signals.sent import received_columns, sent_columns

RIG_FILE = "rig.yaml"
_CYCLE = ("cycle", "t_ns", "flags", "state", "phase", "invalid_mask", "stale_mask")
_RUN = "run"  # the state in which phases go on; when it stops it brakes, which is no phase
_FAULT_KINDS = ("trip", "error", "failure", "gap")


def read_recording(path: str | os.PathLike) -> Recording:
    """One log. Measured values are NaN where the sensor was invalid or stale, and in cycles without
    sound process data.

    ``found`` holds what the file says against itself: damage, lost samples, trips, faults, cycles
    without process data. Raises LogError where it is no log of ours, where it is empty, or where
    its rig file cannot be read though the commands stand in raw bytes.
    """
    with LogReader(path) as log:
        groups = log.layout.groups()
        tables = log.tables(
            {
                "/cycle": [*_CYCLE, "inputs_raw", "outputs_raw"],
                **{f"/{name}": None for name in groups if name != "estimate"},
            }
        )
        cycle, events = tables["/cycle"], log.events()
        if not len(cycle["cycle"]):
            raise LogError(f"{path}: found no sample, expected a log with some")
        facts, ending = log.metadata.get("run", {}), log.ending
        columns, lost = _measured(tables.get("/measured", {}), cycle)
        columns |= tables.get("/reference", {}) | tables.get("/command", {})
        if log.layout.outputs_bytes:
            rig = _attached_rig(path, log.attachments)
            lost += _changed(path, rig, columns, cycle["inputs_raw"])
            columns |= _sent(path, rig, cycle["outputs_raw"])
        found = [*log.missing, *_faults(events, int(cycle["t_ns"][0])), *lost]
        if (
            ending is not None
            and ending.outcome not in ("completed", "imported")
            and not any(e.kind == "trip" for e in events)
        ):
            found.append(
                "the run was not completed:"
                f" {ending.outcome}{': ' + ending.cause if ending.cause else ''}"
            )
        return Recording(
            Path(path).stem,
            os.fspath(path),
            facts.get("rig", ""),
            facts.get("plant", ""),
            facts.get("experiment", ""),
            _period_s(facts, cycle["t_ns"], cycle["cycle"]),
            cycle["cycle"].astype(np.int64),
            columns,
            _spans(log.layout.states, log.layout.phases, cycle, events),
            dict(log.attachments),
            tuple(found),
            cycle["t_ns"].astype(np.int64),
        )


def read_recordings(paths: Sequence[str | os.PathLike], rig: Rig) -> tuple[Recording, ...]:
    """All logs; ``found`` of each also says in what it does not fit the rig file. Raises LogError
    as read_recording.
    """
    recordings = []
    for path in paths:
        recording = read_recording(path)
        recordings.append(
            dataclasses.replace(recording, found=(*recording.found, *misfits(recording, rig)))
        )
    return tuple(recordings)


def misfits(recording: Recording, rig: Rig) -> list[str]:
    """In what a recording does not fit a rig: name, signals, and how counts become SI. A sentence
    each.
    """
    sentences = []
    if recording.rig and recording.rig != rig.name:
        sentences.append(f"recorded on the rig '{recording.rig}', expected '{rig.name}'")
    missing = [row.name for row in rig.signals if row.name not in recording.columns]
    if missing:
        sentences.append(f"has no column for {', '.join(missing)}, which the rig '{rig.name}' has")
    own = rig_of(recording)
    if own is None or own.name != rig.name:
        return sentences
    if own.period_s != rig.period_s:
        sentences.append(
            f"recorded at a period of {own.period_s * 1e3:g} ms, expected {rig.period_s * 1e3:g} ms"
        )
    if own.atmosphere_pa != rig.atmosphere_pa:
        sentences.append(
            f"recorded with an atmosphere of {own.atmosphere_pa / 1e3:g} kPa, expected"
            f" {rig.atmosphere_pa / 1e3:g} kPa"
        )
    theirs = {row.name: row for row in own.signals}
    for row in rig.signals:
        other = theirs.get(row.name)
        for key in ("calibration", "reads", "inverted", "entry"):
            if other is not None and getattr(other, key) != getattr(row, key):
                sentences.append(
                    f"{row.name} was recorded with {key} {_shown(getattr(other, key))}, expected"
                    f" {_shown(getattr(row, key))}"
                )
    return sentences


def rig_of(recording: Recording) -> Rig | None:
    """The rig file that a recording carries; None where it has none of this house."""
    try:
        return _attached_rig(recording.path, recording.attachments)
    except LogError:
        return None


def _attached_rig(path: str | os.PathLike, attachments: dict[str, bytes]) -> Rig:
    if RIG_FILE not in attachments:
        raise LogError(
            f"{path}: found no attachment {RIG_FILE}, expected a log that carries its rig file"
        )
    try:
        return rig_from(parse_yaml(attachments[RIG_FILE].decode("utf-8"), f"{path}[{RIG_FILE}]"))
    except ConfigError as error:
        raise LogError(str(error)) from None
    except UnicodeDecodeError as error:
        raise LogError(
            f"{path}[{RIG_FILE}]: found bytes that are not UTF-8 text (offset {error.start}),"
            " expected YAML"
        ) from None


def _sent(path: str | os.PathLike, rig: Rig, outputs_raw: np.ndarray) -> dict[str, np.ndarray]:
    try:
        return sent_columns(rig, outputs_raw)
    except ValueError as error:
        raise LogError(f"{path}: {error}") from None


def _changed(
    path: str | os.PathLike, rig: Rig, measured: dict[str, np.ndarray], inputs_raw: np.ndarray
) -> list[str]:
    """Channels whose columns are not what the raw bytes say: changed after they were recorded, or
    read with another calibration.
    """
    try:
        received = received_columns(rig, inputs_raw)
    except ValueError as error:
        raise LogError(f"{path}: {error}") from None
    sentences = []
    for name in (n for n in received if n in measured):
        known = np.isfinite(measured[name])
        off = known & ~np.isclose(measured[name], received[name], rtol=1e-9, atol=1e-12)
        if off.any():
            row = int(np.argmax(off))
            sentences.append(
                f"{name} is not what its raw bytes say: found {measured[name][row]:.6g}, expected"
                f" {received[name][row]:.6g} ({int(off.sum())} rows)"
            )
    return sentences


def _measured(
    columns: dict[str, np.ndarray], cycle: dict[str, np.ndarray]
) -> tuple[dict[str, np.ndarray], list[str]]:
    """Measured columns with NaN where they are not to be believed, and a sentence on cycles without
    process data.
    """
    no_data = cycle["flags"] & FLAG_WORKING_COUNTER_OK == 0
    found = (
        [
            f"{int(no_data.sum())} cycles without sound process data, the first at cycle"
            f" {cycle['cycle'][no_data.argmax()]}"
        ]
        if no_data.any()
        else []
    )
    for i, (_name, values) in enumerate(columns.items()):
        bit = np.uint64(1) << np.uint64(i)
        values[no_data | (cycle["invalid_mask"] & bit != 0) | (cycle["stale_mask"] & bit != 0)] = (
            np.nan
        )
    return columns, found


def _spans(
    states: tuple[str, ...],
    phases: tuple[str, ...],
    cycle: dict[str, np.ndarray],
    events: list[Event],
) -> tuple[Span, ...]:
    """Phases as they ran, in order; what was a trial stands in the event that began it."""
    trials = {
        event.data.get("index")
        for event in events
        if event.kind == "phase_start" and event.data.get("trial_index") is not None
    }
    running = [i for i, name in enumerate(states) if name == _RUN]
    index = np.where(np.isin(cycle["state"], running), cycle["phase"], -1)
    begins = [0, *(np.flatnonzero(np.diff(index)) + 1).tolist()]
    ends = [*begins[1:], len(index)]
    return tuple(
        Span(phases[i] if i < len(phases) else str(i), begin, end, i in trials)
        for begin, end in zip(begins, ends, strict=True)
        if (i := int(index[begin])) >= 0
    )


def _faults(events: list[Event], begin_ns: int) -> list[str]:
    """In words; times count from the log's first cycle, for a rig's clock counts from 1970."""
    return [
        f"{event.kind} at {max(0, event.t_ns - begin_ns) / 1e9:.3f} s: {event.text}"
        for event in events
        if event.kind in _FAULT_KINDS
    ]


def _period_s(facts: dict[str, str], t_ns: np.ndarray, cycle: np.ndarray) -> float:
    try:
        return float(facts["period_s"])
    except (KeyError, ValueError):
        cycles = int(cycle[-1] - cycle[0])
        return float(t_ns[-1] - t_ns[0]) / 1e9 / cycles if cycles > 0 else 1e-3


def _shown(value: object) -> str:
    native = getattr(value, "native", None)
    if native is None:
        return repr(value)
    return (
        f"{native[0]:g} {native[1]} to {native[2]:g} {native[3]} = {value.value[0]} to"
        f" {value.value[1]}"
    )
