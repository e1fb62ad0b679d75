#!/bin/sh
# firmware/studio/embed.sh TABLE FILTER [NAME=FILE]... - a table of
# embedded.h in C: of each file what FILTER (cat, gzip -n9) makes of it, by name.
set -eu
table=$1 filter=$2
shift 2

echo '#include "firmware/studio/embedded.h"'
n=0
for pair in "$@"; do
    printf '/* %s */\nstatic const unsigned char data_%d[] = {\n' "$pair" $n
    $filter <"${pair#*=}" | od -An -v -tu1 | sed 's/  */,/g; s/^,//; s/$/,/'
    echo '0 };'
    n=$((n + 1))
done
echo "const struct embedded_file ${table}[] = {"
n=0
for pair in "$@"; do
    printf '{ "%s", data_%d, sizeof data_%d - 1 },\n' "${pair%%=*}" $n $n
    n=$((n + 1))
done
echo '{ 0, 0, 0 } };'
