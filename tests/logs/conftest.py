"""Logs recorded through the real recorder process."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from log_samples import ATTACHMENTS, LAYOUT, METADATA, record

from epa_rt.logs.layout import SampleLayout
from epa_rt.logs.recorder import Recorder


@pytest.fixture(scope="session")
def whole_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log of 9500 samples: four whole chunks and a part of one."""
    path = tmp_path_factory.mktemp("logs") / "whole.mcap"
    record(path, 9500)
    return path


@pytest.fixture
def open_recorder(tmp_path: Path) -> Callable[..., Recorder]:
    """Opens recorders, and sees to it that none outlives its test."""
    opened: list[Recorder] = []

    def opens(
        path: Path = tmp_path / "log.mcap", layout: SampleLayout = LAYOUT, **options: object
    ) -> Recorder:
        recorder = Recorder(path, layout, ATTACHMENTS, METADATA, **({"lossless": True} | options))
        recorder.open()
        opened.append(recorder)
        return recorder

    yield opens
    for recorder in opened:
        recorder.close("finished", "end of the test")
