"""Decodes every frame of a sensor with the DBC file: alarms, events, streamed samples, masses, faults; no CANopen at all.

    python examples/python/decode.py --seconds 10
    python examples/python/decode.py --log monday.log

The sensor streams its samples when 0x2020:1 says so (`thud log --stream 20`).
"""

import time

import can
import cantools

from bus import DBC, arguments, bus_settings, show


def frames(options):
    """Frames from a candump log, or from the bus for as long as is wanted."""
    if options.log:
        yield from can.CanutilsLogReader(options.log)
        return
    with can.Bus(**bus_settings(options)) as bus:
        show(options, {"listening": bus.channel_info}, f"listening to {bus.channel_info}")
        end = time.monotonic() + options.seconds
        while (left := end - time.monotonic()) > 0:
            frame = bus.recv(left)
            if frame is not None:
                yield frame


def main():
    parser = arguments(__doc__.splitlines()[0])
    parser.add_argument("--log", help="a candump log instead of a bus")
    parser.add_argument("--seconds", type=float, default=10.0, help="how long to listen [%(default)s]")
    options = parser.parse_args()
    database = cantools.database.load_file(str(DBC), strict=True)
    # The DBC file is for node id 0x20; messages for everybody are not in it.
    known = {message.frame_id - 0x20 + options.node: message for message in database.messages}
    counts = {}
    for frame in frames(options):
        message = known.get(frame.arbitration_id)
        if message is None or frame.is_extended_id or frame.is_remote_frame or frame.is_error_frame:
            continue
        # A number where the DBC file names it ("none", "fail"), else the value in its unit.
        values = {name: value if isinstance(value, (int, float)) else str(value)
                  for name, value in message.decode(bytes(frame.data)).items()}
        counts[message.name] = counts.get(message.name, 0) + 1
        words = ", ".join(f"{name} {value}" for name, value in values.items())
        show(options, {message.name: values}, f"{message.name}: {words}")
    show(options, {"counts": counts})


main()
