"""The name of a run's log: a free one, taken at once, so that no log is overwritten."""

from pathlib import Path

from epa_rt.cli.exits import VerbError
from epa_rt.cli.inputs import Inputs
from epa_rt.cli.write import cannot_write, written_to

_NOT_FREE = "{}: found a file, expected a name that is free (no log is overwritten)"


def take_log_path(out: Path, inputs: Inputs) -> Path:
    """The log's path: as given where it ends in .mcap (and must be new), else a numbered name in
    the folder.

    The file is made here, empty, so that a run that starts at the same time takes another name.
    """
    folder = out.parent if out.suffix == ".mcap" else out
    with written_to(out if out.suffix == ".mcap" else folder / "*.mcap"):
        folder.mkdir(parents=True, exist_ok=True)
    if out.suffix == ".mcap":
        check_free(out)
        if not _taken(out):
            raise VerbError(_NOT_FREE.format(out))
        return out
    stem = f"{inputs.experiment.name}-{inputs.rig.name}"
    return next(
        path for n in range(1, 1_000_000) if _taken(path := folder / f"{stem}-{n:03d}.mcap")
    )


def check_free(out: Path) -> None:
    """Raises VerbError where ``out`` names a log that is there; asked before anything slow."""
    if out.suffix == ".mcap" and (out.exists() or out.is_symlink()):
        raise VerbError(_NOT_FREE.format(out))


def _taken(path: Path) -> bool:
    """Makes the file; False where there is one. Raises VerbError where none can be made."""
    try:
        path.touch(0o644, exist_ok=False)
    except FileExistsError:
        return False
    except OSError as error:
        raise cannot_write(path, error) from None
    return True
