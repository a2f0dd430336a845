"""The MCAP package's own reader, and protobuf's decoder with the schema in the file, see what our
reader sees.
"""

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from log_samples import ATTACHMENTS, METADATA
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader

from epa_rt.logs.reader import LogReader


@pytest.fixture(scope="module")
def decoded(whole_log):
    """Topic by topic, `(log_time, message)` of every message, by the schemas in the file."""
    classes, topics = {}, {}
    with whole_log.open("rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            assert (schema.encoding, channel.message_encoding) == ("protobuf", "protobuf")
            if schema.name not in classes:
                pool = descriptor_pool.DescriptorPool()
                for one in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
                    pool.Add(one)
                classes[schema.name] = message_factory.GetMessageClass(
                    pool.FindMessageTypeByName(schema.name)
                )
            one = classes[schema.name].FromString(message.data)
            topics.setdefault(channel.topic, []).append(
                (message.log_time, message.publish_time, one)
            )
    return topics


def test_every_signal_is_the_same(whole_log, decoded):
    with LogReader(whole_log) as log:
        for topic in log.topics:
            columns = log.columns(topic)
            messages = [message for _, _, message in decoded[topic]]
            assert [field.name for field in messages[0].DESCRIPTOR.fields] == list(columns)
            for name, column in columns.items():
                found = [getattr(message, name) for message in messages]
                if name.endswith("_raw"):
                    assert b"".join(found) == column.tobytes()
                else:
                    np.testing.assert_array_equal(np.array(found), column)


def test_times_are_those_of_the_run(whole_log, decoded):
    with LogReader(whole_log) as log:
        t_ns = log.columns("/cycle", ["t_ns"])["t_ns"].tolist()
        for topic in ("/cycle", "/measured", "/reference", "/command"):
            assert [(begin, end) for begin, end, _ in decoded[topic]] == [
                (one, one) for one in t_ns
            ]
        assert [log_time for log_time, _, _ in decoded["/event"]] == [
            event.t_ns for event in log.events()
        ]


def test_events_are_the_same(whole_log, decoded):
    with LogReader(whole_log) as log:
        found = [(message.cycle, message.kind, message.text) for _, _, message in decoded["/event"]]
        assert found == [(event.cycle, event.kind, event.text) for event in log.events()]


def test_the_summary_counts_what_is_there(whole_log, decoded):
    with whole_log.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        counts = {
            summary.channels[number].topic: n
            for number, n in summary.statistics.channel_message_counts.items()
        }
        assert counts == {topic: len(messages) for topic, messages in decoded.items()}
        assert {one.name: one.data for one in reader.iter_attachments()} == ATTACHMENTS
        assert {one.name: one.metadata for one in reader.iter_metadata()}["run"] == METADATA["run"]
        assert summary.statistics.message_end_time == 9499 * 1_000_000


def test_every_record_and_checksum_holds_when_read_front_to_back(whole_log):
    with whole_log.open("rb") as file:
        records = [
            type(record).__name__ for record in StreamReader(file, validate_crcs=True).records
        ]
    assert records[0] == "Header"
    assert records[-1] == "Footer"
