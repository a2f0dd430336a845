"""epa import in this process: exit code, what it said, and whether it left a file behind."""

import importlib
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from epa_rt.cli.main import main
from epa_rt.logs.importers import parquet_table, ros_table


@pytest.fixture
def readers_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sound files of Parquet and bags are read without a process for each: test_same_motion.py."""

    def read(reader: str, request: dict, own_bytes: int):
        child = importlib.import_module(f"epa_rt.logs.importers.{reader}")
        facts, columns = child.answer(json.loads(json.dumps(request)))
        kinds = {name: "<i8" if c.dtype.kind == "i" else "<f8" for name, c in columns.items()}
        plain = {name: np.ascontiguousarray(c, kinds[name]) for name, c in columns.items()}
        return json.loads(json.dumps(facts)), plain

    for table in (parquet_table, ros_table):
        monkeypatch.setattr(table, "read_apart", read)


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
