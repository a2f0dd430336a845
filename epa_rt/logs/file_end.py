"""Whether a log ends as the recorder ends one: data end, summary, footer, and their checksums."""

from __future__ import annotations

import mmap
import struct
import zlib

from mcap.writer import MCAP0_MAGIC

from epa_rt.logs.scan import Scan

_RECORD_HEAD_BYTES = 9
_DATA_END_BYTES = _RECORD_HEAD_BYTES + 4
_FOOTER = struct.Struct("<QQI")
_FOOTER_BYTES = _RECORD_HEAD_BYTES + _FOOTER.size


def end_damage(view: mmap.mmap | bytes, scan: Scan) -> list[str]:
    """What is wrong behind the data of a file that has a footer, a sentence each.

    Reads the summary and nothing else, so it costs little on a large file.
    """
    footer_at, data_end_at = scan.footer_at, scan.data_end_at
    if footer_at is None:
        return []
    if data_end_at is None:
        return ["the record that ends the data section is missing or damaged"]
    behind = len(view) - (footer_at + _FOOTER_BYTES + len(MCAP0_MAGIC))
    if behind:
        return [f"{behind} bytes follow the end of the log, which lies at byte {footer_at}"]
    summary_at, _, crc = _FOOTER.unpack_from(view, footer_at + _RECORD_HEAD_BYTES)
    if summary_at != data_end_at + _DATA_END_BYTES:
        return [
            f"the footer at byte {footer_at} is damaged: it says that the summary begins at byte"
            f" {summary_at}, not at {data_end_at + _DATA_END_BYTES}"
        ]
    with memoryview(view) as whole:
        found = zlib.crc32(whole[summary_at : footer_at + _RECORD_HEAD_BYTES + 16])
    if found != crc:
        return [f"the summary from byte {summary_at} on is damaged: its checksum differs"]
    return []


def data_section_damage(view: mmap.mmap | bytes, scan: Scan) -> list[str]:
    """A sentence where a byte before the end of the data section is damaged; reads all of it."""
    if scan.data_end_at is None:
        return []
    with memoryview(view) as whole:
        is_whole = zlib.crc32(whole[: scan.data_end_at]) == scan.data_crc
    if is_whole:
        return []
    return ["a byte outside the chunks is damaged: the checksum of the data section differs"]
