"""Reads every object of a living sensor and compares it with the EDS file; writes what must not be written."""

import logging
import sys
import warnings

import canopen
from canopen.objectdictionary import datatypes

warnings.simplefilter("error")
from bus import arguments, connect, sensor  # noqa: E402  (examples/python is on the path)

NO_DATA, READ_ONLY, WRITE_ONLY, NO_OBJECT, NO_SUB = 0x08000024, 0x06010002, 0x06010001, 0x06020000, 0x06090011
# These hold nothing yet in a sensor that nothing has hit, no fault has met and no robot has told its mass.
EMPTY = {(0x1003, sub) for sub in range(1, 9)} | {(slot, sub) for slot in (0x2300, 0x2301) for sub in range(2, 13)}
EMPTY |= {(0x2200, 5)}


class Loud(logging.Handler):
    """A warning of canopen about the EDS file is a failure."""

    def emit(self, record):
        sys.exit(f"canopen warns: {record.getMessage()}")


def abort_of(action):
    try:
        action()
    except canopen.SdoAbortedError as abort:
        return abort.code
    return None


options = arguments(__doc__).parse_args()
loud = Loud(logging.WARNING)
logging.getLogger("canopen").addHandler(loud)
with connect(options) as network:
    node = sensor(network, options)
    logging.getLogger("canopen").removeHandler(loud)
    dictionary, count = node.object_dictionary, 0
    for index in dictionary:
        entry = dictionary[index]
        for variable in entry.values() if hasattr(entry, "values") else [entry]:
            at, where = (index, variable.subindex), f"0x{index:04X}:{variable.subindex} {variable.name}"
            count += 1
            if variable.access_type == "wo":
                assert abort_of(lambda: node.sdo.upload(*at)) == WRITE_ONLY, where
                continue
            if at in EMPTY:
                assert abort_of(lambda: node.sdo.upload(*at)) == NO_DATA, where
                continue
            data = node.sdo.upload(*at)
            if variable.data_type in variable.STRUCT_TYPES:
                assert len(data) == variable.STRUCT_TYPES[variable.data_type].size, f"{where}: {len(data)} bytes"
                value = variable.decode_raw(data)
                # The sensor was started with a region and a mass; all else is as it was made. Single precision: seven digits.
                if variable.default is not None and at not in {(0x2000, 1), (0x2001, 1)}:
                    assert abs(value - variable.default) <= 1e-6 * abs(variable.default), f"{where}: {value}"
            elif variable.default is not None:
                assert data.decode() == variable.default, where
            if variable.access_type in ("ro", "const"):
                assert abort_of(lambda: node.sdo.download(*at, data)) == READ_ONLY, where
            elif variable.min is not None and variable.data_type in datatypes.INTEGER_TYPES:
                for beyond in (variable.min - 1, variable.max + 1):
                    if 0 <= beyond < 1 << len(variable):
                        assert abort_of(lambda: node.sdo.download(*at, variable.encode_raw(beyond))) is not None, where
    node.sdo["Configuration transaction"]["Command"].raw = 2
    assert abort_of(lambda: node.sdo.upload(0x5000, 0)) == NO_OBJECT
    assert abort_of(lambda: node.sdo.upload(0x2000, 9)) == NO_SUB
    # The three ways to write: expedited, segmented, block.
    stiffness = dictionary[0x2000][4]
    node.sdo.download(0x2000, 4, stiffness.encode_raw(30e3), force_segment=True)
    assert node.sdo[0x2000][4].raw == 30e3
    with node.sdo[0x2000][4].open("wb", size=4, block_transfer=True) as block:
        block.write(stiffness.encode_raw(31e3))
    assert node.sdo[0x2000][4].raw == 31e3
    node.sdo["Configuration transaction"]["Command"].raw = 2
    assert node.sdo[0x2000][4].raw == 25e3
    # PDO parameters as canopen's own classes read and save them.
    node.tpdo.read()
    node.rpdo.read()
    assert [node.tpdo[number].cob_id - options.node for number in range(1, 7)] == [0, 0x280, 0x380, 0x480, 0x300, 0x400]
    assert node.rpdo[1].cob_id == 0x200 + options.node
    # The alarm where CiA 301 has the first TPDO.
    node.tpdo[1].cob_id = 0x180 + options.node
    node.tpdo[1].save()
    assert node.sdo[0x1800][1].raw & 0x7FF == 0x180 + options.node
    node.store()
    assert abort_of(lambda: node.sdo.download(0x1010, 1, b"evas")) is not None
print(f"{count} objects are as described")
