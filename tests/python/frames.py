"""Decodes the firmware's frames (JSON lines on standard input) with cantools, compares, and encodes them again; then encodes
random effective masses (JSON lines on standard output) for the firmware to decode.

    python tests/python/frames.py docs/can/thud.dbc 4000 < frames.jsonl > masses.jsonl
"""

import json
import random
import sys

import cantools

database = cantools.database.load_file(sys.argv[1], strict=True)
masses = int(sys.argv[2])
counts = {}


def compare(line, message, found, data):
    """Every value is what was meant: exactly, or within half a step, or at the end of its range."""
    for name, meant in line["is"].items():
        got, signal = found[name], message.get_signal_by_name(name)
        where = f"{message.name}.{name}: {meant} became {got} in {data.hex()}"
        if not isinstance(meant, list):
            assert str(got) == meant if isinstance(meant, str) else got == meant, where
            continue
        value, _ = meant
        # Fields that may be empty reserve their last number for that.
        step = signal.conversion.scale
        highest = signal.maximum - (step if signal.choices else 0)
        kept = min(max(value, signal.minimum), highest)
        # Half a step of rounding and the resolution of a single-precision product.
        assert not isinstance(got, str) and abs(got - kept) <= step * 0.5 + abs(kept) * 3e-7, where


def judge(event):
    """The frames of an event, alarm or forecast: a value is marked as out of range exactly when it had to be cut."""
    markers_of_event = {name: raw for name, raw in event[0][2].items() if name.endswith("OutOfRange")}
    must = dict.fromkeys(markers_of_event, False)
    may = dict.fromkeys(markers_of_event, False)
    for line, message, found in event:
        for name, meant in line["is"].items():
            if not isinstance(meant, list):
                continue
            signal, (value, marker) = message.get_signal_by_name(name), meant
            step = signal.conversion.scale
            highest = signal.maximum - (step if signal.choices else 0)
            # At half a step beyond the end, rounding decides.
            tolerance = 0.01 * step + abs(value) * 3e-7
            must[marker] |= value > highest + 0.5 * step + tolerance or value < signal.minimum - 0.5 * step - tolerance
            may[marker] |= value > highest + 0.5 * step - tolerance or value < signal.minimum - 0.5 * step + tolerance
    for marker, marked in markers_of_event.items():
        assert (marked or not must[marker]) and (may[marker] or not marked), f"{marker} is {marked}: {event}"
        counts[marker] = counts.get(marker, 0) + marked


event = []
for text in sys.stdin:
    line = json.loads(text)
    message, data = database.get_message_by_name(line["message"]), bytes.fromhex(line["data"])
    found = message.decode(data)
    compare(line, message, found, data)
    # Strictly: values outside the ranges that the file names would be refused.
    assert message.encode(found, strict=True) == data, text
    counts[message.name] = counts.get(message.name, 0) + 1
    if message.name in ("Alarm", "Forecast"):
        judge([(line, message, found)])
    elif message.name.startswith("Event"):
        event.append((line, message, found))
        if len(event) == 5:
            judge(event)
            event = []

sent = {message.name for message in database.messages} - {"EffectiveMass", "Heartbeat"}
assert sent <= counts.keys(), f"{sent - counts.keys()} never came"
never = [name for name, count in counts.items() if count == 0]
assert not never, f"{never} were never set: the values are not extreme enough"

draw = random.Random(4)
frame = database.get_message_by_name("EffectiveMass")
for case in range(masses):
    mass = {0: 0.05, 1: 1000.0}.get(case, draw.choice([draw.uniform(0.05, 1000.0), draw.uniform(0.05, 10.0)]))
    sequence = {0: 0, 1: 0xFFFF}.get(case, draw.randrange(0x10000))
    data = frame.encode({"EffectiveMass": mass, "Sequence": sequence}, strict=True)
    print(json.dumps({"mass": mass, "sequence": sequence, "data": data.hex()}))
# What the sensor would refuse cannot even be encoded.
for impossible in (0.04, 1000.1, -1.0):
    try:
        frame.encode({"EffectiveMass": impossible, "Sequence": 0}, strict=True)
    except cantools.database.errors.EncodeError:
        continue
    sys.exit(f"cantools encoded {impossible} kg")
