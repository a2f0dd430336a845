"""Exit codes of every verb, and the errors that end a verb with one sentence."""

COMPLETED = 0
DIFFERENT = 1  # replay found another byte; a check found something
BAD_INPUT = 2
TRIPPED = 3
FAILED = 4  # bus lost, or no log
STOPPED = 130  # the operator stopped the run, or a machine that was late

# added to the outcome's code where the rig was left otherwise than measured at rest
NOT_OFF, NOT_VENTED, NOT_AT_REST = 10, 20, 40

OF_OUTCOME = {"completed": COMPLETED, "stopped": STOPPED, "tripped": TRIPPED, "failed": FAILED}

EPILOGUE = """exit codes: 0 completed, 1 a comparison differs, a check found something, or a log is
damaged and usable (replay, compare, info --check, report, plot, run --dry, tune,
scan, doctor), 2 bad input (one sentence says what), 3 tripped, 4 bus lost, or no whole log
(a recorder lost in mid-run trips: 3), 130 stopped by the operator, or because the
machine was late (overruns). epa run adds, where the rig was not measured to be so
(false, or not known): 10 the drive is off, 20 the muscles are vented, 40 the rig is at
rest (tripped, and still under pressure: 23)"""


def code_of_run(outcome: str, at_rest: bool, vented: bool, off: bool) -> int:
    """The exit code of a run: its outcome's, and what is missing of a rig at rest."""
    left = (NOT_AT_REST * (not at_rest), NOT_VENTED * (not vented), NOT_OFF * (not off))
    return OF_OUTCOME[outcome] + sum(left)


class VerbError(Exception):
    """A sentence for the operator and the exit code that goes with it."""

    def __init__(self, sentence: str, code: int = BAD_INPUT):
        super().__init__(sentence)
        self.code = code
