"""Files and mapping to the columns of a log, on one grid, before anything is written."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from epa_rt.config.source import Located
from epa_rt.logs.importers.grid import Grid, beside, grid_of, put, stamps_s
from epa_rt.logs.importers.line import line_of
from epa_rt.logs.importers.mapping import TOPIC_KINDS, Mapping, Signal, TrialColumn
from epa_rt.logs.importers.read import read_table
from epa_rt.logs.importers.table import ImportRefused, Key, Table
from epa_rt.logs.layout import ANSWERED_AFTER

_LARGEST_SI = 1e300
_MOST_TRIALS = 1_000_000


@dataclass(frozen=True)
class Trial:
    """A stretch of cycles, ``stop`` not included; ``judged``: a trial, not what lies between."""

    name: str
    start: int
    stop: int
    judged: bool


@dataclass(frozen=True)
class Gathered:
    """What a log will hold: signals in SI (M,), trials over all M rows, and in words what was done
    on the way.
    """

    grid: Grid
    measured: dict[str, np.ndarray]
    references: dict[str, np.ndarray]
    commands: dict[str, np.ndarray]
    trials: tuple[Trial, ...]
    says: tuple[str, ...]


def gather(mapping: Mapping, located: Located, files: Sequence[Path]) -> Gathered:
    """Reads the files. Raises ImportRefused or ConfigError for the first thing that does not
    fit.
    """
    keys = {
        name: _key(located, (section, name), signal, files, mapping)
        for section in ("measured", "references", "commands")
        for name, signal in getattr(mapping, section).items()
    }
    if isinstance(mapping.trials, TrialColumn):
        keys["trials"] = _key(located, ("trials",), mapping.trials, files, mapping)
    unused = [str(path) for path in files if str(path) not in {key.path for key in keys.values()}]
    if unused:
        raise ImportRefused(
            f"{mapping_name(located)}: found no signal from {unused[0]}, expected every file to be"
            " used (give 'file:' in the mapping)"
        )
    tables, constants = _tables(mapping, located, keys)
    first = next(iter(keys.values()))
    main = tables[first.path, first.topic]
    grid = grid_of(main, mapping.clock)
    raw = stamps_s(main, mapping.clock)
    places = {which: beside(grid, table, mapping.clock, raw) for which, table in tables.items()}
    found, says = {}, [sentence for table in tables.values() for sentence in table.says]
    says += [sentence for place in places.values() for sentence in place.says]
    for name, signal in mapping.signals.items():
        table = tables[keys[name].path, keys[name].topic]
        own = signal.column_of(name)
        line = line_of(own, signal.unit, signal.scale, signal.offset, mapping.atmosphere)
        slope = line.slope * (
            constants[keys[name].path][signal.scale_variable] if signal.scale_variable else 1.0
        )
        with np.errstate(over="ignore", invalid="ignore"):
            column = table.columns[keys[name].column] * slope + line.intercept
        if np.any(np.abs(column) > _LARGEST_SI):
            raise ImportRefused(
                f"{table.place(int(np.argmax(np.abs(column) > _LARGEST_SI)))}: column"
                f" {signal.column}: found a number too large for {name}, expected less"
            )
        found[name] = put(
            grid, places[keys[name].path, keys[name].topic], column, hold=_is_discrete(name)
        )
        if signal.integral:
            found[name] = _added_up(grid, found[name])
            says.append(f"{name} is column {signal.column} added up over time, from 0 on")
        empty = int(np.isnan(found[name]).sum())
        if empty:
            says.append(
                f"{name} has no value on {empty} of {len(found[name])} rows; "
                + (
                    "they are marked invalid"
                    if name in mapping.measured
                    else "nothing is put in their place"
                )
            )
    early = ANSWERED_AFTER - mapping.answered_after
    if early and mapping.commands:
        found |= {name: _earlier(grid, found[name], early) for name in mapping.commands}
        says.append(
            f"commands are put {early} row{'s' if early > 1 else ''} earlier (answered_after:"
            f" {mapping.answered_after}), where this house's loop would have them"
        )
    trials = _trials(mapping, grid, located)
    if isinstance(mapping.trials, TrialColumn):
        key = keys["trials"]
        trials = _trials_by(
            put(
                grid,
                places[key.path, key.topic],
                _numbers(tables[key.path, key.topic], key.column),
                hold=True,
            )
        )
        if not any(trial.judged for trial in trials):
            raise located.error(
                ("trials", "column"),
                f"no number other than zero in the column {key.column}",
                "a trial's number in some rows (without 'trials' the whole recording is one trial)",
            )
    else:
        says += [
            f"trial {stretch.name} was to end at {stretch.end:g} s and is cut at {grid.t_s[-1]:.6g}"
            " s, where the recording ends"
            for stretch in mapping.trials or ()
            if stretch.end > grid.t_s[-1] + 1.5 * grid.period_s
        ]
    groups = [
        {name: found[name] for name in getattr(mapping, section)}
        for section in ("measured", "references", "commands")
    ]
    return Gathered(grid, *groups, trials, (*grid.says, *says))


def _added_up(grid: Grid, speed: np.ndarray) -> np.ndarray:
    """The way (M,) from the first row on, by trapezoids; from row to row with a value, across those
    without.
    """
    from scipy.integrate import cumulative_trapezoid

    known, way = ~np.isnan(speed), np.full(len(speed), np.nan)
    if known.any():
        way[known] = cumulative_trapezoid(speed[known], grid.t_s[known], initial=0.0)
    return way


def _earlier(grid: Grid, values: np.ndarray, cycles: int) -> np.ndarray:
    """Each row gets what is commanded so many cycles later, across lost ones too; the last rows
    hold.
    """
    return values[np.searchsorted(grid.cycle, grid.cycle + cycles, side="right") - 1]


def mapping_name(located: Located) -> str:
    return f"{located.path}:1"


def _key(
    located: Located,
    where: tuple,
    signal: Signal | TrialColumn,
    files: Sequence[Path],
    mapping: Mapping,
) -> Key:
    chosen = [path for path in files if signal.file is None or signal.file in path.name]
    if len(chosen) != 1:
        found = f"{len(chosen)} files" + (
            f" whose name holds '{signal.file}'" if signal.file else ""
        )
        raise located.error(where, found, "one, to be told by 'file:'")
    topic, column = signal.topic, signal.column
    if mapping.format.kind in TOPIC_KINDS and topic is None:
        topic, column = _topic_of(column)
        if topic is None:
            raise located.error(
                where,
                "no topic",
                "the topic of an MCAP file or a bag, under 'topic:' or as '/topic.field'",
            )
    return Key(str(chosen[0]), topic, column)


def _topic_of(column: str | int) -> tuple[str | None, str | int]:
    """('/joint_states', 'position[knee]') of '/joint_states.position[knee]'."""
    if isinstance(column, str) and column.startswith("/"):
        topic, dot, field = column.partition(".")
        if dot and field:
            return topic, field
    return None, column


def _tables(
    mapping: Mapping, located: Located, keys: dict[str, Key]
) -> tuple[dict[tuple[str, str | None], Table], dict[str, dict[str, float]]]:
    """One table for each file and topic, with its clock's column; and the constants of each
    file.
    """
    wanted: dict[tuple[str, str | None], dict[str | int, None]] = {}
    for key in keys.values():
        wanted.setdefault((key.path, key.topic), {})[key.column] = None
    names = list(
        dict.fromkeys(s.scale_variable for s in mapping.signals.values() if s.scale_variable)
    )
    stamps = _stamps(mapping, located, keys)
    tables, constants = {}, {}
    for (path, topic), columns in wanted.items():
        stamp = stamps.get((path, topic), mapping.clock.column)
        if stamp is not None:
            columns[stamp] = None
        table, found = read_table(Path(path), topic, mapping.format, list(columns), names)
        if found:
            constants[path] = found
        tables[path, topic] = table
        if stamp is not None and stamp != mapping.clock.column:
            table.columns[mapping.clock.column] = table.columns[stamp]
    if mapping.clock.column is not None:
        _from_first(list(tables.values()), mapping.clock.column)
    return tables, constants


def _stamps(
    mapping: Mapping, located: Located, keys: dict[str, Key]
) -> dict[tuple[str, str | None], str]:
    """The field with the stamps of each topic that has one of its own."""
    found: dict[tuple[str, str | None], str] = {}
    for name, signal in mapping.signals.items():
        if signal.stamp is None:
            continue
        if mapping.clock.column is None:
            section = "measured" if name in mapping.measured else "commands"
            raise located.error(
                (section, name, "stamp"), "stamps beside a rate", "'column:' under clock"
            )
        found[keys[name].path, keys[name].topic] = signal.stamp
    return found


def _from_first(tables: Sequence[Table], column: str | int) -> None:
    """Takes the first stamp off all of them while they are whole numbers.

    A double holds stamps in ns of today to 256 ns only.
    """
    stamps = [table.columns[column] for table in tables]
    if all(values.dtype == np.int64 for values in stamps):
        origin = min(int(values[0]) for values in stamps)
        for table, values in zip(tables, stamps, strict=True):
            table.columns[column] = (values - origin).astype(np.float64)


def _is_discrete(name: str) -> bool:
    return name.endswith(("_open", "_enable", "_raw"))


def _trials(mapping: Mapping, grid: Grid, located: Located) -> tuple[Trial, ...]:
    """Trials by time; without any, the whole recording is one."""
    rows, trials, at = len(grid.cycle), [], 0
    stretches = mapping.trials if isinstance(mapping.trials, tuple) else ()
    for i, stretch in enumerate(stretches):
        start, stop = np.searchsorted(grid.t_s, (stretch.begin - 1e-9, stretch.end - 1e-9)).tolist()
        if start < at or stop <= start:
            lasts = grid.t_s[-1]
            raise located.error(
                ("trials", i),
                f"{stretch.begin:g} s to {stretch.end:g} s",
                f"rows of the file ({lasts:.6g} s long) after the trial before",
            )
        if start > at:
            trials.append(Trial("between", at, start, False))
        trials.append(Trial(stretch.name, start, stop, True))
        at = stop
    if stretches and at < rows:
        trials.append(Trial("after", at, rows, False))
    return tuple(trials) or (Trial("recording", 0, rows, True),)


def _numbers(table: Table, column: str | int) -> np.ndarray:
    """A column of trials' numbers, zero where it has no value. Raises ImportRefused for one that is
    none.
    """
    numbers = np.nan_to_num(table.columns[column])
    wrong = (numbers != np.rint(numbers)) | (np.abs(numbers) > _MOST_TRIALS)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise ImportRefused(
            f"{table.place(row)}: column {column}: found {numbers[row]:g}, expected the number of a"
            " trial, whole and at most a million"
        )
    return numbers


def _trials_by(values: np.ndarray) -> tuple[Trial, ...]:
    numbers = np.nan_to_num(values)
    cuts = [0, *(np.flatnonzero(np.diff(numbers)) + 1).tolist(), len(numbers)]
    return tuple(
        Trial(f"trial {numbers[a]:.0f}" if numbers[a] else "between", a, b, bool(numbers[a]))
        for a, b in zip(cuts, cuts[1:], strict=False)
    )
