"""Exit codes of every verb, and the errors that end a verb with one sentence."""

COMPLETED = 0
DIFFERENT = 1  # replay found another byte; a check found something
BAD_INPUT = 2
TRIPPED = 3
FAILED = 4  # bus lost, or no log
STOPPED = 130  # the operator stopped the run

OF_OUTCOME = {"completed": COMPLETED, "stopped": STOPPED, "tripped": TRIPPED, "failed": FAILED}

EPILOGUE = """exit codes: 0 completed, 1 a comparison differs, or a check found something (replay, info --check, run --dry, scan, doctor),
2 bad input (one sentence says what), 3 tripped, 4 bus lost, or no whole log (a recorder lost in mid-run trips: 3),
130 stopped by the operator"""  # noqa: E501


class VerbError(Exception):
    """A sentence for the operator and the exit code that goes with it."""

    def __init__(self, sentence: str, code: int = BAD_INPUT):
        super().__init__(sentence)
        self.code = code
