"""The line that an operator watches."""

import io

import pytest
from log_samples import record

from epa_rt.logs.progress import ProgressLine, ProgressSpec

STATES, PHASES = ("bring_up", "running"), ("no_load", "trial_1")


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def line_on(stream):
    return ProgressLine(ProgressSpec(200_000, 0.001), STATES, PHASES, stream)


def test_it_tells_state_phase_time_share_end_and_fill():
    stream = io.StringIO()
    line = line_on(stream)
    line.update(10.0, 0, 0, -1, 0.0)
    line.update(20.0, 50_000, 1, 1, 0.031)
    assert stream.getvalue().splitlines() == [
        "bring_up | - | 00:00 of 03:20 |   0 % | --:-- left | buffer 0 % full",
        "running | trial_1 | 00:50 of 03:20 |  25 % | 00:30 left | buffer 3 % full",
    ]


def test_a_terminal_is_written_over_and_left_on_a_new_line():
    stream = Terminal()
    line = line_on(stream)
    for step in range(9):
        line.update(step / 8, step * 1000, 1, 0, 0.0)
    line.finish()
    line.finish()
    written = stream.getvalue()
    assert written.count("\r") == 6  # one in four a second, and the last
    assert written.count("\n") == 1
    assert written.rstrip().endswith("\rrunning | no_load | 00:08 of 03:20 | buffer 0 % full")


def test_a_long_phase_leaves_out_the_buffer_and_cuts_no_figure():
    stream, phases = Terminal(), ("phase" * 6,)
    line = ProgressLine(ProgressSpec(200_000, 0.001), STATES, phases, stream)
    line.update(0.0, 0, 0, 0, 0.0)
    shown = stream.getvalue().strip()
    assert len(shown) < 80 and shown.endswith("--:-- left")


def test_a_file_gets_a_line_every_ten_seconds():
    stream = io.StringIO()
    line = line_on(stream)
    for second in range(25):
        line.update(float(second), second * 1000, 1, 0, 0.0)
    assert len(stream.getvalue().splitlines()) == 3


def test_more_cycles_than_estimated_are_all_of_them():
    line = line_on(io.StringIO())
    assert "04:10 of 04:10 | 100 % |" in line.text(1.0, 250_000, 1, 0, 0.0)


def test_where_nobody_knows_how_long_no_share_is_told():
    line = ProgressLine(ProgressSpec(0, 0.001), STATES, PHASES, io.StringIO())
    assert line.text(1.0, 65_000, 1, 0, 0.0) == "running | no_load | 01:05 | buffer 0 % full"


def test_hours_are_told():
    assert "1:00:00 of 1:00:00" in line_on(io.StringIO()).text(0.0, 3_600_000, 1, 0, 0.0)


def test_a_terminal_that_went_away_costs_nothing():
    stream = Terminal()
    line = line_on(stream)
    stream.close()
    line.update(0.0, 1, 0, 0, 0.0)
    line.finish()


@pytest.mark.parametrize("enabled", [True, False])
def test_the_recorder_prints_it(tmp_path, capfd, enabled):
    record(tmp_path / "log.mcap", 2500, progress=ProgressSpec(2500, 0.001, enabled))
    lines = capfd.readouterr().err.splitlines()
    assert bool(lines) == enabled
    if enabled:
        assert lines[-1].startswith("bring_up | trial_1 | 00:02 of 00:02 | buffer")
