"""A log replays alone, byte for byte; what was changed is found at its first cycle."""

import pytest

from epa_rt.cli.main import main
from epa_rt.logs.reader import LogReader
from epa_rt.logs.recorder import Recorder
from epa_rt.logs.replay import Comparison, recorded_cycles
from tests.cli.shell import EXPERIMENTS, RIGS, epa_here


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("replay")
    for experiment, rig in (
        ("identification_short", "bench"),
        ("identification_short", "bench_analog"),
        ("knee_chirp_short", "knee"),
    ):
        done = epa_here(
            "run",
            EXPERIMENTS / f"{experiment}.yaml",
            "--rig",
            RIGS / f"{rig}.yaml",
            "-o",
            folder,
            "--quiet",
        )
        assert done.returncode == 0, done.stdout + done.stderr
    return sorted(folder.glob("*.mcap"))


def test_every_output_byte_of_every_rig_is_the_same(logs, capsys):
    assert main(["replay", *map(str, logs)]) == 0
    assert capsys.readouterr().out.count("every output byte identical") == len(logs)


@pytest.mark.parametrize("rig", ["bench", "bench_analog"])
def test_a_trip_in_mid_run_replays_through_its_stop(rig, tmp_path, capsys):
    text = (RIGS / f"{rig}.yaml").read_text()
    text = text.replace("limits: [-40 N, 350 N]", "limits: [-40 N, 30 N]")
    text = text.replace("../plants/bench.yaml", str(RIGS.parent / "plants/bench.yaml"))
    (tmp_path / "weak.yaml").write_text(text)
    log = tmp_path / "trip.mcap"
    words = ("--rig", str(tmp_path / "weak.yaml"), "-o", str(log), "--quiet")
    assert main(["run", str(EXPERIMENTS / "identification_short.yaml"), *words]) == 3
    with LogReader(log) as reader:
        states = reader.columns("/cycle")["state"]
        passed = [reader.layout.states[i] for i in dict.fromkeys(states.tolist())]
        assert "(at rest; vented)" in reader.ending.end
    assert passed[-4:] == ["brake", "vent", "safe", "done"]
    capsys.readouterr()
    assert main(["replay", str(log)]) == 0
    assert "every output byte identical" in capsys.readouterr().out


def test_a_log_cut_in_the_middle_replays_up_to_its_last_whole_chunk(logs, tmp_path, capsys):
    cut = tmp_path / "cut.mcap"
    data = logs[0].read_bytes()
    cut.write_bytes(data[: len(data) * 2 // 3])
    assert main(["replay", str(cut)]) == 1, "not whole, though every byte is the same"
    out = capsys.readouterr().out
    assert "every output byte identical" in out and len(out.splitlines()) >= 2


def test_a_changed_output_is_found_at_its_cycle(logs):
    with LogReader(logs[0]) as reader:
        cycles = recorded_cycles(reader)
        comparison = Comparison(cycles)
        for i in range(300):
            sent = bytes(cycles.outputs_bytes) if i == 123 else cycles.outputs_raw(i)
            comparison.sample(
                cycles.cycle[i],
                cycles.t_ns[i],
                cycles.flags[i],
                cycles.state[i],
                cycles.phase[i],
                0,
                0,
                0,
                0,
                b"",
                sent,
            )
    assert comparison.different == 1 and comparison.first[0] == 123


def test_other_gains_in_the_log_give_other_bytes_and_name_the_entry(
    logs, tmp_path, capsys, monkeypatch
):
    from epa_rt.cli import replay

    whole = replay.inputs_of_log

    def altered(path, attachments):
        rig = attachments["rig.yaml"].replace(b"position_gain: 10 1/s", b"position_gain: 12 1/s")
        assert rig != attachments["rig.yaml"]
        return whole(path, {**attachments, "rig.yaml": rig})

    monkeypatch.setattr(replay, "inputs_of_log", altered)
    assert main(["replay", str(logs[0])]) == 1
    assert "drive.target_speed" in capsys.readouterr().out


def test_what_is_not_a_log_is_one_sentence(tmp_path, capsys):
    path = tmp_path / "not.mcap"
    path.write_text("hello")
    assert main(["replay", str(path)]) == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1


def test_a_log_that_cannot_be_replayed_does_not_keep_the_next_from_it(logs, tmp_path, capsys):
    """Made by another version of the code, or with files that no longer read: one sentence each,
    then on.
    """

    def relabelled(name, attachment, change):
        log = tmp_path / f"{name}.mcap"
        with LogReader(logs[0]) as reader:
            attachments = dict(reader.attachments)
            attachments[attachment] = change(attachments[attachment])
            recorder = Recorder(log, reader.layout, attachments, {}, lossless=True)
            inputs, outputs = reader.raw()
            recorder.open()
            values = [{name: 0.0 for name in group} for group in reader.layout.groups().values()]
            recorder.sample(
                0, 0, 1, 0, -1, 0, 0, 0, 0, inputs[0].tobytes(), outputs[0].tobytes(), *values
            )
            recorder.close("completed", "")
        return log

    mixed = (
        b"experiment: mixed\nloop: motor_speed\nphases:\n  - {name: a, for: 1 s}\n  - {name: b,"
        b" loop: motor_torque, for: 1 s}\n"
    )
    broken = [
        relabelled("old", "rig.yaml", lambda text: text.replace(b"description:", b"descr:")),
        relabelled(
            "latin", "rig.yaml", lambda text: text.replace(b"description: ", b"description: \xe9")
        ),
        relabelled("mixed", "experiment.yaml", lambda text: mixed),
    ]
    assert main(["replay", *map(str, broken), str(logs[0])]) == 2
    out, err = capsys.readouterr()
    assert len(err.splitlines()) == 3 and all(
        log.name in line for log, line in zip(broken, err.splitlines(), strict=True)
    )
    assert "every output byte identical" in out
