"""Tests that run a master and the emulated bus in real processes have a command of their own, until issue 3 is closed:
they take ten minutes and want both cores to themselves. Those without a network run with all the others.

    EPA_BUS_TESTS=1 scripts/test.sh tests/bus
"""

import os

ON_THE_NETWORK = [
    "driver/test_driver_bus.py", "driver/test_driver_conformance.py", "driver/test_driver_identity.py", "faults/test_*.py",
    "others/test_*.py", "emulator/test_bus_command.py", "emulator/test_soem.py",
]
collect_ignore_glob = [] if os.environ.get("EPA_BUS_TESTS") else ON_THE_NETWORK
