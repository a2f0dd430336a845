"""Bags, Parquet, NPZ and JSON lines: one motion gives one log, and stamps are as said."""

import json
import struct

import numpy as np
import pytest
import same_motion
from mcap.reader import make_reader
from same_motion import BAG, POSITION, ROWS, mapping_of, write_bag, write_npz, write_parquet

from epa_rt.gap.rig.read import read_recording


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    return same_motion.write_all(tmp_path_factory.mktemp("motion"))


def messages(log):
    with log.open("rb") as file:
        return [
            (channel.topic, message.log_time, message.data)
            for _, channel, message in make_reader(file).iter_messages()
            if channel.topic in ("/cycle", "/measured")
        ]


def test_one_motion_gives_one_log_to_the_last_bit(recordings, imported):
    logs = {}
    for kind, (mapping, path) in recordings.items():
        code, said, log = imported(mapping, path)
        assert code == 0, said
        logs[kind] = messages(log)
    assert len(logs["npz"]) == 2 * ROWS
    assert all(found == logs["npz"] for found in logs.values())
    assert np.array_equal(read_recording(log).columns["knee_position_rad"], POSITION)


def test_a_bag_is_read_by_its_file_as_well_and_by_kind_mcap(recordings, imported):
    file = next(recordings["mcap"][1].glob("*.mcap"))
    folder = messages(imported(BAG, recordings["mcap"][1])[2])
    for kind in ("rosbag", "mcap"):
        code, said, log = imported(BAG.replace("kind: rosbag", f"kind: {kind}"), file)
        assert code == 0 and messages(log) == folder, said


@pytest.mark.usefixtures("readers_here")
def test_which_stamps_are_used_is_said_and_can_be_chosen(recordings, imported):
    bag = recordings["db3"][1]
    said = imported(BAG, bag)[1]
    assert "/joint_states: stamps are those of the headers (header.stamp)" in said
    assert "receipt came 0.301 ms after them as a rule, 0.3 to 0.307 ms" in said
    received = BAG.replace("header.stamp", "log_time")
    said = imported(received, bag)[1]
    assert "/joint_states: stamps are those of receipt (log_time), not those of the headers" in said
    own = BAG.replace("_pressure', unit: Pa abs", "_pressure', stamp: log_time, unit: Pa abs")
    said = imported(own.replace("period: 2 ms", "period: 2 ms, resample: linear"), bag)[1]
    assert "/joint_states: stamps are those of the headers" in said
    assert "/pressure: stamps are those of receipt" in said


def test_stamps_in_ns_of_today_lose_nothing(recordings, imported):
    _, _, log = imported(mapping_of("npz"), recordings["npz"][1])
    stamps = [stamp for topic, stamp, _ in messages(log) if topic == "/cycle"]
    assert stamps == [2_000_000 * k for k in range(ROWS)]


def test_a_name_that_is_no_joint_is_refused_with_those_that_are(recordings, imported):
    code, said, _ = imported(BAG.replace("position[knee]", "position[ankle]"), recordings["db3"][1])
    assert code == 2 and "message 0: field 'position[ankle]': found no name 'ankle' among" in said


def test_a_folder_that_is_no_bag_and_a_bag_that_is_open(tmp_path, imported):
    code, said, _ = imported(BAG, tmp_path)
    assert code == 2 and "found a folder whose metadata.yaml cannot be read" in said
    bag = write_bag(tmp_path / "bag", "db3")
    (bag / "bag.db3-wal").write_bytes(b"x")
    code, said, _ = imported(BAG, bag)
    assert code == 2 and "expected a bag that was closed" in said


@pytest.mark.parametrize("kind", ["npz", "parquet", "jsonl"])
def test_no_value_is_allowed_by_name_only(kind, tmp_path, imported):
    q = POSITION.copy()
    q[3] = np.nan
    path = tmp_path / f"m.{kind}"
    if kind == "jsonl":
        same_motion.write_jsonl(path)
        lines = path.read_text().splitlines()
        lines[3] = json.dumps(json.loads(lines[3]) | {"q": None})
        path.write_text("\n".join(lines) + "\n")
    else:
        {"npz": write_npz, "parquet": write_parquet}[kind](path, q=q)
    word = "null" if kind == "jsonl" else "nan"
    code, said, _ = imported(mapping_of(kind), path)
    assert code == 2 and f'format: {{missing: ["{word}"]}}' in said
    allowed = mapping_of(kind).replace(f"kind: {kind}", f'kind: {kind}, missing: ["{word}"]')
    code, said, _ = imported(allowed, path)
    assert code == 0 and "knee_position_rad has no value on 1 of 200 rows" in said


@pytest.mark.usefixtures("readers_here")
def test_parts_of_a_column_are_addressed_alike(tmp_path, imported):
    import pyarrow as pa
    import pyarrow.parquet as pq

    pairs = np.stack([-POSITION, POSITION], axis=1)
    stamp, rest = same_motion.STAMP_NS, {"v": same_motion.SPEED, "tau": same_motion.TORQUE}
    record = np.zeros(ROWS, [("p", "f8")])
    record["p"] = same_motion.PRESSURE
    np.savez_compressed(tmp_path / "m.npz", stamp=stamp, q=pairs, air=record, **rest)
    table = {"stamp": stamp, "q": pairs.tolist(), "air": [{"p": p} for p in record["p"]], **rest}
    pq.write_table(pa.table(table), tmp_path / "m.parquet")
    lines = [
        json.dumps({"stamp": int(s), "q": [-q, q], "air": {"p": p}, "v": v, "tau": tau})
        for s, q, p, v, tau in zip(stamp, POSITION, record["p"], *rest.values(), strict=True)
    ]
    (tmp_path / "m.jsonl").write_text("\n".join(lines))
    logs = []
    for kind in ("npz", "parquet", "jsonl"):
        mapping = mapping_of(kind).replace("'q'", "'q[1]'").replace("'p'", "air.p")
        code, said, log = imported(mapping, tmp_path / f"m.{kind}")
        assert code == 0, said
        logs.append(messages(log))
    assert logs[0] == logs[1] == logs[2]


def hostile_npz(path, name):
    import zipfile

    if name == "pickle":
        np.savez(path, **(same_motion.COLUMNS | {"q": np.array([{}] * ROWS, dtype=object)}))
    elif name == "bomb":
        np.savez_compressed(path, stamp=np.zeros(20_000_000), q=np.zeros(20_000_000))
    else:
        head = b"\x93NUMPY\x01\x00"
        text = b"{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000,), }\n"
        with zipfile.ZipFile(path, "w") as file:
            file.writestr("q.npy", head + struct.pack("<H", len(text)) + text + bytes(80))


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("pickle", "array 'q': found pickled objects, which may run code when they are read"),
        ("bomb", "unpack to over 40 times as much"),
        ("lie", "its head says (1000000000,), more than there is"),
    ],
)
def test_hostile_npz_files_are_one_sentence(name, words, tmp_path, imported):
    hostile_npz(tmp_path / "bad.npz", name)
    code, said, _ = imported(mapping_of("npz"), tmp_path / "bad.npz")
    assert code == 2 and words in said


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (b'{"a":' * 100_000, "jsonl:2: found brackets nested too deep"),
        (b"[" + b"1," * 600_000, "jsonl:2: found a line of over 1 MB"),
        (b'{"stamp": ' + b"9" * 5000 + b"}", "jsonl:2: found a line that is not JSON"),
        (b"[1, 2]", "jsonl:2: found '[1, 2]', expected a JSON object"),
        (b'{"stamp": 1790000000', "it is the last line, the file may be cut"),
        (b'{"q": "soon"}', "jsonl:2: field 'q': found 'soon', expected a number"),
    ],
    ids=["deep", "long", "digits", "list", "cut", "text"],
)
def test_hostile_json_lines_are_one_sentence(line, words, tmp_path, imported):
    first = same_motion.write_jsonl(tmp_path / "m.jsonl").read_bytes().splitlines()[0]
    (tmp_path / "bad.jsonl").write_bytes(first + b"\n" + line)
    code, said, _ = imported(mapping_of("jsonl"), tmp_path / "bad.jsonl")
    assert code == 2 and words in said


def test_a_parquet_file_of_little_that_says_much_is_refused(tmp_path, imported):
    import pyarrow as pa
    import pyarrow.parquet as pq

    zeros = pa.array(np.zeros(10_000_000))
    pq.write_table(pa.table(dict.fromkeys(same_motion.COLUMNS, zeros)), tmp_path / "bad.parquet")
    code, said, _ = imported(mapping_of("parquet"), tmp_path / "bad.parquet")
    assert code == 2 and "unpack to over 40 times as much" in said


@pytest.mark.parametrize("kind", ["mcap", "db3"])
def test_lengths_that_lie_within_a_message_are_one_sentence(kind, recordings, tmp_path, imported):
    """The number of names of the first message says four thousand million."""
    bag = tmp_path / "bag"
    bag.mkdir()
    for path in recordings[kind][1].iterdir():
        data = path.read_bytes()
        if kind == "db3" and path.suffix == ".db3":
            at = data.rindex(b"\x05\0\0\0knee\0") - 4
            data = data[:at] + b"\xff\xff\xff\xff" + data[at + 4 :]
        if kind == "mcap" and path.suffix == ".mcap":
            data = data[: len(data) // 2]
        (bag / path.name).write_bytes(data)
    code, said, _ = imported(BAG, bag)
    assert code == 2 and ("cannot be decoded" in said or "was cut at byte" in said), said


def test_a_database_that_sqlite_finds_damaged_is_one_sentence(recordings, tmp_path, imported):
    data = bytearray(next(recordings["db3"][1].glob("*.db3")).read_bytes())
    data[4096 * 3 : 4096 * 4] = bytes(4096)
    (tmp_path / "bad.db3").write_bytes(data)
    code, said, _ = imported(BAG, tmp_path / "bad.db3")
    assert code == 2 and "no whole ROS 2 bag" in said


def test_a_definition_that_no_reader_should_follow_is_refused(tmp_path, imported):
    from mcap.writer import Writer

    for name, text in (("x/msg/Y", b"string[2000000] s\n"), ("x/msg/Y\nimport os", b"int8 s\n")):
        path = tmp_path / "bad.mcap"
        with path.open("wb") as file:
            writer = Writer(file)
            writer.start()
            schema = writer.register_schema(name, "ros2msg", text)
            channel = writer.register_channel("/joint_states", "cdr", schema)
            writer.add_message(channel, 0, b"\0\1\0\0" + bytes(8), 0)
            writer.finish()
        code, said, _ = imported(BAG.replace("kind: rosbag", "kind: mcap"), path)
        assert code == 2 and said.count("expected") == 1, said
        path.unlink()
