"""A log cut or damaged anywhere: all whole chunks come out, and the reader says what is missing."""

import random

import pytest
from log_samples import LAYOUT, sample_of
from mcap.writer import Writer

from epa_rt.logs.chunk_store import ChunkStore
from epa_rt.logs.held import hold, is_held
from epa_rt.logs.mcap_file import McapFile
from epa_rt.logs.reader import LogError, LogReader
from epa_rt.logs.schema import CHANNEL_IDS, CYCLE
from epa_rt.runs.glance import glance

SAMPLES = 9500


@pytest.fixture(scope="module")
def content(whole_log):
    return whole_log.read_bytes()


@pytest.fixture(scope="module")
def scanned(whole_log):
    return ChunkStore(str(whole_log)).scan


@pytest.fixture(scope="module")
def chunk_ends(scanned):
    """For each chunk with samples: the byte behind it, and the samples up to there."""
    ends, samples = [], 0
    for chunk in scanned.chunks:
        if CHANNEL_IDS[CYCLE] in chunk.counts:
            samples += chunk.counts[CHANNEL_IDS[CYCLE]]
            ends.append((chunk.data_begin + chunk.data_bytes, samples))
    assert samples == SAMPLES
    return ends


def cycles_of(log):
    return log.columns("/cycle", ["cycle"])["cycle"].tolist()


def test_a_log_cut_anywhere_gives_its_whole_chunks(tmp_path, content, chunk_ends, scanned):
    head_bytes = scanned.chunks[0].begin
    offsets = random.Random(1).sample(range(head_bytes, len(content)), 200)
    # Also where it hurts: right behind each chunk, before its indexes, and a byte short of the
    # whole.
    offsets += [end for end, _ in chunk_ends] + [len(content) - 1, scanned.data_end_at]
    path = tmp_path / "cut.mcap"
    for offset in offsets:
        path.write_bytes(content[:offset])
        expected = max((samples for end, samples in chunk_ends if end <= offset), default=0)
        with LogReader(path) as log:
            assert cycles_of(log) == list(range(expected)), offset
            assert log.columns("/measured").keys() == set(LAYOUT.measured)
            assert all(event.cycle <= SAMPLES for event in log.events())
            (sentence,) = log.missing
        assert sentence.startswith("no footer: ")
        if offset > scanned.data_end_at + 13:
            assert sentence.endswith("all messages are there")
        elif expected:
            assert f"cut at byte {offset}" in sentence
            assert (
                f"after cycle {expected - 1} (t = {(expected - 1) / 1000:.3f} s) is missing"
                in sentence
            )
        else:
            assert sentence.endswith("from the first cycle on is missing")


def test_a_log_cut_in_its_head_is_refused_in_one_sentence(tmp_path, content, scanned):
    path = tmp_path / "cut.mcap"
    for offset in random.Random(2).sample(range(8, scanned.chunks[0].begin), 50):
        path.write_bytes(content[:offset])
        try:
            with LogReader(path) as log:  # the layout is there, the attachments may not be
                assert cycles_of(log) == []
                assert "no footer" in log.missing[-1]
        except LogError as error:
            assert (
                str(error)
                == f"{path}: found a file cut or damaged in its head, expected a log of epa_rt"
            )


def test_a_damaged_chunk_is_left_out_and_said(tmp_path, content, scanned):
    chunk = [chunk for chunk in scanned.chunks if CHANNEL_IDS[CYCLE] in chunk.counts][1]
    path = tmp_path / "damaged.mcap"
    for place in random.Random(3).sample(
        range(chunk.data_begin, chunk.data_begin + chunk.data_bytes), 20
    ):
        damaged = bytearray(content)
        damaged[place] ^= 0x10
        path.write_bytes(damaged)
        with LogReader(path) as log:
            assert cycles_of(log) == [*range(2000), *range(4000, SAMPLES)]
            (sentence,) = log.missing
            assert (
                f"the chunk at byte {chunk.begin} ({chunk.data_bytes} bytes: 2000 samples from"
                " 2.000 s" in sentence
            )
            assert log.outcome == "finished"


def test_a_byte_damaged_anywhere_is_noticed(tmp_path, content, scanned):
    path = tmp_path / "damaged.mcap"
    for place in random.Random(4).sample(range(scanned.data_end_at), 100):
        damaged = bytearray(content)
        damaged[place] ^= 0x41
        path.write_bytes(damaged)
        try:
            with LogReader(path) as log:
                assert log.missing
                assert len(cycles_of(log)) >= SAMPLES - 2000
        except LogError as error:
            assert place < scanned.chunks[0].begin
            assert str(error).startswith(f"{path}: found ")


def test_a_chunk_whose_head_is_damaged_is_passed_over(tmp_path, content, scanned):
    chunk = [chunk for chunk in scanned.chunks if CHANNEL_IDS[CYCLE] in chunk.counts][2]
    path = tmp_path / "damaged.mcap"
    path.write_bytes(content[: chunk.begin] + bytes(64) + content[chunk.begin + 64 :])
    with LogReader(path) as log:
        assert cycles_of(log) == [*range(4000), *range(6000, SAMPLES)]
        assert (
            f"bytes from byte {chunk.begin} on are damaged and were passed over" in log.missing[0]
        )


@pytest.mark.parametrize(
    "flip", [0x01, *(pytest.param(f, marks=pytest.mark.slow) for f in (0x80, 0xFF))]
)
@pytest.mark.parametrize("which", [2, 3, -1], ids=["samples", "events", "the last"])
def test_every_byte_of_a_chunks_head_may_be_damaged(tmp_path, content, scanned, which, flip):
    """The head lies outside of the chunk's checksum; the frame's own head, behind it, says its size
    too. No array is made by what is not believed.
    """
    chunk, path = scanned.chunks[which], tmp_path / "damaged.mcap"
    for place in range(chunk.begin, chunk.data_begin + 18):
        damaged = bytearray(content)
        damaged[place] ^= flip
        path.write_bytes(damaged)
        with LogReader(path) as log:
            assert len(cycles_of(log)) >= SAMPLES - 2000, place
            assert len(log.events()) and log.missing, place


def test_a_chunk_that_says_another_size_is_left_out_and_said(tmp_path, content, scanned):
    chunk, path = scanned.chunks[2], tmp_path / "damaged.mcap"
    damaged = bytearray(content)
    damaged[chunk.begin + 9 + 16 + 7] = 0x10  # the upper byte of content_bytes
    path.write_bytes(damaged)
    with LogReader(path) as log:
        assert cycles_of(log) == [*range(2000), *range(4000, SAMPLES)]
        assert (
            f"is damaged and was left out: its head says {(0x10 << 56) + chunk.content_bytes}"
            f" bytes, what is packed in it says {chunk.content_bytes}" in log.missing[0]
        )


def test_a_damaged_attachment_is_left_out_and_said(tmp_path, content):
    path = tmp_path / "damaged.mcap"
    path.write_bytes(content.replace(b"rig: bench\n", b"rig: bonch\n", 1))
    with LogReader(path) as log:
        assert set(log.attachments) == {"code.tar"}
        assert "is damaged and was passed over" in log.missing[0]
        assert cycles_of(log) == list(range(SAMPLES))


@pytest.mark.parametrize(
    "found, message",
    [
        (b"", "found an empty file, expected an MCAP log"),
        (b"\x89MC", "found a binary file, expected an MCAP log"),
        (b"time,angle\n0,1\n", "found a file that begins with 'time,ang', expected an MCAP log"),
    ],
)
def test_what_is_no_log_is_refused_in_one_sentence(tmp_path, found, message):
    path = tmp_path / "log.mcap"
    path.write_bytes(found)
    with pytest.raises(LogError, match=message) as raised:
        LogReader(path)
    assert str(raised.value).startswith(f"{path}: found ")


def test_a_log_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(
        LogError, match="none.mcap: found no such file or directory, expected a log"
    ):
        LogReader(tmp_path / "none.mcap")
    with pytest.raises(LogError, match="found a folder, expected a log"):
        LogReader(tmp_path)


def test_an_mcap_file_of_another_make_is_refused(tmp_path):
    path = tmp_path / "other.mcap"
    writer = Writer(str(path))
    writer.start()
    writer.add_metadata("ros", {"distribution": "none"})
    writer.finish()
    with pytest.raises(
        LogError, match="found an MCAP file of another make, without a layout, expected a log"
    ):
        LogReader(path)


def test_a_log_still_being_written_can_be_read(open_recorder, tmp_path):
    recorder = open_recorder()
    with LogReader(tmp_path / "log.mcap") as log:
        assert cycles_of(log) == []
        assert log.outcome is None
        assert "still being recorded: no cycle yet" in log.missing[0]
    recorder.sample(**sample_of(0))


def test_a_log_that_is_being_recorded_is_not_said_to_be_cut(tmp_path, content):
    """Its writer holds it; what a writer left is cut."""
    head = content[: len(content) // 2]
    for name, holds in (("on.mcap", True), ("left.mcap", False)):
        path = tmp_path / name
        path.write_bytes(head)
        with path.open("r+b") as writer:
            if holds:
                hold(writer.fileno())
            with LogReader(path) as log:
                assert log.is_being_recorded == holds
                said = log.missing_at_a_glance[-1]
                assert said.startswith("still being recorded: ") == holds, said
                assert ("was cut at byte" in said) != holds
            assert glance(path).outcome == ("recording" if holds else "damaged")


def test_a_recorder_holds_its_log_until_it_is_closed(tmp_path):
    file = McapFile(str(tmp_path / "log.mcap"), sync=False)
    assert is_held(file_path := str(tmp_path / "log.mcap"))
    file.close()
    assert not is_held(file_path) and not is_held(str(tmp_path / "none.mcap"))
