"""Logs as the diagnosis reads them."""

import dataclasses

import numpy as np
import pytest

from epa_rt.gap.rig.read import misfits, read_recording, read_recordings
from epa_rt.logs.reader import LogError, LogReader
from epa_rt.signals.codec import Encoder
from epa_rt.signals.sent import sent_columns
from tests.cli.shell import RIGS, epa_here
from tests.gap.recorded import log_of, recording_of, rig_of_name
from tests.report.rigs import rig_that_trips

RIG_NAMES = ("bench", "bench_analog", "knee", "mass")


@pytest.mark.parametrize("name", RIG_NAMES)
def test_every_output_comes_back_as_it_was_sent(name):
    rig = rig_of_name(name)
    encoder, random = Encoder(rig), np.random.default_rng(3)
    asked, images = [], []
    for _ in range(200):
        command = {}
        for row in rig.outputs:
            if row.limits is not None:
                command[row.name] = random.uniform(*row.limits)
            else:
                command[row.name] = float(
                    random.integers(0, 2 if not row.name.endswith("_raw") else 16)
                )
        asked.append(command)
        images.append(encoder.encode(command))
    sent = sent_columns(rig, np.frombuffer(b"".join(images), np.uint8).reshape(len(images), -1))
    assert list(sent) == [row.name for row in rig.outputs]
    again = [
        encoder.encode({name: float(values[k]) for name, values in sent.items()})
        for k in range(len(images))
    ]
    assert again == images
    for row in rig.outputs:
        error = np.abs(sent[row.name] - [command[row.name] for command in asked])
        assert error.max() <= (0.01 * (row.limits[1] - row.limits[0]) if row.limits else 0.0)


def test_images_of_another_size_are_refused():
    with pytest.raises(ValueError, match="found output images of 3 bytes, expected"):
        sent_columns(rig_of_name("bench"), np.zeros((5, 3), np.uint8))


def test_a_log_has_measured_columns_commands_as_sent_and_trials():
    path = log_of("bench", "identification_short")
    recording = read_recording(path)
    with LogReader(path) as log:
        measured, asked, cycle = (
            log.columns("/measured"),
            log.columns("/command"),
            log.columns("/cycle", ["cycle", "t_ns"]),
        )
    assert (recording.rig, recording.plant, recording.experiment, recording.period_s) == (
        "bench",
        "bench",
        "identification_short",
        1e-3,
    )
    assert np.array_equal(recording.cycle, cycle["cycle"]) and np.array_equal(
        recording.t_ns, cycle["t_ns"]
    )
    assert all(np.array_equal(recording.columns[name], values) for name, values in measured.items())
    speed = recording.columns["cmd_motor_speed_m_s"]
    assert np.any(speed != asked["cmd_motor_speed_m_s"])  # whole rpm went out
    assert np.abs(speed - asked["cmd_motor_speed_m_s"]).max() < 6e-5  # of the same row
    trials = [span for span in recording.spans if span.trial]
    assert [span.stop - span.start for span in trials] == [5000, 5000] and all(
        span.name.startswith("trial") for span in trials
    )
    assert {"rig.yaml", "plant.yaml", "experiment.yaml"} <= set(recording.attachments)
    assert recording.found == ()


def test_a_cut_log_says_what_is_missing(tmp_path):
    data = log_of("bench", "identification_short").read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: len(data) // 2])
    recording = read_recording(cut)
    assert any("the file was cut at byte" in sentence for sentence in recording.found)
    assert 0 < recording.samples < recording_of("bench", "identification_short").samples


def test_a_trip_is_said(tmp_path):
    log = tmp_path / "tripped.mcap"
    epa_here(
        "run",
        "config/experiments/identification_short.yaml",
        "--rig",
        rig_that_trips(tmp_path),
        "-o",
        log,
        "--quiet",
    )
    assert any(sentence.startswith("trip at ") for sentence in read_recording(log).found)


def test_no_log_is_one_sentence(tmp_path):
    (tmp_path / "text.mcap").write_text("no log")
    for path in (tmp_path / "text.mcap", tmp_path / "nowhere.mcap"):
        with pytest.raises(LogError, match="found .*, expected "):
            read_recording(path)


def test_what_does_not_fit_the_rig_is_said(tmp_path):
    recording = recording_of("bench", "identification_short")
    assert misfits(recording, rig_of_name("bench")) == []
    said = " ".join(misfits(recording, rig_of_name("bench_analog")))
    assert (
        "recorded on the rig 'bench', expected 'bench_analog'" in said
        and "cmd_drive_enable" in said
    )
    text = (
        (RIGS / "bench.yaml")
        .read_text()
        .replace("value: [0 N, 500 N]", "value: [0 N, 250 N]")
        .replace("period: 1 ms", "period: 2 ms")
    )
    other = dataclasses.replace(recording, attachments={"rig.yaml": text.encode()})
    said = " ".join(misfits(other, rig_of_name("bench")))
    assert (
        "muscle_force_n was recorded with calibration" in said
        and "0 N to 250 N" in said
        and "period of 2 ms" in said
    )
    found = read_recordings([log_of("bench", "identification_short")], rig_of_name("bench_analog"))[
        0
    ].found
    assert any("expected 'bench_analog'" in sentence for sentence in found)


def test_a_column_that_its_raw_bytes_do_not_say_is_found(monkeypatch):
    import epa_rt.gap.rig.read as read

    def another(rig, raw):
        columns = received(rig, raw)
        return columns | {"muscle_force_n": columns["muscle_force_n"] * 1000.0}

    received = read.received_columns
    monkeypatch.setattr(read, "received_columns", another)
    found = read_recording(log_of("bench", "identification_short")).found
    assert len(found) == 1 and found[0].startswith("muscle_force_n is not what its raw bytes say")
