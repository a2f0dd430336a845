"""A client of Foxglove's WebSocket protocol written from its specification, on plain `websockets`.

https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md
"""

import json
import struct
import sys
import time
from base64 import b64decode
from collections import defaultdict

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from websockets.sync.client import ClientConnection, connect

SUBPROTOCOLS = ["foxglove.sdk.v1", "foxglove.websocket.v1"]
MESSAGE_DATA, CALL_ANSWER = 1, 3
_CALL = 2


class Client:
    """Connected, once the server listens; `channels` and `services` by name once they were
    advertised, `stamps` in ns and `payloads` by topic as they come.
    """

    def __init__(self, url: str):
        self._connecting = _connected(url)
        self.socket: ClientConnection = self._connecting.__enter__()
        self.info: dict = {}
        self.channels: dict[str, dict] = {}
        self.services: dict[str, dict] = {}
        self.stamps: dict[str, list[int]] = defaultdict(list)
        self.payloads: dict[str, list[bytes]] = defaultdict(list)
        self.answers: dict[int, dict] = {}
        self._topics: dict[int, str] = {}
        self._calls = 0

    def take(self, timeout_s: float) -> bool:
        """One message of the server; False where none came in time."""
        try:
            message = self.socket.recv(timeout=timeout_s)
        except TimeoutError:
            return False
        if isinstance(message, bytes):
            self._binary(message)
        else:
            self._text(json.loads(message))
        return True

    def take_until(self, holds, timeout_s: float = 60.0) -> None:
        """Messages until a condition holds. AssertionError where they cease to come before."""
        while not holds():
            assert self.take(timeout_s), "the server fell silent"

    def subscribe(self, *topics: str) -> None:
        asked = []
        for topic in topics:
            number = len(self._topics) + 1
            self._topics[number] = topic
            asked.append({"id": number, "channelId": self.channels[topic]["id"]})
        self.socket.send(json.dumps({"op": "subscribe", "subscriptions": asked}))

    def call(self, service: str, payload: bytes) -> dict:
        """A service's answer: `{"json": ...}`, or `{"failure": words}`."""
        self._calls += 1
        head = struct.pack("<BIII", _CALL, self.services[service]["id"], self._calls, 4)
        self.socket.send(head + b"json" + payload)
        self.take_until(lambda: self._calls in self.answers)
        return self.answers[self._calls]

    def decoder(self, topic: str):
        """The protobuf class of a topic, from the schema that was advertised."""
        channel = self.channels[topic]
        assert channel["encoding"] == "protobuf"
        files = descriptor_pb2.FileDescriptorSet.FromString(b64decode(channel["schema"] + "=="))
        pool = descriptor_pool.DescriptorPool()
        for file in files.file:
            pool.Add(file)
        return message_factory.GetMessageClass(pool.FindMessageTypeByName(channel["schemaName"]))

    def close(self) -> None:
        self._connecting.__exit__(None, None, None)

    def _text(self, message: dict) -> None:
        operation = message["op"]
        if operation == "serverInfo":
            self.info = message
        elif operation == "advertise":
            self.channels |= {channel["topic"]: channel for channel in message["channels"]}
        elif operation == "advertiseServices":
            self.services |= {service["name"]: service for service in message["services"]}
        elif operation == "serviceCallFailure":
            self.answers[message["callId"]] = {"failure": message["message"]}

    def _binary(self, message: bytes) -> None:
        if message[0] == MESSAGE_DATA:
            number, stamp = struct.unpack_from("<IQ", message, 1)
            self.stamps[self._topics[number]].append(stamp)
            self.payloads[self._topics[number]].append(message[13:])
        elif message[0] == CALL_ANSWER:
            _, call, length = struct.unpack_from("<III", message, 1)
            self.answers[call] = {"json": json.loads(message[13 + length :])}


def _connected(url: str, wait_s: float = 60.0) -> ClientConnection:
    """A server listens from its run's beginning on: a client tries again, as Foxglove does."""
    end_s = time.monotonic() + wait_s
    while True:
        try:
            return connect(url, subprotocols=SUBPROTOCOLS, max_size=None)
        except ConnectionRefusedError:
            if time.monotonic() > end_s:
                raise
        time.sleep(0.01)


def read_all(url: str) -> None:
    """Subscribe to everything, say so, and read until the server goes: a process to be frozen or
    killed.
    """
    client = Client(url)
    client.take_until(lambda: "/joint_states" in client.channels)
    client.subscribe(*client.channels)
    client.take_until(lambda: client.payloads["/cycle"])
    print("reading", flush=True)
    while client.take(60.0):
        client.payloads.clear()
        client.stamps.clear()


if __name__ == "__main__":
    read_all(sys.argv[1])
