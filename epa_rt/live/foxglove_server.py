"""Foxglove's WebSocket server for one run, fed by the run's feed like any other viewer."""

from __future__ import annotations

import hmac
import json
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from foxglove import Context, MessageSchema, Schema, Service, ServiceSchema, start_server
from foxglove.websocket import Capability, ChannelView, Client, ServerListener

from epa_rt.live.attach import Answer, Attached, Happened, Rows
from epa_rt.live.foxglove_channels import STATE_HZ, RunChannels
from epa_rt.live.watched import WatchedRun
from epa_rt.logs.feed.wire import MARK, STOP, STOP_AT_ONCE

ANSWER_S = 2.0
LAST_S = 1.0  # after the run's end, for what is on its way to clients
CLOSE_S = 0.5
WAIT_S = 0.02
BACKLOG = 32768
"""Messages that wait for a client, of some 300 bytes each: six seconds of a rig at 1 kHz; then the
oldest are dropped.
"""
_WRONG_TOKEN_S = 0.5  # a wrong token costs its sender so long, and nobody else
_WHO = "Foxglove"


class Refused(Exception):
    """A service call that is not followed; one sentence for the caller."""


@dataclass(frozen=True)
class ServerSpec:
    """Where to listen, and the token that `stop` asks for. `rate_hz`: at most so many of the rows
    of one topic, None for all.
    """

    host: str = "127.0.0.1"
    port: int = 8765
    token: str = ""
    rate_hz: float | None = None


class RunServer(ServerListener):
    """A server of one run. Raises OSError or RuntimeError where the port cannot be had, NotOn where
    the run's rig file cannot be read.

    It listens once the channels are there. foxglove-sdk advertises a channel to the clients it has
    before it takes subscriptions to it: who answers within that time is refused for good.
    """

    def __init__(self, spec: ServerSpec, attached: Attached) -> None:
        self._spec, self._attached = spec, attached
        self._run = WatchedRun(attached.facts)
        every = 1
        if spec.rate_hz is not None:
            every = max(round(1.0 / attached.facts.period_s / spec.rate_hz), 1)
        self._context = Context()  # server and channels hold it weakly
        self._channels = RunChannels(self._run, self._context, every)
        self._answers: list[Answer] = []
        self._asking = threading.Lock()  # services run in threads of the server's
        self._slowing = threading.Lock()  # held while a wrong token waits for its answer
        self._due: deque[Callable[[], None]] = deque()
        self.refused = 0
        self._server = start_server(
            name="epa",
            host=spec.host,
            port=spec.port,
            capabilities=[Capability.Services],
            supported_encodings=["json"],
            services=[self._service(STOP, self._stop), self._service(MARK, self._mark)],
            server_listener=self,
            context=self._context,
            message_backlog_size=BACKLOG,
        )

    @property
    def port(self) -> int:
        return self._server.port

    def follow(self) -> None:
        """Show the run until its end."""
        run, attached, channels = self._run, self._attached, self._channels
        channels.about()
        state_due_s = 0.0
        while not attached.is_over:
            for message in attached.messages(WAIT_S):
                run.take(message)
                if isinstance(message, Rows):
                    channels.rows(message)
                elif isinstance(message, Happened):
                    channels.event(message)
                elif isinstance(message, Answer):
                    self._answers.append(message)
            run.skipped_rows = attached.skipped_rows
            has_late_comer = bool(self._due)
            while self._due:
                self._due.popleft()()
            now_s = time.monotonic()
            is_time = now_s >= state_due_s
            if is_time:  # from when it was due: a late one does not put off the next
                state_due_s = max(state_due_s + 1.0 / STATE_HZ, now_s)
            if is_time or has_late_comer:
                channels.state()
        channels.state()
        time.sleep(LAST_S)

    def close(self) -> None:
        """Say goodbye to the clients, for CLOSE_S at most: one that hangs would hold this up."""
        stopping = threading.Thread(target=self._server.stop, daemon=True)
        stopping.start()
        stopping.join(CLOSE_S)

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        """Give who comes late what is said only once."""
        act = self._channels.late_comer(channel.topic)
        if act is not None:
            self._due.append(act)

    def _service(self, name: str, act: Callable[[dict[str, Any]], str]) -> Service:
        def call(request: Any) -> bytes:
            try:
                given = json.loads(request.payload)
            except (ValueError, RecursionError):
                given = None
            if not isinstance(given, dict):
                raise Refused('found no JSON object, expected one such as {"token": "..."}')
            return json.dumps({"done": act(given)}).encode()

        fields = {"token": {"type": "string"}}
        fields |= {"at_once": {"type": "boolean"}} if name == STOP else {"text": {"type": "string"}}
        return Service(
            name,
            schema=ServiceSchema(
                f"epa_{name}",
                request=_json_schema(f"{name}_request", fields),
                response=_json_schema(f"{name}_answer", {"done": {"type": "string"}}),
            ),
            handler=call,
        )

    def _stop(self, given: dict[str, Any]) -> str:
        self._check_token(given)
        ask = STOP_AT_ONCE if given.get("at_once") is True else STOP
        return self._ask(ask, "")

    def _mark(self, given: dict[str, Any]) -> str:
        self._check_token(given)
        return self._ask(MARK, str(given.get("text") or ""))

    def _check_token(self, given: dict[str, Any]) -> None:
        """Raises Refused. Compared in constant time, and slowly where it is wrong: one at a time,
        for a flood of them must not keep all threads from whoever has the token.
        """
        token, known = given.get("token"), self._spec.token
        told = token if isinstance(token, str) else ""
        same = hmac.compare_digest(told.encode("utf-8", "replace"), known.encode())
        if not (known and same):
            self.refused += 1
            if self._slowing.acquire(blocking=False):
                try:
                    time.sleep(_WRONG_TOKEN_S)
                finally:
                    self._slowing.release()
            raise Refused("found no valid token, expected the one that epa printed")

    def _ask(self, ask: str, text: str) -> str:
        """Ask the run and wait for the answer. Raises Refused."""
        if self._attached.is_over:
            raise Refused("no run is on")
        with self._asking:
            before = len(self._answers)
            try:
                self._attached.ask(ask, text, _WHO)
            except OSError:
                raise Refused("the run is over") from None
            end_s = time.monotonic() + ANSWER_S
            while len(self._answers) <= before:
                if time.monotonic() > end_s:
                    raise Refused("the run does not answer")
                time.sleep(0.005)
            answer = self._answers[before]
        if not answer.taken:
            raise Refused(answer.why)
        return ask


def _json_schema(name: str, properties: dict[str, Any]) -> MessageSchema:
    data = json.dumps({"type": "object", "properties": properties}).encode()
    schema = Schema(name=name, encoding="jsonschema", data=data)
    return MessageSchema(encoding="json", schema=schema)
