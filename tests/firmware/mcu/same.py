#!/usr/bin/env python3
"""Did a board make the set points of slew run?

    same.py TELEMETRY.csv LOG AXIS...

Of every tick of the move that both have, by its path time, each set point of the
board's axes, in the order of the board, is that of the recording to the bit.  The
recording has its last row of every path time; where the log of the board does not
hold all of the move, its end does.
"""
import csv
import sys
from decimal import Decimal


def main():
    telemetry, log, *axes = sys.argv[1:]
    with open(log) as file:
        rows = [line.split(",") for line in file if "," in line]
    board = {int(row[0]): [int(v) for v in row[1:]] for row in rows}
    with open(telemetry) as file:
        reader = csv.DictReader(file)
        columns = [next(c for c in reader.fieldnames
                        if c.startswith(axis + ".demand_")) for axis in axes]
        want = {int(Decimal(row["path_ns"])): [round(Decimal(row[c]) * 2**32)
                                      for c in columns]
                for row in reader if row["phase"] == "move" and
                Decimal(row["path_ns"]) > 0}
    both = sorted(set(board) & set(want))
    wrong = [t for t in both if board[t] != want[t]]
    end = max(want) if want else 0
    if len(both) < 100 or wrong or end not in board:
        sys.exit(f"{len(both)} ticks of both, {len(wrong)} differ"
                 f"{f', first at {wrong[0]} ns' if wrong else ''}; the move's end"
                 f" is {'' if end in board else 'not '}in the log of the board")
    print(f"{len(both)} ticks of {len(axes)} axes equal to the bit, of "
          f"{len(want)} that slew run made")


if __name__ == "__main__":
    main()
