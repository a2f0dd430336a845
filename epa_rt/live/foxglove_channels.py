"""What a Foxglove client is given: the topics of the log as they are, and a few made for it.

Topics with one message per cycle have the schemas and the bytes that they have in the log, so one
layout fits both. `/joint_states` is Foxglove's own schema for joints.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np
from foxglove import Channel, Context, Schema
from foxglove.channels import JointStatesChannel
from foxglove.messages import JointState, JointStates, Timestamp

from epa_rt.live.attach import Happened, Rows
from epa_rt.live.watched import WatchedRun
from epa_rt.logs.rows import RowBlock
from epa_rt.logs.schema import Topic, cycle_topics, descriptor_set, event_topic, message_class

JOINTS_HZ, STATE_HZ = 100.0, 10.0
RECENT_EVENTS = 20
"""Of the newest events in each `/state`: what a slow client's queue dropped of `/event`."""

_BLOCK_ROWS = 1024
_DEFINITIONS: dict[str, dict[str, Any]] = {
    "state": {"type": "object", "title": "state, health and the newest events of the run"},
    "about": {"type": "object", "title": "the run, its signals' units and the stated rates"},
}


class RunChannels:
    """The channels of one watched run in a context. `every`: one cycle in so many goes out."""

    def __init__(self, run: WatchedRun, context: Context, every: int = 1) -> None:
        self._run, self._every = run, max(every, 1)
        layout = run.facts.layout
        self._topics = cycle_topics(layout)
        rate_hz = 1.0 / run.facts.period_s / self._every
        self._rates_hz = {topic.name: rate_hz for topic in self._topics}
        self._joints_every = max(round(1.0 / run.facts.period_s / JOINTS_HZ), 1)
        self._rates_hz |= {
            "/joint_states": 1.0 / run.facts.period_s / self._joints_every,
            "/state": STATE_HZ,
        }
        self._block = RowBlock(layout, _BLOCK_ROWS)
        self._channels = {topic.name: self._protobuf(topic, context) for topic in self._topics}
        self._event_class = message_class(event_topic())
        self._event = self._protobuf(event_topic(), context)
        self._state = self._json("/state", "state", context)
        self._about = self._json("/about", "about", context)
        self._joints = JointStatesChannel("/joint_states", context=context)
        self._axes = _axes(run)
        self._next_row = self._next_joint = 0
        self._last_t_ns = 0

    def late_comer(self, topic: str) -> Callable[[], None] | None:
        """What to send at once to who subscribes to a topic that is silent otherwise."""
        return {"/about": self.about, "/state": self.state, "/event": self._all_events}.get(topic)

    def rows(self, rows: Rows) -> None:
        """All cycles that are due, with their own stamps."""
        cycles = rows.slots["cycle"]
        self._last_t_ns = int(rows.slots["t_ns"][-1])
        wanted = [topic for topic in self._topics if self._channels[topic.name].has_sinks()]
        if wanted:
            due = rows.slots[cycles % self._every == 0] if self._every > 1 else rows.slots
            while len(due):
                taken = self._block.take(due)
                self._send(wanted)
                due = due[taken:]
        if self._joints.has_sinks():
            for slot in rows.slots[cycles % self._joints_every == 0]:
                self._send_joints(slot)

    def event(self, event: Happened) -> None:
        """One event, as in the log."""
        message = self._event_class(
            cycle=event.cycle, kind=event.kind, text=event.text, data=json.dumps(event.data)
        )
        self._event.log(message.SerializeToString(deterministic=True), log_time=event.t_ns)

    def state(self) -> None:
        """State, health, trip and end, with the newest events."""
        recent = list(self._run.events)[-RECENT_EVENTS:]
        found = self._run.as_json() | {"events": [asdict(event) for event in recent]}
        self._state.log(found, log_time=self._last_t_ns)

    def about(self) -> None:
        """The run, the unit of every signal, the stated rate of every topic."""
        facts = self._run.facts
        found = {
            "run": facts.run,
            "log": facts.log,
            "period_s": facts.period_s,
            "rates_hz": self._rates_hz,
            "units": self._run.units,
            "states": facts.layout.states,
            "phases": facts.layout.phases,
        }
        self._about.log(found, log_time=self._last_t_ns)

    @property
    def rates_hz(self) -> dict[str, float]:
        """The stated rate of each topic that has one."""
        return dict(self._rates_hz)

    def _send(self, wanted: list[Topic]) -> None:
        """The block's rows, cycle by cycle, then an empty block."""
        content, _ = self._block.messages()
        t_ns = self._block.samples["t_ns"].tolist()
        rows = self._block.rows
        size, fields = rows.itemsize, rows.dtype.fields or {}
        places = []
        for topic in wanted:
            dtype, at = fields[topic.name][:2]
            body, begin = dtype.fields["body"][:2]
            places.append((self._channels[topic.name].base, at + begin, at + begin + body.itemsize))
        for i, stamp in enumerate(t_ns):
            row = content[i * size : (i + 1) * size]
            for channel, begin, end in places:
                channel.log(bytes(row[begin:end]), stamp)
        self._block.clear()

    def _send_joints(self, slot: np.void) -> None:
        values, t_ns = slot["values"], int(slot["t_ns"])
        joints = [
            JointState(name=name, **{key: float(values[place]) for key, place in parts.items()})
            for name, parts in self._axes
        ]
        stamp = Timestamp(sec=t_ns // 1_000_000_000, nsec=t_ns % 1_000_000_000)
        self._joints.log(JointStates(timestamp=stamp, joints=joints), log_time=t_ns)

    def _all_events(self) -> None:
        for event in list(self._run.events):
            self.event(event)

    def _protobuf(self, topic: Topic, context: Context) -> Channel:
        schema = Schema(name=topic.message_name, encoding="protobuf", data=descriptor_set(topic))
        units = {f.name: unit for f in topic.fields if (unit := self._run.units.get(f.name))}
        return Channel(
            topic.name, schema=schema, message_encoding="protobuf", context=context, metadata=units
        )

    @staticmethod
    def _json(topic: str, name: str, context: Context) -> Channel:
        return Channel(topic, schema=_DEFINITIONS[name], message_encoding="json", context=context)


def _axes(run: WatchedRun) -> list[tuple[str, dict[str, int]]]:
    """Name of each joint, and where its position, velocity and effort stand among the values."""
    rig, places = run.rig, run.places
    torque = next((row.name for row in rig.inputs if row.si_unit == "N*m"), None)
    found = []
    motor = {"position": rig.motor.position, "velocity": rig.motor.speed, "effort": torque}
    axes = [("motor", motor)]
    if rig.joint is not None:
        position = rig.joint.position
        axes.append((position.rsplit("_", 2)[0], {"position": position}))
    for name, parts in axes:
        known = {key: places[row] for key, row in parts.items() if row in places}
        if known:
            found.append((name, known))
    return found
