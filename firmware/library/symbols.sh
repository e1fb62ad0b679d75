#!/bin/sh
# firmware/library/symbols.sh VERSION LIBRARY HEADER... - the version script of
# libslew.so: what the library defines and one of the headers declares.
set -eu
version=$1 library=$2
shift 2
echo "/* firmware/library/slew.map - what libslew.so offers; make symbols writes it. */"
echo "SLEW_$version {"
echo "global:"
"${CC:-cc}" -w -fpreprocessed -dD -E -P "$@" |
    grep -oE '[a-z][a-z0-9_]+ *\(|^extern .*' |
    sed 's/^extern .*[ *]\([a-z0-9_]*\)\(\[.*\)*;.*/\1/; s/ *(//' | sort -u >"$library.named"
nm -g --defined-only "$library" 2>/dev/null |
    awk '$2 ~ /[TDRB]/ { print $3 }' | sort -u | comm -12 - "$library.named" |
    sed 's/.*/    &;/'
rm -f "$library.named"
echo "local:"
echo "    *;"
echo "};"
