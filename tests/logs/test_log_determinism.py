"""Same samples, same bytes: however fast or slow the recorder was handed them."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from log_samples import LAYOUT, record, sample_of

from epa_rt.logs import recording
from epa_rt.logs.mcap_file import McapFile
from epa_rt.logs.recording import Recording
from epa_rt.logs.ring import EVENT_HEAD, KIND_EVENT_END, KIND_SAMPLE, slot_dtype

NAMES = (
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


def test_two_recordings_of_the_same_are_the_same_bytes(tmp_path):
    first, second = tmp_path / "1.mcap", tmp_path / "2.mcap"
    record(first, 5000)
    record(second, 5000, slots=64)
    assert first.read_bytes() == second.read_bytes()


@pytest.fixture(scope="module")
def slots():
    """200 samples with an event after every 9th, as ring slots."""
    rows = np.zeros(222, slot_dtype(LAYOUT))
    for number, row in enumerate(rows):
        if number % 10 == 9:
            text = f'[{number}, {number * 10**8}, "valve", "open", {{}}]'.encode()
            row["kind"] = KIND_EVENT_END
            content = bytearray(rows.itemsize)
            EVENT_HEAD.pack_into(content, 0, KIND_EVENT_END, len(text))
            content[EVENT_HEAD.size : EVENT_HEAD.size + len(text)] = text
            rows[number : number + 1] = np.frombuffer(bytes(content), rows.dtype)
        else:
            sample = sample_of(number) | {"t_ns": number * 10**8}
            row["kind"] = KIND_SAMPLE
            for name in NAMES:
                row[name] = sample[name]
            row["values"] = [value for group in LAYOUT.groups() for value in sample[group].values()]
    return rows


def written(path, slots, cuts):
    path.unlink(missing_ok=True)
    file = McapFile(str(path), sync=False)
    one = Recording(file, LAYOUT)
    Recording.begin(file, LAYOUT, {}, {})
    for begin, end in zip([0, *cuts], [*cuts, len(slots)], strict=True):
        one.feed(slots[begin:end])
    one.finish()
    file.close()
    return path.read_bytes()


@settings(
    deadline=None, max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(cuts=st.lists(st.integers(0, 222)).map(sorted))
def test_batches_do_not_show_in_the_file(tmp_path, monkeypatch, slots, cuts):
    monkeypatch.setattr(recording, "SAMPLES_PER_CHUNK", 23)
    monkeypatch.setattr(recording, "EVENTS_PER_CHUNK", 2)
    assert written(tmp_path / "cut.mcap", slots, cuts) == written(
        tmp_path / "whole.mcap", slots, []
    )
