"""Downloads the newest force recording by SDO and writes it as CSV (t_s, force_N).

    python examples/python/download.py --block --out curve.csv

Segmented transfer asks for every seven bytes; block transfer (--block) confirms 127 segments at once and checks them
with a CRC. Either way the length and the CRC-32 of the whole curve are checked here.
"""

import binascii
import struct
import time

import canopen

from bus import arguments, connect, fail, sensor, show

# SDO abort "because of the present device state".
OVERWRITTEN = 0x0800_0022


def main():
    parser = arguments(__doc__.splitlines()[0])
    parser.add_argument("--block", action="store_true", help="block transfer instead of segmented")
    parser.add_argument("--out", help="CSV file to write")
    options = parser.parse_args()
    with connect(options) as network:
        sdo = sensor(network, options).sdo
        slots = [sdo[name] for name in ("Recording A", "Recording B")]
        filled = [slot for slot in slots if slot["Filled"].raw]
        if not filled:
            fail("no recording is stored; hit the sensor first")
        slot = max(filled, key=lambda slot: slot["Impact"].raw)
        impact, length = slot["Impact"].raw, slot["Length"].raw
        began = time.monotonic()
        try:
            with slot["Curve"].open("rb", block_transfer=options.block, buffering=1024) as curve:
                data = curve.read()
        except canopen.SdoAbortedError as abort:
            if abort.code != OVERWRITTEN:
                raise
            fail(f"impact {impact} was overwritten by newer ones during the download; try again, or with --block")
        took = time.monotonic() - began
        if slot["Filled"].raw == 0 or slot["Impact"].raw != impact:
            fail(f"impact {impact} was overwritten during the download; try again")
        if len(data) != 2 * length or binascii.crc32(data) != slot["CRC"].raw:
            fail(f"{len(data)} bytes came for {length} samples, or their CRC does not fit; try again")
        rate, zero, newton_per_code = (slot[name].raw for name in ("Sample rate", "Zero", "Force per code"))
        onset = slot["Onset index"].raw - slot["First index"].raw
    forces = [(code - zero) * newton_per_code for code in struct.unpack(f"<{length}H", data)]
    if options.out:
        with open(options.out, "w", encoding="ascii") as csv:
            csv.write("t_s,force_N\n")
            csv.writelines(f"{(sample - onset) / rate:.6f},{force:.4f}\n" for sample, force in enumerate(forces))
    show(options, {
        "impact": impact,
        "samples": length,
        "sample_rate_Hz": rate,
        "peak_N": max(forces),
        "crc32": binascii.crc32(data),
        "took_s": round(took, 3),
    })


main()
