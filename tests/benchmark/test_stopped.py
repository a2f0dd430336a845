"""Ctrl-C ends a making of cases at once, and neither it nor a lost recorder is a trip of the rig,
by which a case would change.
"""

from types import SimpleNamespace

import blind_fakes
import pytest

from epa_rt.cli import run
from epa_rt.cli.exits import VerbError
from epa_rt.cli.gap.blind import make
from epa_rt.cli.gap.blind import next as following
from epa_rt.cli.gap.blind.side_by_side import side_by_side


def test_nothing_else_begins_after_it(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        list(
            side_by_side(
                2, blind_fakes.stopped_at, [(str(tmp_path), n, 3) for n in range(40)], "cases made"
            )
        )
    begun = {int(path.name) for path in tmp_path.iterdir()}
    assert 3 in begun and max(begun) <= 5, begun


def test_all_is_made_and_counted_without_it(tmp_path, capsys):
    assert sorted(
        side_by_side(
            2, blind_fakes.stopped_at, [(str(tmp_path), n, -1) for n in range(5)], "cases made"
        )
    ) == list(range(5))
    assert capsys.readouterr().err.endswith("5 of 5 cases made\n")
    assert list(side_by_side(2, blind_fakes.stopped_at, [], "cases made")) == []


@pytest.mark.parametrize(
    "outcome, failure, raised",
    [
        ("stopped", "", KeyboardInterrupt),
        ("tripped", "disk full", VerbError),
        ("completed", "disk full", VerbError),
    ],
)
def test_a_run_that_was_stopped_or_not_recorded_is_no_outcome(
    tmp_path, short_case, monkeypatch, outcome, failure, raised
):
    folder, truth = short_case
    monkeypatch.setattr(
        run,
        "run_recorded",
        lambda *_, **__: (SimpleNamespace(failure=failure), SimpleNamespace(outcome=outcome)),
    )
    with pytest.raises(raised, match="recorder: disk full" if failure else None):
        make._record(
            folder / "short.yaml",
            folder / "rig.yaml",
            folder / "plant.yaml",
            None,
            tmp_path / "log.mcap",
        )
    (tmp_path / "case").mkdir()
    for name in ("rig.yaml", "plant.yaml", "case.json"):
        (tmp_path / "case" / name).write_bytes((folder / name).read_bytes())
    with pytest.raises(raised):
        following._failed(
            tmp_path / "case", truth, {"next_experiment": {"file": blind_fakes.SHORT}}
        )


def test_a_trip_is_one(tmp_path, short_case, monkeypatch):
    folder, _ = short_case
    monkeypatch.setattr(
        run,
        "run_recorded",
        lambda *_, **__: (SimpleNamespace(failure=""), SimpleNamespace(outcome="tripped")),
    )
    assert (
        make._record(
            folder / "short.yaml",
            folder / "rig.yaml",
            folder / "plant.yaml",
            None,
            tmp_path / "log.mcap",
        )[0]
        == "tripped"
    )
