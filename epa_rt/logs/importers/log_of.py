"""Files of others as a log of ours, by a mapping: read, gathered and written in one go."""

from collections.abc import Sequence
from pathlib import Path

from epa_rt.logs.importers.gather import gather
from epa_rt.logs.importers.mapping import load_mapping
from epa_rt.logs.importers.write import attachments_of, write_log


def log_of(mapping: Path, files: Sequence[Path], log: Path) -> Path:
    """Writes ``log`` and returns it. Raises ConfigError, ImportRefused, and what write_log does."""
    typed, located = load_mapping(mapping)
    gathered = gather(typed, located, files)
    write_log(log, typed, gathered, attachments_of(typed, located, files), files)
    return log
