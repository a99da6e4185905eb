"""Sends the robot's effective mass while it moves, as a robot controller would: with the DBC file and no CANopen at all.

    python examples/python/stream_mass.py --mass 4.2 --seconds 5

The mass at the contact point depends on the posture; a real controller computes it anew for every frame.
"""

import time

import can
import cantools

from bus import DBC, arguments, bus_settings, show


def main():
    parser = arguments(__doc__.splitlines()[0])
    parser.add_argument("--mass", type=float, required=True, help="effective mass, kg")
    parser.add_argument("--rate", type=float, default=50.0, help="frames a second [%(default)s]")
    parser.add_argument("--seconds", type=float, default=1.0, help="how long [%(default)s]")
    options = parser.parse_args()
    database = cantools.database.load_file(str(DBC), strict=True)
    frame = database.get_message_by_name("EffectiveMass")
    # The DBC file is for node id 0x20.
    identifier = frame.frame_id - 0x20 + options.node
    count = max(1, round(options.seconds * options.rate))
    with can.Bus(**bus_settings(options)) as bus:
        for sequence in range(count):
            data = frame.encode({"EffectiveMass": options.mass, "Sequence": sequence & 0xFFFF})
            bus.send(can.Message(arbitration_id=identifier, is_extended_id=False, data=data))
            time.sleep(1.0 / options.rate)
    show(options, {"sent": count, "node": options.node})


main()
