"""Gives all sensors the time of day (CANopen TIME), and reads what one of them took.

    python examples/python/set_time.py

The sensor stores the time together with the number of the sample at which it came; with the sample rate, every sample
and event then has a date.
"""

import time

from bus import arguments, connect, fail, sensor, show

# CiA 301: days since 1984-01-01, as Unix time.
CANOPEN_EPOCH_S = 441_763_200


def main():
    parser = arguments(__doc__.splitlines()[0])
    parser.add_argument("--at", type=float, help="Unix time to set, s [default: now]")
    options = parser.parse_args()
    with connect(options) as network:
        node = sensor(network, options)
        at = time.time() if options.at is None else options.at
        network.time.transmit(at)
        received = node.sdo["Time received"]
        taken = CANOPEN_EPOCH_S + received["Days"].raw * 86_400 + received["Milliseconds"].raw / 1000
        if abs(taken - at) > 0.002:
            fail(f"{at} was sent, the sensor has {taken}")
        show(options, {"sent_s": at, "taken_s": taken, "sample": received["Sample index"].raw})


main()
