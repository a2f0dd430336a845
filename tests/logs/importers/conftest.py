"""epa import in this process: exit code, what it said, and whether it left a file behind."""

from collections.abc import Callable
from pathlib import Path

import pytest

from epa_rt.cli.main import main


@pytest.fixture
def imported(tmp_path: Path, capsys: pytest.CaptureFixture) -> Callable[..., tuple[int, str, Path]]:
    count = 0

    def run(
        mapping: str | Path, *files: Path, arguments: tuple[str, ...] = ()
    ) -> tuple[int, str, Path]:
        nonlocal count
        count += 1
        if isinstance(mapping, str):
            (tmp_path / f"map_{count}.yaml").write_text(mapping)
            mapping = tmp_path / f"map_{count}.yaml"
        out = tmp_path / f"out_{count}" / "log.mcap"
        code = main(["import", str(mapping), *map(str, files), "-o", str(out), *arguments])
        said = capsys.readouterr()
        if code:
            assert (
                code == 2
                and not said.out
                and said.err.count("\n") == 1
                and said.err.startswith("epa import: ")
            ), said
            assert not out.parent.exists() or not list(out.parent.iterdir())
        return code, said.err or said.out, out

    return run
