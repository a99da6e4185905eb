"""The bus and the sensor on it, as every example here opens them; and results as one line of JSON with --json.

Default is the bus that `thud sensor --bus udp` lives on. With hardware: --interface socketcan --channel can0.
"""

import argparse
import json
import pathlib
import sys

import canopen

CAN_FILES = pathlib.Path(__file__).resolve().parents[2] / "docs" / "can"
EDS = CAN_FILES / "thud.eds"
DBC = CAN_FILES / "thud.dbc"
# What 0x1018 says of every thud sensor; 0 stands for "no vendor id assigned".
VENDOR, PRODUCT, REVISION = 0, int.from_bytes(b"thud", "big"), 0x0001_0000


def arguments(description, node=True):
    """A parser with the options that all examples share."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--interface", default="udp_multicast", help="python-can interface [%(default)s]")
    parser.add_argument("--channel", default="239.74.163.2", help="its channel [%(default)s]")
    parser.add_argument("--port", type=int, default=43113, help="UDP port, for udp_multicast [%(default)s]")
    parser.add_argument("--bitrate", type=int, default=1_000_000, help="bit/s, for hardware [%(default)s]")
    parser.add_argument("--json", action="store_true", help="print the result as JSON")
    if node:
        parser.add_argument("--node", type=lambda text: int(text, 0), default=0x20, help="node id [%(default)s]")
    return parser


def bus_settings(options):
    """What python-can needs to open the bus."""
    settings = {"interface": options.interface, "channel": options.channel}
    if options.interface == "udp_multicast":
        settings["port"] = options.port
    else:
        settings["bitrate"] = options.bitrate
    return settings


def connect(options):
    """The network; use it in a `with` statement, which disconnects at the end."""
    network = canopen.Network()
    network.connect(**bus_settings(options))
    return network


def sensor(network, options):
    """The sensor with the node id that the options name, described by the EDS file."""
    node = network.add_node(canopen.RemoteNode(options.node, str(EDS)))
    # A sensor answers within milliseconds; a busy computer may not.
    node.sdo.RESPONSE_TIMEOUT = 2.0
    return node


def show(options, result, words=None):
    """Prints a result: as JSON, or as `words` (else one line for each entry)."""
    if options.json:
        print(json.dumps(result), flush=True)
    elif words is not None:
        print(words, flush=True)
    else:
        for name, value in result.items():
            print(f"{name:>24}: {value}", flush=True)


def fail(sentence):
    """Ends with a sentence that says what was wrong."""
    sys.exit(f"error: {sentence}")
