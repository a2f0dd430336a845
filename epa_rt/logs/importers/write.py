"""What was gathered, written as a log of ours with the recorder's own layout code: whole, or not at
all.
"""

import hashlib
import json
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from epa_rt.config.source import Located
from epa_rt.logs.importers.gather import Gathered
from epa_rt.logs.importers.mapping import Mapping
from epa_rt.logs.importers.rig_text import rig_text
from epa_rt.logs.importers.table import ImportRefused
from epa_rt.logs.layout import FLAG_WORKING_COUNTER_OK, SampleLayout
from epa_rt.logs.mcap_file import McapFile
from epa_rt.logs.recording import Ending, Recording
from epa_rt.logs.ring import KIND_SAMPLE, slot_dtype

IMPORTED = "imported"
_ROWS_AT_ONCE = 20_000


def attachments_of(mapping: Mapping, located: Located, files: Sequence[Path]) -> dict[str, bytes]:
    """Mapping, rig file where the mapping names one, and the files' digests. Raises ConfigError
    where they do not fit.
    """
    sources = [_source(name, path) for given in files for name, path in _parts(given)]
    found = {
        "mapping.yaml": located.text.encode(),
        "sources.json": json.dumps(sources, indent=1).encode(),
    }
    if mapping.rig_file is not None:
        found["rig.yaml"] = rig_text(mapping, located).encode()
    return found


def _parts(path: Path) -> list[tuple[str, Path]]:
    """A file under its name, or the files of a bag's folder under the folder's."""
    if not path.is_dir():
        return [(path.name, path)]
    return [
        (f"{path.absolute().name}/{one.name}", one)
        for one in sorted(path.iterdir())
        if one.is_file()
    ]


def _source(name: str, path: Path) -> dict[str, str | int]:
    try:
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        return {"name": name, "bytes": path.stat().st_size, "sha256": digest}
    except OSError as error:
        raise ImportRefused(f"{path}: cannot be read ({error.strerror})") from None


def write_log(
    path: Path,
    mapping: Mapping,
    gathered: Gathered,
    attachments: dict[str, bytes],
    sources: Sequence[Path],
) -> None:
    """Writes beside ``path`` and takes its name at the end. Raises ImportRefused where it exists,
    OSError where it cannot be written.
    """
    if path.exists():
        raise ImportRefused(
            f"{path}: found a file, expected a name that is free (no log is overwritten)"
        )
    partial = path.with_name(f".{path.name}.{os.getpid()}.part")
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        file = McapFile(os.fspath(partial), sync=False)
        try:
            _write(file, mapping, gathered, attachments, sources)
        finally:
            file.close()
        os.link(
            partial, path
        )  # unlike a rename it never takes the place of a file that has come meanwhile
    except FileExistsError:
        raise ImportRefused(
            f"{path}: found a file, expected a name that is free (no log is overwritten)"
        ) from None
    except ValueError as error:
        raise ImportRefused(f"{path}: cannot be written ({error})") from None
    finally:
        if partial.exists():  # not so where the folder is a file
            partial.unlink(missing_ok=True)


def _write(
    file: McapFile,
    mapping: Mapping,
    gathered: Gathered,
    attachments: dict[str, bytes],
    sources: Sequence[Path],
) -> None:
    grid = gathered.grid
    layout = SampleLayout(
        0,
        0,
        tuple(gathered.measured),
        tuple(gathered.references),
        tuple(gathered.commands),
        (),
        ("run",),
        tuple(trial.name for trial in gathered.trials),
    )
    facts = {
        "rig": mapping.rig,
        "experiment": mapping.experiment or mapping.mapping,
        "backend": "import",
        "speed": "1",
        "period_s": f"{grid.period_s:.12g}",
    }
    Recording.begin(file, layout, attachments, {"run": facts})
    recording = Recording(file, layout)
    t_ns = np.rint(grid.t_s * 1e9).astype(np.int64)
    for sentence in gathered.says:
        recording.event(0, 0, "import", sentence, {})
    judged = 0
    for index, trial in enumerate(gathered.trials):
        cycle, stamp = int(grid.cycle[trial.start]), int(t_ns[trial.start])
        data = {
            "phase": trial.name,
            "index": index,
            "cycle": cycle,
            "trial_index": judged if trial.judged else None,
        }
        recording.event(cycle, stamp, "phase_start", trial.name, data)
        judged += trial.judged
    slots = _slots(layout, gathered, t_ns)
    for begin in range(0, len(slots), _ROWS_AT_ONCE):
        recording.feed(slots[begin : begin + _ROWS_AT_ONCE])
    recording.ending = Ending(
        IMPORTED, "from " + ", ".join(path.absolute().name for path in sources)
    )
    recording.finish()


def _slots(layout: SampleLayout, gathered: Gathered, t_ns: np.ndarray) -> np.ndarray:
    slots = np.zeros(len(t_ns), slot_dtype(layout))
    slots["kind"], slots["flags"] = KIND_SAMPLE, FLAG_WORKING_COUNTER_OK
    slots["cycle"], slots["t_ns"] = gathered.grid.cycle, t_ns
    for index, trial in enumerate(gathered.trials):
        slots["phase"][trial.start : trial.stop] = index
    for i, values in enumerate(
        [*gathered.measured.values(), *gathered.references.values(), *gathered.commands.values()]
    ):
        slots["values"][:, i] = values
        if i < len(gathered.measured):
            slots["invalid_mask"] |= np.isnan(values).astype(np.uint64) << np.uint64(i)
    return slots
