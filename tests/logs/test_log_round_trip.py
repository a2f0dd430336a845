"""What is recorded is what is read."""

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from log_samples import ATTACHMENTS, LAYOUT, METADATA, record, sample_of

from epa_rt.logs.layout import SampleLayout
from epa_rt.logs.reader import LogError, LogReader
from epa_rt.logs.recorder import Recorder, RecorderError

SCALARS = (
    "cycle",
    "t_ns",
    "flags",
    "state",
    "phase",
    "lateness_ns",
    "busy_ns",
    "invalid_mask",
    "stale_mask",
)


def test_a_log_holds_all_that_was_recorded(whole_log):
    with LogReader(whole_log) as log:
        cycle = log.columns("/cycle")
        inputs_raw, outputs_raw = log.raw()
        samples = [sample_of(number) for number in range(9500)]
        for name in SCALARS:
            np.testing.assert_array_equal(cycle[name], [sample[name] for sample in samples])
        assert inputs_raw.tobytes() == b"".join(sample["inputs_raw"] for sample in samples)
        assert outputs_raw.tobytes() == b"".join(sample["outputs_raw"] for sample in samples)
        for group, names in LAYOUT.groups().items():
            columns = log.columns(f"/{group}")
            assert tuple(columns) == names
            for name in names:
                np.testing.assert_array_equal(
                    columns[name], [sample[group][name] for sample in samples]
                )
        assert log.columns("/estimate") == {}


def test_a_log_explains_itself(whole_log):
    with LogReader(whole_log) as log:
        assert log.layout == LAYOUT
        assert log.attachments == ATTACHMENTS
        assert log.metadata["run"] == METADATA["run"]
        assert log.outcome == "finished"
        assert log.ending.cause == "all phases done"
        assert log.missing == []


def test_events_come_back_in_order_and_end_with_the_outcome(whole_log):
    with LogReader(whole_log) as log:
        events = log.events()
    assert [event.cycle for event in events[:-1]] == list(range(0, 9500, 700))
    assert events[1].text == "inlet switched at 700"
    assert events[1].data == {"count": 700, "opened": True}
    assert (events[-1].kind, events[-1].text, events[-1].cycle) == ("end", "all phases done", 9499)


def test_cycles_can_be_walked_through(whole_log):
    with LogReader(whole_log) as log:
        walked = list(log.iterate_cycles())
    assert [cycle.cycle for cycle in walked] == list(range(9500))
    for number in (0, 1999, 2000, 9499):
        sample = sample_of(number)
        assert walked[number]._asdict() == {name: sample[name] for name in walked[number]._fields}


def test_only_the_columns_asked_for_are_read(whole_log):
    with LogReader(whole_log) as log:
        assert set(log.columns("/cycle", names=["t_ns", "flags"])) == {"t_ns", "flags"}
        tables = log.tables({"/measured": ["place3_pressure_pa"], "/command": None})
        assert set(tables["/measured"]) == {"place3_pressure_pa"}
        assert set(tables["/command"]) == set(LAYOUT.command)
        with pytest.raises(LogError, match="found no column 'speed', expected one of cycle, t_ns"):
            log.columns("/cycle", names=["speed"])
        with pytest.raises(LogError, match="found no columns for '/camera'"):
            log.columns("/camera")


def test_summary_counts_what_is_in_the_file(tmp_path):
    path = tmp_path / "log.mcap"
    summary = record(path, 2500)
    assert (summary.samples, summary.events, summary.lost_samples, summary.lost_events) == (
        2500,
        5,
        0,
        0,
    )
    assert summary.size_bytes == path.stat().st_size
    assert summary.failure is None


def test_closing_twice_gives_the_first_summary(open_recorder):
    recorder = open_recorder()
    first = recorder.close("tripped", "over-pressure")
    assert recorder.close("finished", "") is first


def test_a_log_without_samples_is_a_log(open_recorder, tmp_path):
    open_recorder().close("refused", "nothing was run")
    with LogReader(tmp_path / "log.mcap") as log:
        assert len(log.columns("/cycle")["cycle"]) == 0
        assert list(log.iterate_cycles()) == []
        assert log.outcome == "refused"
        assert log.missing == []


_int64 = st.integers(-(2**63), 2**63 - 1)
_names = st.integers(0, 40).map(lambda count: tuple(f"place_{k}_m" for k in range(count)))


@settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.data())
def test_any_sequence_of_samples_and_events_round_trips(tmp_path, data):
    draw = data.draw
    layout = SampleLayout(
        draw(st.integers(0, 200)),
        draw(st.integers(0, 200)),
        *(draw(_names) for _ in range(4)),
        (),
        (),
    )
    sample = st.fixed_dictionaries(
        {
            "cycle": st.integers(0, 2**64 - 1),
            "t_ns": st.integers(0, 2**64 - 1),
            "flags": st.integers(0, 2**32 - 1),
            "state": st.integers(-(2**31), 2**31 - 1),
            "phase": st.integers(-(2**31), 2**31 - 1),
            "lateness_ns": _int64,
            "busy_ns": _int64,
            "invalid_mask": st.integers(0, 2**64 - 1),
            "stale_mask": st.integers(0, 2**64 - 1),
            "inputs_raw": st.binary(min_size=layout.inputs_bytes, max_size=layout.inputs_bytes),
            "outputs_raw": st.binary(min_size=layout.outputs_bytes, max_size=layout.outputs_bytes),
            "seed": st.integers(0, 2**32 - 1),
        }
    )
    event = st.tuples(st.integers(0, 2**64 - 1), st.integers(0, 2**64 - 1), st.text(max_size=2000))
    sequence = draw(st.lists(st.one_of(sample, event), max_size=12))

    path = tmp_path / "log.mcap"
    path.unlink(missing_ok=True)
    recorder = Recorder(path, layout, {}, {}, lossless=True, slots=8)
    recorder.open()
    values = []
    for entry in sequence:
        if isinstance(entry, tuple):
            recorder.event(entry[0], entry[1], "request", entry[2], echo=entry[2])
        else:
            numbers = np.random.default_rng(entry["seed"]).normal(size=len(layout.values)).tolist()
            values.append(numbers)
            left = iter(numbers)
            groups = {
                group: {name: next(left) for name in getattr(layout, group)}
                for group in ("measured", "reference", "command", "estimate")
            }
            recorder.sample(
                **{key: value for key, value in entry.items() if key != "seed"}, **groups
            )
    summary = recorder.close("finished", "")

    samples = [entry for entry in sequence if isinstance(entry, dict)]
    events = [entry for entry in sequence if isinstance(entry, tuple)]
    assert (summary.samples, summary.events) == (len(samples), len(events) + 1)
    with LogReader(path) as log:
        assert log.missing == []
        cycle = log.columns("/cycle")
        for name in SCALARS:
            assert cycle[name].tolist() == [entry[name] for entry in samples]
        for name in ("inputs_raw", "outputs_raw"):
            assert cycle[name].tobytes() == b"".join(entry[name] for entry in samples)
        columns = [
            column for group in layout.groups() for column in log.columns(f"/{group}").values()
        ]
        if columns:
            np.testing.assert_array_equal(
                np.stack(columns, axis=1), np.reshape(values, (len(samples), len(columns)))
            )
        read = log.events()[:-1]
        assert [(one.cycle, one.t_ns, one.text) for one in read] == events
        assert [one.data for one in read] == [{"echo": entry[2]} for entry in events]


def test_what_json_cannot_hold_is_recorded_as_text(open_recorder, tmp_path):
    recorder = open_recorder()
    recorder.event(
        1, 1, "trip", "lone \ud800", limit_pa=float("nan"), file=Path("rig.yaml"), high=float("inf")
    )
    recorder.event(-1, -1, "trip", "", count=np.int64(3), masks=np.arange(2), small=np.float32(0.5))
    recorder.close("tripped", "x")
    with LogReader(tmp_path / "log.mcap") as log:
        event, before, _ = log.events()
    assert (before.cycle, before.t_ns) == (0, 0)
    assert before.data == {"count": 3, "masks": [0, 1], "small": 0.5}
    assert event.text == "lone ?"
    assert event.data == {"limit_pa": "NaN", "file": "rig.yaml", "high": "Infinity"}


@pytest.mark.parametrize(
    "change, message",
    [
        ({"inputs_raw": b"123"}, "found raw images of 3 and 5 bytes, expected 13 and 5"),
        ({"reference": {}}, "expected"),
        ({"cycle": -1}, "int|argument|range"),
    ],
)
def test_a_sample_that_does_not_fit_is_refused(open_recorder, change, message):
    recorder = open_recorder()
    with pytest.raises((ValueError, struct.error), match=message):
        recorder.sample(**(sample_of(0) | change))
    assert recorder.close("finished", "").samples == 0


def test_a_file_that_cannot_be_made_is_said(tmp_path):
    recorder = Recorder(tmp_path / "no" / "log.mcap", LAYOUT, {}, {}, True)
    with pytest.raises(
        RecorderError, match="cannot write .*no/log.mcap: no such file or directory"
    ):
        recorder.open()


@pytest.mark.parametrize(
    "groups, message",
    [
        ((("a b",), (), (), ()), "measured: found 'a b', expected letters"),
        (((), ("a", "a"), (), ()), "reference: found 'a' twice"),
        (
            (tuple(f"m{k}" for k in range(65)), (), (), ()),
            "found 65 measured rows, expected at most 64",
        ),
    ],
)
def test_a_layout_that_cannot_be_columns_is_refused(groups, message):
    with pytest.raises(ValueError, match=message):
        SampleLayout(1, 1, *groups, (), ())


def test_the_log_keeps_its_own_metadata_names():
    with pytest.raises(ValueError, match="found metadata 'outcome', expected another name"):
        Recorder("log.mcap", LAYOUT, {}, {"outcome": {}}, True)
