"""Whether every case of the blind benchmark is as it was made, before hours of diagnoses and before
the truth is opened: what is broken is no wrong answer.
"""

from pathlib import Path

from epa_rt.cli.exits import VerbError
from epa_rt.config.json_file import read_json

ASKED = {"rig": str, "plant": str, "logs": list, "holdout": list, "leave_out": list}


def check_cases(cases: Path) -> None:
    """Raises VerbError or ConfigError for the first file of a case that is missing, cut or no such
    file.
    """
    folders = sorted(path for path in cases.glob("case_*") if path.is_dir())
    if not folders:
        raise VerbError(
            f"{cases}: found no folder case_000, expected the cases that epa gap blind make wrote"
        )
    for folder in folders:
        _check_case(folder, _told(folder / "case.json"))


def _told(path: Path) -> dict:
    """What a case says of itself."""
    told = read_json(path, "what epa gap blind make wrote of the case", VerbError)
    for key, kind in ASKED.items():
        found = told.get(key) if isinstance(told, dict) else None
        if (
            not isinstance(found, kind)
            or kind is list
            and not all(isinstance(one, str) for one in found)
        ):
            raise VerbError(
                f"{path}: {key}: found {found!r}, expected {'names' if kind is list else 'a name'},"
                " as epa gap blind make wrote them"
            )
    return told


def _check_case(folder: Path, told: dict) -> None:
    from epa_rt.gap.rig.subjects import open_subject
    from epa_rt.logs.reader import LogError, LogReader

    open_subject(folder / told["rig"], folder / told["plant"])
    for log in (*told["logs"], *told["holdout"]):
        try:
            with LogReader(folder / log) as reader:
                wrong = reader.missing
        except LogError as error:
            raise VerbError(str(error)) from None
        if wrong:
            raise VerbError(
                f"{folder / log}: found that {wrong[0]}, expected a whole log, as epa gap blind"
                " make recorded it"
            )
