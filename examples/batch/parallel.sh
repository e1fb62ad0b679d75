#!/bin/sh
# examples/batch/parallel.sh - a batch in shards by GNU parallel, on this machine
# or on those of --sshlogin; each shard goes on where it was when run again.
#
#   parallel.sh DIRECTORY SHARDS [RUNS]      results in all.csv, all.png
#
# On several machines: parallel --sshlogin a,b --workdir ... with the rig's files
# and slew there, and the shards' results brought back (--return).
set -eu
rig=$1 shards=$2 runs=${3:-1000}
slew=${SLEW:-slew}

seq "$shards" | parallel --halt soon,fail=1 --retries 3 -j 1 \
    "$slew" batch --shard {}/"$shards" --runs "$runs" --seed 1 \
    --vary "'*.mass=0.5..2'" --out shard-{}.csv "$rig"

"$slew" batch --merge --out all.csv --parquet all.parquet --plot all.png \
    $(seq -f "shard-%g.csv" "$shards")
