"""kickcat (a master that shares nothing with SOEM) beside the emulated bus: to OP, then cycles; one JSON object."""

import json
import os
import time

import kickcat


def main():
    link = kickcat.create_link(os.environ["EPA_BUS_INTERFACE"], "")
    link.set_timeout(0.005)  # it waits this long for a redundant frame, on every frame while it starts
    for attempt in range(20):  # a busy machine may be slower than kickcat waits for its first frame
        bus = kickcat.Bus(link)
        try:
            bus.init(0.1)
            break
        except RuntimeError:
            if attempt == 19:
                raise
    link.set_timeout(0.02)
    slaves = bus.slaves()
    names = {n: bus.read_sdo(slaves[n], 0x1008, 0, kickcat.Access.PARTIAL, 64, 1.0).decode() for n in (2, 3, 4)}
    bus.create_mapping(4096)
    bus.request_state(kickcat.State.SAFE_OP)
    bus.wait_for_state(kickcat.State.SAFE_OP, 2.0)
    for slave in slaves:
        if slave.output_size:
            slave.set_output_bytes(bytes(slave.output_size))
    bus.process_data_no_check()
    bus.request_state(kickcat.State.OPERATIONAL)
    for _ in range(1000):
        bus.process_data_no_check()
        if all(bus.get_state(slave) == kickcat.State.OPERATIONAL for slave in slaves):
            break
        time.sleep(0.001)
    cycles = 0
    for _ in range(2000):
        try:
            bus.process_data()  # raises where a working counter is wrong, and where a busy machine made a frame late
            cycles += 1
        except RuntimeError as error:
            if "LOST" not in str(error):
                raise
        if cycles == 500:
            break
        time.sleep(0.0005)
    print(json.dumps({
        "names": names, "sizes": [(slave.input_size, slave.output_size) for slave in slaves], "cycles": cycles,
        "states": [bus.get_state(slave).name for slave in slaves], "analog": slaves[2].input_data.hex(), "drive": slaves[4].input_data.hex()}))


if __name__ == "__main__":
    main()
