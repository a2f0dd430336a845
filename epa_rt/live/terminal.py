"""The terminal view: what a run does now, and keys that ask it for something."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import Callable
from typing import ClassVar

from textual import events as terminal_events
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal
from textual.widgets import Footer, Static

from epa_rt.live.attach import Attached, Over
from epa_rt.live.panels import events, head, health, muscles, plot, plots, verdict
from epa_rt.live.watched import WatchedRun
from epa_rt.logs.feed.wire import LONGEST_TEXT, MARK, STOP, STOP_AT_ONCE

REFRESH_S = 0.2
_WHO = "the terminal view"
_CLOSE_KEYS = ("ctrl+c", "ctrl+q")  # these close the view from within a note too


class LiveView(App[None]):
    """The view of one attached run. ``stays_s``: how long after the run's end it closes by itself;
    None where it does not.

    A note takes every key behind ``n`` before anything else sees it, so no burst of keys stops a
    run.
    """

    CSS = """
    Screen { layout: vertical; }
    #head { height: 2; }
    #plots { height: 2fr; min-height: 6; }
    #plots Static { width: 1fr; height: 100%; padding: 0 1 0 0; }
    #muscles { height: auto; margin: 0; }
    #health { height: 2; }
    #verdict { height: auto; max-height: 12; display: none; }
    #events { height: 1fr; min-height: 3; }
    #note { display: none; height: 1; }
    """
    ENABLE_COMMAND_PALETTE = False
    AUTO_FOCUS = None
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("s", "stop", "stop"),
        Binding("S", "stop_at_once", "stop at once"),
        Binding("m", "mark", "mark"),
        # priority: done before the next key is looked at
        Binding("n", "note", "note", priority=True),
        Binding("q", "quit", "close view"),
        Binding("ctrl+c", "quit", "close view", show=False, priority=True),
    ]

    def __init__(self, attached: Attached, stays_s: float | None = None, words: str = "") -> None:
        super().__init__()
        self.run_seen = WatchedRun(attached.facts)
        self._attached, self._stays_s, self._words = attached, stays_s, words
        self._plots = plots(self.run_seen)
        self._marks = 0
        self._note: str | None = None  # what is typed of a note; None where none is
        self._asked: list[str] = []  # requests that are not answered yet

    def compose(self) -> ComposeResult:
        yield Static(id="head")
        with Horizontal(id="plots"):
            for at in range(len(self._plots)):
                yield Static(id=f"plot{at}")
        yield Static(id="muscles")
        yield Static(id="health")
        yield Static(id="verdict")
        yield Static(id="events")
        yield Static(id="note", markup=False)
        yield Footer(show_command_palette=False)

    def on_mount(self) -> None:
        self.theme = "textual-ansi" if "textual-ansi" in self.available_themes else self.theme
        asyncio.get_running_loop().add_reader(self._attached.fileno(), self._read)
        self.set_interval(REFRESH_S, self.show)
        if self._words:
            self.notify(self._words, timeout=20.0)
        self.show()

    def on_unmount(self) -> None:
        asyncio.get_running_loop().remove_reader(self._attached.fileno())

    def show(self) -> None:
        """Draw what is known now."""
        run = self.run_seen
        run.skipped_rows = self._attached.skipped_rows
        width = max(self.size.width, 20)
        self._update("head", head(run, width))
        for at, (name, reference) in enumerate(self._plots):
            size = self.query_one(f"#plot{at}", Static).content_size
            drawn = plot(run, name, reference, max(size.width, 8), max(size.height, 3))
            self._update(f"plot{at}", drawn)
        self._update("muscles", muscles(run, width))
        self._update("health", health(run, width))
        said = verdict(run)
        self.query_one("#verdict", Static).display = bool(said.plain)
        self._update("verdict", said)
        room = self.query_one("#events", Static).content_size.height
        self._update("events", events(run, width, room))

    def action_stop(self) -> None:
        """Brake, vent under power, then off: as Ctrl-C in the terminal of the run."""
        self._ask(STOP)

    def action_stop_at_once(self) -> None:
        """Power off and air out at once, whatever moves."""
        self._ask(STOP_AT_ONCE)

    def action_mark(self) -> None:
        """An event at this moment, numbered."""
        self._marks += 1
        self._ask(MARK, f"mark {self._marks}")

    def action_note(self) -> None:
        """Open the line for a note; it becomes a mark when it is entered."""
        self._write_note("")

    async def on_event(self, event: terminal_events.Event) -> None:
        """Text of a note goes to the note alone, whatever else its letters mean."""
        is_typed = isinstance(event, (terminal_events.Key, terminal_events.Paste))
        if self._note is None or not is_typed or event.is_forwarded:
            await super().on_event(event)
        elif isinstance(event, terminal_events.Paste):
            self._add_to_note(event.text)
        elif event.key in _CLOSE_KEYS:
            await super().on_event(event)
        else:
            self._note_key(event)

    def _note_key(self, event: terminal_events.Key) -> None:
        note = self._note or ""
        if event.key == "enter":
            self._write_note(None)
            if note.strip():
                self._ask(MARK, note.strip())
        elif event.key == "escape":
            self._write_note(None)
        elif event.key == "backspace":
            self._write_note(note[:-1])
        elif event.character is not None and event.is_printable:
            self._add_to_note(event.character)

    def _add_to_note(self, text: str) -> None:
        """The text on one line, as far as a mark can hold it."""
        whole = (self._note or "") + "".join(c if c.isprintable() else " " for c in text)
        if (over := len(whole) - LONGEST_TEXT) > 0:
            words = f"a note holds {LONGEST_TEXT} characters: the last {over} are left out"
            self.notify(words, severity="warning")
        self._write_note(whole[:LONGEST_TEXT])

    def _write_note(self, note: str | None) -> None:
        self._note = note
        self.query_one("#note", Static).display = note is not None
        if note is not None:
            room = max(self.size.width, 20) - len("note: _")
            self._update("note", f"note: {note[-room:]}_" if note else "note, then Enter: _")

    def _update(self, part: str, content: object) -> None:
        self.query_one(f"#{part}", Static).update(content)  # type: ignore[arg-type]

    def _ask(self, ask: str, text: str = "") -> None:
        try:
            self._attached.ask(ask, text, _WHO)
            self._asked.append(ask)
        except OSError:
            self.notify("the run is over", severity="warning")

    def _read(self) -> None:
        run = self.run_seen
        for message in self._attached.messages(0.0):
            run.take(message)
            if isinstance(message, Over):
                asyncio.get_running_loop().remove_reader(self._attached.fileno())
                self._end()
        while run.answers:
            answer = run.answers.popleft()
            asked = self._asked.pop(0) if self._asked else "request"
            if not answer.taken:
                words = f"{asked.replace('_', ' ')} was NOT taken: {answer.why}"
                self.notify(words, severity="error", timeout=10.0)

    def _end(self) -> None:
        self.show()
        if self._stays_s is not None:
            self.notify(f"the run is over; closes in {self._stays_s:g} s (q: now)")
            self.set_timer(self._stays_s, self.exit)
        else:
            self.notify("the run is over; q closes this view", timeout=3600.0)


def show_run(
    attached: Attached,
    stays_s: float | None = None,
    words: str = "",
    seen: Callable[[], None] | None = None,
) -> None:
    """Show a run until the view is closed. With ``stays_s`` in the terminal of the run itself,
    where Ctrl-C, Ctrl-\\ and Ctrl-Z are the run's and reach it even where this view hangs. ``seen``
    is called once it is to be seen.
    """
    of_the_run = stays_s is not None
    if of_the_run:
        os.environ["TEXTUAL_ALLOW_SIGNALS"] = "1"  # read by Textual as it takes the terminal
        for number in (signal.SIGINT, signal.SIGQUIT):
            signal.signal(number, signal.SIG_IGN)
    view = LiveView(attached, stays_s, words)
    if of_the_run:
        view.call_later(signal.signal, signal.SIGTSTP, signal.SIG_IGN)
    if seen is not None:
        view.call_after_refresh(seen)
    view.run(mouse=False)
