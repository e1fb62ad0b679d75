#!/bin/sh
# tests/proofs/libm.sh LIBM OBJECT... - what these objects call of libm is exact:
# rounded as IEEE 754 says, so that it is the same with every C library.  The rest
# stands in motion/double.
set -eu
export LC_ALL=C

libm=$1
shift
exact='(ceil|copysign|f(abs|dim|ma|max|min|mod)|floor|frexp|i?logb|ldexp|l?l?r(int|ound)
    |modf|nan|nearbyint|nextafter|remainder|scalbl?n|sqrt|trunc)[fl]?'
exact=$(printf '%s' "$exact" | tr -d ' \n')

nm -D --defined-only "$libm" | sed 's/.* //; s/@.*//' |
    { cat && echo . && nm --print-file-name "$@"; } | awk -v exact="^($exact)\$" '
!objects && $1 == "." { objects = 1; next }
!objects { of_libm[$1] = 1; next }
{ file = $1; sub(/:[^:]*$/, "", file); seen[file] = 1 }
$(NF - 1) == "U" && $NF in of_libm {
    calls++
    if ($NF !~ exact) {
        printf "libm: %s calls %s\n", file, $NF
        bad++
    }
}
END {
    for (file in seen) files++
    printf "libm: %d calls in %d objects, %d that may round differently\n", calls, files, bad
    exit bad > 0 || calls == 0
}'
