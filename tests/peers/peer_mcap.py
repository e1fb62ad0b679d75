#!/usr/bin/env python3
"""The recordings of slew run, read by the package mcap: whole ones by their
index and from the beginning, cut ones as far as they go, and the same figures
as in the CSV of the same run.  Reads no clock."""
import csv
import io
import json
import os
import random
import struct
import subprocess
import sys
import tempfile

from mcap.exceptions import EndOfFile
from mcap.reader import NonSeekingReader, make_reader
from mcap.records import Message
from mcap.stream_reader import StreamReader

SLEW = os.environ["SLEW"]
SEED, CUTS = 14, 12


def fail(what):
    print("  FAILED: " + what)
    sys.exit(1)


def expect(what, got, want):
    if got != want:
        fail("%s: %s, expected %s" % (what, got, want))


def whole_one(data):
    reader = make_reader(io.BytesIO(data), validate_crcs=True)
    summary = reader.get_summary()
    indexed = [m for _, _, m in reader.iter_messages()]
    linear = [m for _, _, m in NonSeekingReader(
        io.BytesIO(data), validate_crcs=True).iter_messages()]
    expect("messages of the statistics", summary.statistics.message_count,
           len(linear))
    expect("messages by the index", len(indexed), len(linear))
    expect("order of time", [m.log_time for m in indexed],
           sorted(m.log_time for m in linear))
    for schema in summary.schemas.values():
        expect("encoding", schema.encoding, "jsonschema")
        expect("a schema", json.loads(schema.data)["type"], "object")
    for name, path in (("rig", "rig"), ("move", "move")):
        file = "examples/dolly/%s.yaml" % path
        attached = [a.data for a in reader.iter_attachments()
                    if a.name == file]
        expect("the text of the " + name, attached,
               [open(file, "rb").read()])
    # Of any one second alone.
    first = summary.statistics.message_start_time
    part = [m.log_time for _, _, m in reader.iter_messages(
        starting_at=first + 5_000_000_000,
        ending_before=first + 6_000_000_000)]
    expect("messages of a second", len(part), sum(
        first + 5_000_000_000 <= m.log_time < first + 6_000_000_000
        for m in linear))
    return linear


def against_csv(data, path):
    """Every number of every axis, as text."""
    reader = make_reader(io.BytesIO(data))
    rows = {}
    for schema, channel, message in reader.iter_messages():
        if schema.name.startswith("slew.axis."):
            axis = channel.topic.rsplit("/", 1)[1]
            for key, value in json.loads(message.data,
                                         parse_float=str).items():
                rows.setdefault(message.sequence, {})[axis + "." + key] = \
                    str(value)
    compared = 0
    for number, row in enumerate(csv.DictReader(open(path))):
        mine = rows[number]
        for key, value in mine.items():
            expect("row %d, %s" % (number, key), value, row[key])
        compared += len(mine)
    expect("rows", len(rows), number + 1)
    return compared


def messages_of(data):
    """All there are before it breaks off."""
    found = []
    try:
        for record in StreamReader(io.BytesIO(data),
                                   validate_crcs=True).records:
            if isinstance(record, Message):
                found.append((record.channel_id, record.log_time,
                              record.data))
    except (EndOfFile, struct.error):
        pass
    return found


def cut_ones(data, directory):
    """The package finds a prefix, and slew the same one."""
    draw = random.Random(SEED)
    every = messages_of(data)
    for _ in range(CUTS):
        cut = draw.randrange(8192, len(data))
        found = messages_of(data[:cut])
        expect("cut at %d: messages" % cut, found, every[:len(found)])
        path = os.path.join(directory, "cut.mcap")
        with open(path, "wb") as file:
            file.write(data[:cut])
        said = subprocess.run([SLEW, "report", "--json", path],
                              capture_output=True, check=False)
        rows = json.loads(said.stdout)["rows"] if said.stdout else 0
        expect("cut at %d: rows" % cut, rows,
               len({m[1] for m in found if m[0] == 0}))


def documented(path, data):
    """The lines of Python in docs/RECORDINGS.md, on a whole recording."""
    text = open("docs/RECORDINGS.md").read()
    lines = text.split("```python\n")[1].split("```")[0]
    said = subprocess.run([sys.executable, "-c", lines, path],
                          check=True, capture_output=True, text=True).stdout
    worst = {}
    for _, channel, message in make_reader(io.BytesIO(data)).iter_messages():
        if channel.topic.startswith("/axes/"):
            for key, value in json.loads(message.data).items():
                if key.startswith("following"):
                    worst[channel.topic] = max(
                        worst.get(channel.topic, 0), abs(value))
    expect("what the lines print", said,
           "".join("%s %s\n" % item for item in worst.items()))


def main():
    with tempfile.TemporaryDirectory() as directory:
        mcap, table = (os.path.join(directory, n)
                       for n in ("run.mcap", "run.csv"))
        subprocess.run([SLEW, "run", "--json", "--record", mcap,
                        "--telemetry", table, "examples/dolly"],
                       check=True, capture_output=True)
        data = open(mcap, "rb").read()
        messages = whole_one(data)
        print("  %d messages, by the index and from the beginning" %
              len(messages))
        print("  %d numbers as in the CSV" % against_csv(data, table))
        documented(mcap, data)
        print("  the lines of docs/RECORDINGS.md")
        cut_ones(data, directory)
        print("  cut at %d places, seed %d: the messages before" %
              (CUTS, SEED))


main()
