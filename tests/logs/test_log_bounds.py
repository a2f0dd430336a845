"""Logs whose end is damaged, or whose chunks are sealed and yet no chunks: one sentence, little
memory, and every reader says the same.
"""

import random
import struct
import zlib

import pytest
import zstandard
from log_samples import LAYOUT, METADATA

from epa_rt.cli.main import main
from epa_rt.logs.chunk_store import ChunkStore
from epa_rt.logs.layout import SampleLayout
from epa_rt.logs.mcap_file import McapFile
from epa_rt.logs.reader import LogError, LogReader
from epa_rt.logs.recording import Ending, Recording
from epa_rt.logs.rows import loose_messages
from epa_rt.logs.schema import CHANNEL_IDS, EVENT, TIMING, event_topic, message_class


@pytest.fixture(scope="module")
def content(whole_log):
    return whole_log.read_bytes()


@pytest.fixture(scope="module")
def scanned(whole_log):
    return ChunkStore(str(whole_log)).scan


def test_every_bit_behind_the_data_counts(tmp_path, content, scanned, capsys):
    path = tmp_path / "damaged.mcap"
    chance = random.Random(5)
    places = chance.sample(range(scanned.data_end_at, len(content)), 120)
    places += [
        *range(scanned.data_end_at, scanned.data_end_at + 13),
        *range(scanned.footer_at, len(content)),
    ]
    for place in places:
        damaged = bytearray(content)
        damaged[place] ^= 1 << chance.randrange(8)
        path.write_bytes(damaged)
        with LogReader(path) as log:
            assert log.missing, place
            assert place < scanned.data_end_at + 13 or log.missing_at_a_glance, place
            assert len(log.events()) and log.ending
    assert main(["info", "--check", str(path)]) == 1
    assert main(["info", str(path)]) == 0
    path.write_bytes(content)
    assert main(["info", "--check", str(path)]) == 0
    path.write_bytes(content + b"more")
    with LogReader(path) as log:
        assert log.missing == [
            f"4 bytes follow the end of the log, which lies at byte {scanned.footer_at}"
        ]


def sealed(path, change):
    """A log of one chunk of two messages on /event, changed before it is packed and sealed."""
    file = McapFile(str(path), sync=False)
    recording = Recording(file, LAYOUT)
    Recording.begin(file, LAYOUT, {}, METADATA)
    event = message_class(event_topic())(cycle=1, kind="valve", text="open", data="{}")
    data = event.SerializeToString()
    packed, indexes = loose_messages([(CHANNEL_IDS[EVENT], 1, 5, data)] * 2)
    file.chunk(change(packed), indexes)
    recording.ending = Ending("finished", "")
    recording.write_ending()
    file.close()


@pytest.mark.parametrize(
    "change, words",
    [
        (lambda packed: bytes(65 << 20), "its head says 68157440 bytes, more than any chunk has"),
        (lambda packed: bytes(1 << 20), "holds no message at byte 0"),
        (lambda packed: packed[:-1], "holds no message at byte"),
        (lambda packed: packed + b"\5" * 9, "ends within a message"),
        (lambda packed: packed.replace(b"{}", b"{"), "an event that cannot be decoded"),
        (lambda packed: packed.replace(b"{}", b"{]"), "an event that cannot be decoded"),
        (lambda packed: packed.replace(b"{}", b"[]"), "an event whose data is no JSON object"),
        (lambda packed: packed.replace(b"open", b"op\xff\xff"), "an event that cannot be decoded"),
        (lambda packed: packed[: len(packed) // 2], "lists other messages than the chunk holds"),
        (
            lambda packed: packed.replace(b"\6\0", bytes([CHANNEL_IDS[TIMING], 0])),
            "a timing message whose histograms have other lengths",
        ),
    ],
)
def test_a_sealed_chunk_that_is_none_is_one_sentence(change, words, tmp_path, capsys):
    path = tmp_path / "log.mcap"
    sealed(path, lambda packed: packed)
    assert main(["info", "--check", str(path)]) == 1  # it holds two events and says none
    assert "2 events are there, the log says itself 0" in capsys.readouterr().out
    path.unlink()
    sealed(path, change)
    with LogReader(path) as log:
        assert len(log.missing) == 1 and words in log.missing[0]
        said = log.missing[0]
    for verb, code in ((["info", "--check"], 1), (["replay"], 2), (["report"], 1)):
        assert main([*verb, str(path)]) == code
        found = capsys.readouterr()
        assert said in found.out + found.err and "Traceback" not in found.err


def test_an_ending_that_cannot_be_read_is_said(tmp_path, content):
    path = tmp_path / "damaged.mcap"
    path.write_bytes(content.replace(b"lost_samples", b"lost_simples"))
    with LogReader(path) as log:
        assert log.ending is None and log.outcome is None
        assert log.missing[-1] == "the log says how the run ended in words that cannot be read"


@pytest.mark.parametrize(
    "json",
    [
        "[" * 100_000,
        "[]",
        '{"inputs_bytes": 1e12}',
        '{"inputs_bytes": 1000000000000}',
        '{"measured": "abc"}',
        '{"measured": [1, 2]}',
        '{"other": []}',
    ],
)
def test_a_layout_that_is_none_is_refused(json, tmp_path):
    with pytest.raises((ValueError, TypeError)):
        SampleLayout.from_json(json)
    path = tmp_path / "log.mcap"
    file = McapFile(str(path), sync=False)
    file.metadata("layout", {"json": json})
    file.finish()
    file.close()
    with pytest.raises(LogError, match="expected a log of epa_rt"):
        LogReader(path)


def test_attachments_beyond_any_log_are_left_out(tmp_path, content, scanned):
    path = tmp_path / "log.mcap"
    body = struct.pack("<QQII", 0, 0, 0, 0) + struct.pack("<Q", 65 << 20) + bytes(65 << 20)
    record = struct.pack("<BQ", 9, len(body) + 4) + body + struct.pack("<I", zlib.crc32(body))
    begin = scanned.chunks[0].begin
    path.write_bytes(content[:begin] + record + content[begin:])
    with LogReader(path) as log:
        assert sum(map(len, log.attachments.values())) < 1 << 20
        assert f"the record of {len(record)} bytes at byte {begin} is damaged" in log.missing[0]


def test_more_damage_than_anyone_reads_is_counted(tmp_path, content, scanned):
    path = tmp_path / "log.mcap"
    begin = scanned.chunks[0].begin
    wrong = struct.pack("<BQ", 12, 0)  # metadata without a name
    path.write_bytes(content[:begin] + wrong * 1000 + content[begin:])
    with LogReader(path) as log:
        assert len(log.missing) < 55 and "950 more places are damaged" in log.missing


def test_a_frame_that_says_another_size_than_it_has_makes_no_array(tmp_path, content, scanned):
    """A frame without its size, and a head that says little: the unpacker stops there."""
    chunk, path = scanned.chunks[0], tmp_path / "log.mcap"
    packer = zstandard.ZstdCompressor(write_content_size=False)
    data = packer.compress(bytes(300 << 20))
    head = bytearray(content[chunk.begin + 9 : chunk.data_begin])
    struct.pack_into("<Q", head, len(head) - 8, len(data))
    record = struct.pack("<BQ", 6, len(head) + len(data)) + bytes(head) + data
    path.write_bytes(
        content[: chunk.begin] + record + content[chunk.data_begin + chunk.data_bytes :]
    )
    with LogReader(path) as log:
        assert "is damaged and was left out: it cannot be unpacked" in log.missing[0]
