"""Who ran what: in every log, in one attachment, and in no other byte."""

from __future__ import annotations

import json
import shutil

import pytest
from hypothesis import given
from hypothesis import strategies as st

from epa_rt.cli.main import main
from epa_rt.logs.reader import LogReader
from epa_rt.logs.run_record import RECORD, RunRecord, record_of
from tests.cli.shell import RIGS, ROOT
from tests.runs.conftest import recorded

WORDS = st.text(st.characters(exclude_categories=["Cs"]), max_size=200)


@given(
    st.builds(
        RunRecord,
        WORDS,
        st.sampled_from(["", "option", "file", "login"]),
        WORDS,
        st.dictionaries(WORDS, WORDS, max_size=3),
        st.lists(WORDS, max_size=3).map(tuple),
        WORDS,
        WORDS,
        st.booleans(),
    )
)
def test_a_record_comes_back_as_it_was_written(record):
    data = record.to_bytes()
    assert record_of({RECORD: data}) == record
    assert len(data) % 4096 == 0


@given(
    st.binary(max_size=300)
    | st.recursive(
        st.none() | st.booleans() | st.integers() | st.text(max_size=5),
        lambda inner: (
            st.lists(inner)
            | st.dictionaries(
                st.sampled_from(["operator", "muscles", "notes", "started", "changed"]), inner
            )
        ),
        max_leaves=8,
    ).map(lambda value: json.dumps(value).encode())
)
def test_what_is_no_record_is_none_or_texts(data):
    record = record_of({RECORD: data})
    assert record is None or all(
        isinstance(text, str) for text in (record.operator, record.started, *record.notes)
    )


def test_two_runs_of_one_seed_differ_in_the_record_alone(logs):
    first, again = (logs[name].read_bytes() for name in ("first", "again"))
    assert len(first) == len(again)
    begin, end = first.index(b'{\n "schema": 1'), first.index(b"record.json", -2000)
    differing = [i for i, (x, y) in enumerate(zip(first, again, strict=True)) if x != y]
    # the attachment's own checksum follows it; that of the whole file stays, for it covers both
    assert begin < min(differing) and max(differing) <= begin + 4096 + 4 < end
    with LogReader(logs["first"]) as a, LogReader(logs["again"]) as b:
        assert a.missing == b.missing == []
        assert {n for n in a.attachments if a.attachments[n] != b.attachments[n]} == {RECORD}


def test_replay_does_not_read_it(logs, capsys):
    assert main(["replay", str(logs["first"])]) == 0
    assert "every output byte identical" in capsys.readouterr().out


def test_info_and_the_log_say_who_and_what(logs, capsys):
    assert main(["info", "--json", str(logs["first"])]) == 0
    (facts,) = json.loads(capsys.readouterr().out)
    record = facts["record"]
    assert (record["operator"], record["operator_from"]) == ("Ada", "option")
    assert record["notes"] == ["new hose"] and record["started"].endswith("Z")
    assert len(record["commit"]) in (0, 40)
    assert main(["info", str(logs["first"])]) == 0
    assert "Ada" in capsys.readouterr().out


@pytest.fixture
def workshop(tmp_path):
    """A rig and its plant in folders of their own."""
    for folder, name in (("rigs", "bench"), ("plants", "bench")):
        (tmp_path / folder).mkdir()
        shutil.copy(ROOT / f"config/{folder}/{name}.yaml", tmp_path / folder)
    return tmp_path / "rigs"


def test_the_operator_file_says_what_no_option_says(workshop, tmp_path):
    (workshop / "operator.yaml").write_text(
        "operator: Grace\nnote: winter term\nrigs:\n"
        "  bench: {serial: B-7, muscles: {muscle: DMSP no. 4}, note: strap renewed}\n"
        "  knee: {serial: K-1}\n"
    )
    log = recorded(tmp_path, "said", "--note", "warm", rig=workshop / "bench.yaml")
    with LogReader(log) as reader:
        record = record_of(reader.attachments)
    assert (record.operator, record.operator_from) == ("Grace", "file")
    assert record.rig_serial == "B-7" and record.muscles == {"muscle": "DMSP no. 4"}
    assert record.notes == ("winter term", "strap renewed", "warm")


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("operator: Grace\nrig: bench\n", 2, "unknown key 'rig'"),
        ("rigs:\n  bench:\n    muscles: {biceps: x}\n", 3, "a muscle of the rig 'bench' (muscle)"),
        ("operator: [Grace]\n", 1, "operator"),
        ("operator: Grace\nnote: " + "x" * 3000 + "\n", 2, "note"),
    ],
)
def test_an_operator_file_that_is_not_sound_is_refused(workshop, text, line, words, capsys):
    path = workshop / "operator.yaml"
    path.write_text(text)
    assert main(["check", "--rig", str(workshop / "bench.yaml"), str(path)]) == 2
    said = capsys.readouterr().err
    assert f"operator.yaml:{line}: " in said and words in said
    out = workshop / "never"
    experiment = ROOT / "config/experiments/step.yaml"
    words = ["run", experiment, "--rig", workshop / "bench.yaml", "-o", out, "--quiet"]
    assert main([str(word) for word in words]) == 2
    assert f"operator.yaml:{line}: " in capsys.readouterr().err and not out.exists()


def test_a_note_without_end_is_refused(tmp_path, capsys):
    words = ["run", ROOT / "config/experiments/step.yaml", "--rig", RIGS / "bench.yaml"]
    assert main([*map(str, words), "-o", str(tmp_path), "--note", "x" * 2001]) == 2
    assert "--note: found 2001 characters" in capsys.readouterr().err


def test_run_json_says_how_it_ended(tmp_path, capsys):
    log = recorded(tmp_path, "said", "--json")
    captured = capsys.readouterr()
    facts = json.loads(captured.out)
    assert facts["schema"] == "epa_rt.run/1" and facts["log"] == str(log)
    assert (facts["outcome"], facts["exit_code"]) == ("completed", 0)
    assert facts["end"]["at_rest"] and facts["samples"] == facts["cycles"] > 0
    assert "completed" in captured.err
