"""Run a series of experiments one after the other, without anybody beside the keyboard.

FILE is a queue file (config/queues/*.yaml), or an experiment file such as epa gap plan writes. All
runs are checked before anything moves. The queue ends at the first run that trips, fails, is
stopped, or leaves the rig other than measured at rest, vented and without power.

How far it has come stands beside FILE (FILE.sim.state.json, FILE.ethercat.state.json, on an
emulated bus FILE.emulated.state.json). After an
interruption or a power loss the same command goes on: a run that was broken off in an experiment
that repeats goes on with the first repetition that its log lacks, any other runs again. After a
trip somebody looks at the rig first, then says --retry or --skip. Ctrl-C as in epa run.

  epa queue config/queues/rehearsal.yaml --dry               what would run, and for how long
  epa queue config/queues/rehearsal.yaml --restart -o out
  epa queue config/experiments/step.yaml --rig config/rigs/bench.yaml --restart -o out
"""

import argparse
import dataclasses
import fcntl
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.duration import duration
from epa_rt.cli.exits import COMPLETED, DIFFERENT, FAILED, STOPPED, TRIPPED, VerbError
from epa_rt.cli.inputs import Inputs, add_backend_arguments, add_supply_argument, load_inputs
from epa_rt.cli.run_record import add_record_arguments
from epa_rt.cli.screen_text import filled
from epa_rt.cli.zero import kind_of_rig

if TYPE_CHECKING:
    from epa_rt.logs.recorder import LogSummary
    from epa_rt.loop.requests import OperatorRequests
    from epa_rt.loop.run import RunResult
    from epa_rt.runs.queue import Item, Queue
    from epa_rt.runs.queue_state import RunState


def add_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("file", type=Path, metavar="FILE", help="queue file, or an experiment file")
    verb.add_argument("--rig", type=Path, help="rig of the runs that name none")
    add_backend_arguments(verb)
    add_supply_argument(verb)
    verb.add_argument(
        "-o", "--out", type=Path, help="folder for the logs (default: the file's, else out)"
    )
    verb.add_argument(
        "--dry", action="store_true", help="check every run and say how long; nothing moves"
    )
    after = verb.add_mutually_exclusive_group()
    after.add_argument(
        "--retry", action="store_true", help="after a trip: go on with the run that tripped"
    )
    after.add_argument("--skip", action="store_true", help="after a trip: go on with the next run")
    after.add_argument("--restart", action="store_true", help="begin anew; logs are kept")
    verb.add_argument("--quiet", action="store_true", help="no progress line")
    add_record_arguments(verb)


def main(arguments: argparse.Namespace) -> int:
    from epa_rt.runs.queue import load_queue

    queue = load_queue(arguments.file, arguments.rig)
    with _locked(arguments.file):
        return _Carrier(queue, arguments).carried_out()


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Nobody else carries out this queue meanwhile. Raises VerbError."""
    with path.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise VerbError(
                f"{path}: found a queue that another epa queue carries out, expected one at a time"
            ) from None
        yield


class _Carrier:
    """One queue, its state, and how its runs reach the rig."""

    def __init__(self, queue: "Queue", arguments: argparse.Namespace):
        from epa_rt.runs.queue_state import StateError, fresh_state, load_state, state_path

        self.queue, self.arguments = queue, arguments
        self.is_sim = arguments.backend == "sim"
        self.out: Path = arguments.out or queue.out or Path("out")
        self.path = state_path(queue.path, kind_of_rig(arguments))
        try:
            self.state = load_state(self.path, queue)
        except StateError as error:
            if not arguments.restart:
                raise VerbError(str(error)) from None
            self.state = fresh_state(queue)
        else:
            if arguments.restart and any(run.logs for run in self.state.runs):
                self.state = fresh_state(queue, self.state.begun + 1)
            elif arguments.restart:
                self.state = fresh_state(queue, self.state.begun)

    def carried_out(self) -> int:
        """Checks all that is left, then runs it; the exit code of the last run."""
        left = self._left()
        if not left:
            print(f"all {len(self.queue.items)} runs are over (--restart begins anew)")
            return COMPLETED
        checked = {item.number: self._inputs(item) for item in left}
        for sentence in dict.fromkeys(s for one in checked.values() for s in one.unprotected):
            print(f"UNPROTECTED: {sentence}", file=sys.stderr)
        findings = self._preview(left, checked)
        if self.arguments.dry:
            print("nothing has moved")
            return DIFFERENT if findings else COMPLETED
        self._save()
        for item in left:
            code = self._run(item, checked[item.number])
            if code != COMPLETED:
                return code
        print(f"the queue is over: {self._counted()}")
        return COMPLETED

    def _left(self) -> "list[Item]":
        """Runs that are to go. Raises VerbError where one was left so that somebody must look."""
        from epa_rt.runs.queue_state import OVER

        for item in self.queue.items:
            self._take_up(item)
            run = self._of(item)
            if run.status in OVER or not run.is_blocked:
                continue
            if self.arguments.skip:
                self._set(item, run.model_copy(update={"status": "skipped"}))
            elif not self.arguments.retry and not self.arguments.dry:
                raise VerbError(
                    f"{self.path}: found run {item.number} ({item.says}) {run.status}:"
                    f" {run.cause or run.end}; expected somebody to look at the rig, then --retry"
                    " or --skip",
                    TRIPPED,
                )
        return [item for item in self.queue.items if self._of(item).status not in OVER]

    def _take_up(self, item: "Item") -> None:
        """The end of a run that was on when epa queue was broken off, as its log has it."""
        from epa_rt.runs.queue_ending import ending_unseen

        run = self._of(item)
        if run.status != "running" or not run.logs:
            return
        said = ending_unseen(Path(run.logs[-1]))
        if said is not None:
            self._set(item, run.model_copy(update=said))

    def _inputs(self, item: "Item") -> Inputs:
        """The files of one run, checked as far as can be without the rig. Raises VerbError,
        ConfigError.
        """
        from epa_rt.cli.zero import is_emulated, need_zero_file
        from epa_rt.loop.assembly import WiringError, assemble

        self.queue.check_files(item)
        inputs = load_inputs(
            item.experiment,
            item.rig,
            item.plant,
            self.is_sim,
            with_zero=not self.is_sim,
            emulated=is_emulated(self.arguments),
        )
        if not self.is_sim and not self.arguments.dry:
            need_zero_file(inputs.rig, item.rig, is_emulated(self.arguments))
        try:
            assemble(inputs.rig, inputs.experiment)
        except WiringError as error:
            raise VerbError(str(error)) from None
        return inputs

    def _preview(self, left: "list[Item]", checked: dict[int, Inputs]) -> list[str]:
        """A line for each run and the time of all; what the rig cannot follow, a sentence each."""
        from epa_rt.experiments.dry import dry_run

        print(f"{self.queue.name}: {len(left)} of {len(self.queue.items)} runs, on {self._where()}")
        total_s, findings = 0.0, []
        planned: dict[tuple[bytes, bytes], tuple[float, list[str]]] = {}
        for item in self.queue.items:
            run, inputs = self._of(item), checked.get(item.number)
            if inputs is None:
                print(f"{item.number:4}  {run.status:<9}            {item.says}")
                continue
            key = (inputs.attachments["experiment.yaml"], inputs.attachments["rig.yaml"])
            if key not in planned:
                dry = dry_run(inputs.experiment, inputs.rig)
                planned[key] = (dry.duration_s, list(dry.findings))
            duration_s, found = planned[key]
            findings += [f"run {item.number} ({item.says}): {sentence}" for sentence in found]
            total_s += duration_s
            print(f"{item.number:4}  {run.status:<9} {duration(duration_s):>9}  {item.says}")
        for finding in findings:
            print(f"FINDING: {finding}")
        print(f"about {duration(total_s)} on a rig; logs go to {self.out}")
        if findings and not self.arguments.dry:
            raise VerbError(
                f"found {len(findings)} motions that a rig cannot follow, expected none"
            )
        return findings

    def _where(self) -> str:
        if self.is_sim:
            return "the simulated rig"
        return f"the bus at {self.arguments.interface or 'the only interface'}"

    def _run(self, item: "Item", checked: Inputs) -> int:
        """One run from its state to its next; its exit code."""
        from epa_rt.loop.requests import OperatorRequests

        before = self._of(item)
        inputs = self._unchanged(item, checked)
        resumed = self._resumed(item, inputs, before)
        if resumed is None:
            self._set(item, before.model_copy(update={"status": "completed"}))
            return COMPLETED
        log = self._log_path(item)
        print(f"\nrun {item.number} of {len(self.queue.items)}: {item.says}", flush=True)
        logs = (*before.logs, str(log.absolute()))
        going = {"status": "running", "logs": logs, "quiet": None, "cause": ""}
        self._set(item, before.model_copy(update=going))
        requests = OperatorRequests(resumed.rig.period_s)
        try:
            summary, result = self._driven(item, self._named(item, resumed), log, requests)
        except (VerbError, KeyboardInterrupt):
            if not log.exists() or not log.stat().st_size:
                self._set(item, before)  # nothing was recorded, so nothing moved
            raise
        code = self._judged(item, summary, result, resumed)
        if code == COMPLETED and requests.is_stopping:  # too late for the run, not for the queue
            print(f"QUEUE STOPPED after run {item.number}: the operator asked to stop")
            print("the same command goes on with the next run")
            return STOPPED
        return code

    def _unchanged(self, item: "Item", checked: Inputs) -> Inputs:
        """The files read again, for a zero that the last run wrote. Raises VerbError where they say
        another thing than what was checked.
        """
        from epa_rt.runs.resume import meaning_sha256

        inputs = self._inputs(item)
        for name, text in checked.attachments.items():
            if name.endswith(".yaml") and meaning_sha256(text, name) != meaning_sha256(
                inputs.attachments[name], name
            ):
                raise VerbError(
                    f"run {item.number} ({item.says}): found another {name} than was checked before"
                    " the queue began, expected the same (the same command goes on with it)"
                )
        return inputs

    def _resumed(self, item: "Item", inputs: Inputs, before: "RunState") -> Inputs | None:
        """What its last log lacks; all of it where there is none that can be gone on from."""
        from epa_rt.cli.resume import resumed_inputs

        for log in reversed(before.logs):
            if not Path(log).exists() or not Path(log).stat().st_size:
                continue
            try:
                return resumed_inputs(inputs, Path(log), kind_of_rig(self.arguments))
            except VerbError as error:
                print(f"run {item.number} runs from its beginning: {error}")
                return inputs
        return inputs

    def _log_path(self, item: "Item") -> Path:
        stem = f"{self.queue.name}-{item.number:03d}-{item.experiment.stem}-{item.rig.stem}"
        path, attempt = self.out / f"{stem}.mcap", 1
        while path.exists():
            attempt += 1
            path = self.out / f"{stem}-{attempt}.mcap"
        return path

    def _named(self, item: "Item", inputs: Inputs) -> Inputs:
        """With the queue's id of this run for the log. No clock is in it: equal simulated runs stay
        equal.
        """
        from epa_rt.cli.run_record import record_attachment

        facts = {
            "id": f"{self.queue.name}-{self.queue.sha256[:8]}.{self.state.begun}-{item.number:03d}",
            "queue": self.queue.name,
            "number": str(item.number),
            "of": str(len(self.queue.items)),
            "repetition": str(item.repetition),
            "notes": item.notes,
        }
        notes = [*filter(None, [item.notes]), *self.arguments.note]
        record = record_attachment(inputs.rig, item.rig, self.arguments.operator, notes)
        return dataclasses.replace(
            inputs,
            attachments=inputs.attachments | record,
            metadata={**inputs.metadata, "queue": facts},
        )

    def _driven(
        self, item: "Item", inputs: Inputs, log: Path, requests: "OperatorRequests"
    ) -> "tuple[LogSummary, RunResult]":
        from epa_rt.cli.run import driven

        rig, seed, speed = item.rig, item.seed, item.speed
        return driven(self.arguments, inputs, log, rig, seed, speed, requests=requests)

    def _judged(
        self, item: "Item", summary: "LogSummary", result: "RunResult", inputs: Inputs
    ) -> int:
        """Keeps how a run ended; COMPLETED where the queue may go on, else its exit code."""
        from epa_rt.cli.run import closing_text, end_text, exit_code

        print(filled(closing_text(summary, result, inputs.rig)))
        code, end = exit_code(summary, result), end_text(result, inputs.rig)
        status = "failed" if summary.failure and result.outcome == "completed" else result.outcome
        quiet = result.end is not None and result.end.is_quiet
        cause = result.cause or summary.failure or ""
        said = {"status": status, "cause": cause, "end": end, "quiet": quiet}
        self._set(item, self._of(item).model_copy(update=said))
        if code == COMPLETED and quiet:
            return COMPLETED
        why = cause or "the rig was not left at rest, vented and without power"
        stopped = f"QUEUE STOPPED at run {item.number} ({item.says}), {status}: {why}"
        print(filled(f"\n{stopped}\n{end}"))
        print(f"{self._counted()}; the state is in {self.path}")
        if status == "stopped" and quiet:
            print("the same command goes on with this run")
        else:
            print("look at the rig, then go on with --retry (this run) or --skip (the next)")
        return code or FAILED

    def _counted(self) -> str:
        counts: dict[str, int] = {}
        for run in self.state.runs:
            counts[run.status] = counts.get(run.status, 0) + 1
        return ", ".join(f"{count} {status}" for status, count in counts.items())

    def _of(self, item: "Item") -> "RunState":
        return self.state.runs[item.number - 1]

    def _set(self, item: "Item", run: "RunState") -> None:
        self.state = self.state.with_run(item.number, run)
        if not self.arguments.dry:
            self._save()

    def _save(self) -> None:
        from epa_rt.cli.write import cannot_write
        from epa_rt.runs.queue_state import save_state

        try:
            save_state(self.path, self.state)
        except OSError as error:
            raise cannot_write(self.path, error) from None
