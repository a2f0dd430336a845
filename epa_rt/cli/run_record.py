"""What the command line adds to a log: operator, specimens, notes, wall-clock start, git state."""

import argparse
import os
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.exits import VerbError

if TYPE_CHECKING:
    from epa_rt.config.operator_file import OperatorFile
    from epa_rt.config.rig import Rig
    from epa_rt.logs.run_record import RunRecord

_GIT_S = 5.0  # a repository on a slow disk must not keep a run waiting for longer
_LONGEST = {"--operator": 200, "--note": 2000}  # characters, as in the operator file


def add_record_arguments(verb: argparse.ArgumentParser) -> None:
    """--operator and --note."""
    verb.add_argument(
        "--operator",
        metavar="NAME",
        help="who runs (default: that of operator.yaml beside the rig file, else the login name)",
    )
    verb.add_argument(
        "--note",
        action="append",
        default=[],
        metavar="TEXT",
        help="a sentence that the log keeps; may be given several times",
    )


def record_attachment(
    rig: "Rig", rig_path: Path, operator: str | None, notes: list[str]
) -> dict[str, bytes]:
    """The attachment of a run that starts now. Raises ConfigError where the operator file beside
    the rig file is not sound, VerbError for an option that is too long.
    """
    from epa_rt.logs.run_record import RECORD

    return {RECORD: record_of_start(rig, rig_path, operator, notes).to_bytes()}


def record_of_start(
    rig: "Rig", rig_path: Path, operator: str | None, notes: list[str]
) -> "RunRecord":
    """As record_attachment, typed."""
    from epa_rt.cli.zero import now
    from epa_rt.config.operator_file import OperatorFile, RigAsBuilt, operator_path, read_operator
    from epa_rt.logs.run_record import RunRecord

    for option, texts in (("--operator", [operator or ""]), ("--note", notes)):
        for text in texts:
            if len(text) > _LONGEST[option]:
                raise VerbError(
                    f"{option}: found {len(text)} characters, expected at most {_LONGEST[option]}"
                )
    muscles = tuple(muscle.name for muscle in rig.muscles)
    said = read_operator(operator_path(rig_path), rig.name, muscles) or OperatorFile()
    built = said.rigs.get(rig.name, RigAsBuilt())
    name, source = _operator(operator, said)
    commit, changed = git_state()
    return RunRecord(
        operator=name,
        operator_from=source,
        rig_serial=built.serial,
        muscles=dict(built.muscles),
        notes=tuple(text for text in (said.note, built.note, *notes) if text),
        started=now(),
        commit=commit,
        changed=changed,
    )


def _operator(option: str | None, said: "OperatorFile") -> tuple[str, str]:
    from epa_rt.cli.zero import who

    login = who()
    candidates = ((option, "option"), (said.operator, "file"), (login, "login"))
    return next(((name, source) for name, source in candidates if name), ("", ""))


def git_state() -> tuple[str, bool]:
    """Commit of the running code and whether tracked files differ from it; ('', False) where it is
    no git checkout or git is not there.
    """
    folder = Path(__file__).resolve().parents[2]
    if not (folder / ".git").exists():
        return "", False
    quiet = {"GIT_OPTIONAL_LOCKS": "0", "LC_ALL": "C"}

    def ask(*words: str) -> str | None:
        try:
            found = subprocess.run(
                ["git", "-C", str(folder), *words],
                capture_output=True,
                text=True,
                timeout=_GIT_S,
                env=os.environ | quiet,
            )
        except (OSError, subprocess.TimeoutExpired):
            return None
        return found.stdout.strip() if found.returncode == 0 else None

    commit = ask("rev-parse", "HEAD")
    if not commit:
        return "", False
    return commit, bool(ask("status", "--porcelain", "--untracked-files=no"))
