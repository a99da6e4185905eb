"""Starts a sensor and shows its alarms and events as they arrive by PDO.

    python examples/python/watch.py --events 3

An event comes in five frames that carry the low 16 bits of its number; a frame that is missed leaves the event
incomplete, and it can be read from the log (0x2200).
"""

import queue

from bus import arguments, connect, fail, sensor, show

VERDICTS = ["none", "pass", "inconclusive", "fail"]
ALARM, PARTS = 1, range(2, 7)


# Objects in which 0xFFFF means that there is no such value.
OPTIONAL = ["Quasi-static force", "Effective mass", "Age of the mass"]


def physical(message):
    """The values of a PDO by name, in the units of the EDS file; None for a value that there is not."""
    values = {}
    for variable in message:
        name = variable.name.split(".")[-1]
        none = name in OPTIONAL and variable.raw == 0xFFFF
        # Steps are decimal fractions; six digits are more than any of them has (but for the 1/256 of a sample).
        values[name] = None if none else round(variable.phys, 8)
    return values


def main():
    parser = arguments(__doc__.splitlines()[0])
    parser.add_argument("--events", type=int, default=1, help="end after so many events [%(default)s]")
    parser.add_argument("--patience", type=float, default=60.0, help="seconds to wait for the next frame [%(default)s]")
    options = parser.parse_args()
    arrived = queue.Queue()
    with connect(options) as network:
        node = sensor(network, options)
        # COB-IDs and mappings as the sensor has them now, not as the EDS file says they were at first.
        node.tpdo.read()
        for number in [ALARM, *PARTS]:
            node.tpdo[number].add_callback(lambda message, number=number: arrived.put((number, physical(message))))
        node.nmt.state = "OPERATIONAL"
        node.nmt.wait_for_heartbeat(timeout=5)
        show(options, {"state": node.nmt.state}, f"node {options.node} is {node.nmt.state}; waiting for a robot")

        open_events, seen = {}, 0
        while seen < options.events:
            try:
                number, values = arrived.get(timeout=options.patience)
            except queue.Empty:
                fail(f"nothing arrived for {options.patience} s")
            if number == ALARM:
                show(options, {"alarm": values}, f"contact! {values['Force']:.1f} N at sample {values['Index']}")
                continue
            parts = open_events.setdefault(values["Number"], {})
            parts |= values
            parts.setdefault("frames", set()).add(number)
            if len(parts["frames"]) < len(PARTS):
                continue
            event = open_events.pop(values["Number"])
            del event["frames"]
            event["Verdict"] = VERDICTS[event["Verdict"]]
            seen += 1
            words = (f"event {event['Number']}: peak {event['Peak']:.1f} N, scaled {event['Scaled force']:.1f} N, "
                     f"impulse {event['Impulse']:.3f} N s, {event['Verdict']}")
            show(options, {"event": event}, words)


main()
