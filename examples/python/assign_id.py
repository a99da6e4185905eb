"""Gives the sensor with this serial number a node id by LSS, whatever id it has now.

    python examples/python/assign_id.py --serial 77 --to 0x21
"""

import time

import canopen
from canopen.lss import LssError

from bus import EDS, PRODUCT, REVISION, VENDOR, arguments, connect, fail, show


def main():
    parser = arguments(__doc__.splitlines()[0], node=False)
    parser.add_argument("--serial", type=int, required=True, help="serial number, as printed on the sensor")
    parser.add_argument("--to", type=lambda text: int(text, 0), required=True, help="node id, 1 to 127")
    options = parser.parse_args()
    with connect(options) as network:
        lss = network.lss
        # All to waiting, then the one to configuration.
        lss.send_switch_state_global(lss.WAITING_STATE)
        try:
            lss.send_switch_state_selective(VENDOR, PRODUCT, REVISION, options.serial)
        except LssError:
            fail(f"no sensor with serial number {options.serial} answered")
        before = lss.inquire_node_id()
        try:
            lss.configure_node_id(options.to)
            lss.store_configuration()
        except LssError as error:
            fail(f"node id {options.to} was refused: {error}")
        finally:
            lss.send_switch_state_global(lss.WAITING_STATE)
        # A sensor that had an id takes the new one at the reset of its communication.
        if 1 <= before <= 127:
            network.send_message(0, [0x82, before])
        time.sleep(0.5)
        node = network.add_node(canopen.RemoteNode(options.to, str(EDS)))
        serial = node.sdo["Identity object"]["Serial number"].raw
        if serial != options.serial:
            fail(f"node id {options.to} answers with serial number {serial}")
    show(options, {"serial": serial, "before": before, "node": options.to})


main()
