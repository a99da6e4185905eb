"""Finds every sensor on the bus: asks all node ids, and says who each one is.

    python examples/python/find.py
"""

import time

import canopen

from bus import EDS, PRODUCT, arguments, connect, fail, show


def main():
    parser = arguments(__doc__.splitlines()[0], node=False)
    parser.add_argument("--patience", type=float, default=1.0, help="seconds to wait for answers [%(default)s]")
    options = parser.parse_args()
    with connect(options) as network:
        # An SDO request to every node id; whoever answers is there.
        network.scanner.search()
        time.sleep(options.patience)
        sensors = []
        for node_id in sorted(set(network.scanner.nodes)):
            node = network.add_node(canopen.RemoteNode(node_id, str(EDS)))
            identity = node.sdo["Identity object"]
            if identity["Product code"].raw != PRODUCT:
                continue  # some other CANopen device
            sensors.append({"node": node_id, "serial": identity["Serial number"].raw})
    if not sensors:
        fail(f"no sensor answered within {options.patience} s on {options.channel}; is it powered, and at 1 Mbit/s?")
    show(options, {"sensors": sensors}, "\n".join(f"node {s['node']}: serial number {s['serial']}" for s in sensors))


main()
