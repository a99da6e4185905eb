"""Waits for faults (EMCY) and reads the history of those that were before.

    python examples/python/faults.py --count 1
"""

import queue

from bus import arguments, connect, fail, sensor, show


def main():
    parser = arguments(__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=1, help="end after so many faults [%(default)s]")
    parser.add_argument("--patience", type=float, default=60.0, help="seconds to wait for one [%(default)s]")
    options = parser.parse_args()
    arrived = queue.Queue()
    with connect(options) as network:
        node = sensor(network, options)
        node.emcy.add_callback(arrived.put)
        node.nmt.state = "OPERATIONAL"
        show(options, {"listening": options.node}, f"listening to node {options.node}")
        for _ in range(options.count):
            try:
                fault = arrived.get(timeout=options.patience)
            except queue.Empty:
                fail(f"no fault within {options.patience} s")
            told = {
                "code": fault.code,
                "register": fault.register,
                "cause": fault.data[0],
                "detail": int.from_bytes(fault.data[1:], "little"),
                "meaning": fault.get_desc(),
            }
            show(options, {"fault": told}, f"{fault}, register 0x{fault.register:02X}, detail {told['detail']}")
        history = node.sdo["Pre-defined error field"]
        codes = [history[sub].raw & 0xFFFF for sub in range(1, history[0].raw + 1)]
        show(options, {"history": codes}, "history, newest first: " + ", ".join(f"0x{code:04X}" for code in codes))


main()
