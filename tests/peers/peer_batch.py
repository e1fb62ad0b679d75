"""pyarrow reads the tables of slew batch: the Parquet file has what the CSV has,
to the last bit of every number.  Reads no clock.

    SLEW=build/slew PEERS=build/peers python tests/peers/peer_batch.py
"""

import csv
import os
import subprocess
import sys

import pyarrow.parquet as parquet

SLEW = os.environ["SLEW"]
DIR = os.path.join(os.environ["PEERS"], "batch")
RUNS = 30


def main():
    os.makedirs(DIR, exist_ok=True)
    to, table = os.path.join(DIR, "r.csv"), os.path.join(DIR, "r.parquet")
    # Heavy loads: some runs end in a fault, whose words have commas.
    subprocess.run(
        [SLEW, "batch", "--runs", str(RUNS), "--seed", "3", "--vary",
         "*.mass=0.5..20,pan.friction=0..200", "--out", to, "--parquet", table,
         "tests/data/fmu"], check=True, stdout=subprocess.DEVNULL)
    with open(to, newline="") as file:
        rows = list(csv.DictReader(file))
    seen = parquet.read_table(table)
    meta = parquet.ParquetFile(table).metadata
    kinds = {f.name: str(f.type) for f in seen.schema}
    columns = seen.to_pydict()
    same = list(columns) == list(rows[0]) and seen.num_rows == len(rows) == RUNS
    for name, kind in kinds.items():
        read = {"int64": int, "double": float, "string": str}[kind]
        same = same and columns[name] == [read(row[name]) for row in rows]
    typed = (kinds["run"] == "int64" and kinds["pan.mass"] == "double"
             and kinds["end"] == kinds["fault"] == "string")
    print(f"  {meta.num_rows} rows, {meta.num_columns} columns by "
          f"{meta.created_by}: {'the same' if same else 'OTHERS'} as in the "
          f"CSV; ends: {sorted(set(columns['end']))}")
    if not typed:
        print(f"  other types: {kinds}")
    return not (same and typed)


if __name__ == "__main__":
    sys.exit(main())
