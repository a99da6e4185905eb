"""Reads who a sensor is and how it is.

    python examples/python/identity.py --node 0x20
"""

from bus import arguments, connect, sensor, show

RESET_CAUSES = ["power", "pin", "watchdog", "software", "brown-out", "panic"]


def main():
    options = arguments(__doc__.splitlines()[0]).parse_args()
    with connect(options) as network:
        sdo = sensor(network, options).sdo
        identity = sdo["Identity object"]
        losses = sdo["Losses"]
        result = {
            "device": sdo["Manufacturer device name"].raw,
            "hardware": sdo["Manufacturer hardware version"].raw,
            "software": sdo["Manufacturer software version"].raw,
            "vendor": identity["Vendor id"].raw,
            "product": identity["Product code"].raw,
            "revision": identity["Revision number"].raw,
            "serial": identity["Serial number"].raw,
            "uptime_s": sdo["Board"]["Uptime"].raw,
            "reset_cause": RESET_CAUSES[sdo["Board"]["Reset cause"].raw],
            "error_register": sdo["Error register"].raw,
            "noise_N": sdo["Detector"]["Noise"].raw,
            "settled": bool(sdo["Detector"]["Settled"].raw),
            "losses": {losses.od[sub].name: losses[sub].raw for sub in range(1, losses[0].raw + 1)},
        }
    show(options, result)


main()
