"""Configures region, stiffness and effective mass: all of them together, or none.

    python examples/python/configure.py --region 5 --stiffness 25000 --mass 6.1

Regions are those of ISO/TS 15066: 1 skull, 2 face, 3 neck, 4 back, 5 chest, 6 abdomen, 7 pelvis, 8 upper arm,
9 lower arm, 10 hand, 11 thigh, 12 lower leg.
"""

import canopen

from bus import arguments, connect, fail, sensor, show

APPLY, DISCARD = 1, 2
# SDO aborts: the sensor is armed (Operational); its configuration is locked with a key, which `thud configure --key` has.
ARMED, LOCKED = 0x08000022, 0x08000021
REASONS = {1: "is too low", 2: "is too high", 3: "is no such value", 4: "contradicts another setting"}


def refusal(sdo):
    """What the sensor says about what it refused last."""
    last = sdo["Last refusal"]
    index, sub = divmod(last["Object"].raw, 256)
    name = sdo[index].od[sub].name
    lowest, highest = last["Lowest"].raw, last["Highest"].raw
    permitted = f"; {lowest:g} to {highest:g} is permitted" if lowest == lowest else ""
    return f"{name} {last['Offered'].raw:g} {REASONS[last['Reason'].raw]}{permitted}; nothing was changed"


def main():
    parser = arguments(__doc__.splitlines()[0])
    parser.add_argument("--region", type=int, help="body region, 1 to 12; 0 for none")
    parser.add_argument("--stiffness", type=float, help="of the body spring, N/m")
    parser.add_argument("--mass", type=float, help="effective mass of the robot, kg; 0 for unknown")
    options = parser.parse_args()
    wanted = [
        ("Judgement settings", "Region", options.region),
        ("Judgement settings", "Body stiffness", options.stiffness),
        ("Effective mass settings", "Effective mass", options.mass),
    ]
    with connect(options) as network:
        node = sensor(network, options)
        sdo = node.sdo
        transaction = sdo["Configuration transaction"]
        before = transaction["Revision"].raw

        def change():
            for record, name, value in wanted:
                if value is not None:
                    sdo[record][name].raw = value
            transaction["Command"].raw = APPLY

        disarmed = False
        try:
            try:
                change()
            except canopen.SdoAbortedError as abort:
                if abort.code != ARMED:
                    raise
                node.nmt.state, disarmed = "PRE-OPERATIONAL", True
                change()
        except canopen.SdoAbortedError as abort:
            if abort.code == LOCKED:
                fail("the configuration is locked with a key; nothing was changed (SDO abort 0x08000021)")
            sentence = refusal(sdo)
            transaction["Command"].raw = DISCARD
            fail(f"{sentence} (SDO abort 0x{abort.code:08X})")
        finally:
            if disarmed:
                node.nmt.state = "OPERATIONAL"
        # What is read back is what is active now.
        result = {name: sdo[record][name].raw for record, name, _ in wanted}
        result |= {"revision": transaction["Revision"].raw, "revision_before": before, "hash": transaction["Hash"].raw}
        result["disarmed"] = disarmed
    show(options, result)


main()
