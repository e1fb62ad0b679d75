#!/bin/sh
# tests/firmware/linux/install.sh - what make install puts somewhere is whole: the
# program runs there and finds its files, programs of others build against the
# library and run, in C++ too, which finds every function of it, the man page and the completion say what the program says, and
# make uninstall leaves nothing.
#
# Takes long.  Gains nothing from sanitizers.
set -eu
slew=${SLEW:-build/slew}
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
to=$dir/to

fail()
{
    echo "install.sh: $*"
    exit 1
}

built() # built TARGET [NAME=VALUE...]: without more processes than this test has
{
    MAKEFLAGS='' "${MAKE:-make}" --no-print-directory "$@" CC="${CC:-gcc}" \
        VARIANT="${VARIANT:-}" SAN="${SAN:-}" >"$dir/log" 2>&1 ||
        fail "make $1: $(cat "$dir/log")"
}

# The library is found, or it is said what to do: by a stand-in for ldconfig, as the
# machine's own cache is none of a test's.
finds() # finds WHAT ldconfig-status ldconfig-p: what is said, empty for nothing
{
    printf '#!/bin/sh\n[ "${1:-}" != -p ] || { echo "%s"; exit; }\nexit %s\n' \
        "$3" "$2" >"$dir/ldconfig"
    chmod +x "$dir/ldconfig"
    built install PREFIX="$dir/here" LDCONFIG="$dir/ldconfig"
    [ -n "$1" ] || [ ! -s "$dir/log" ] || fail "install said: $(cat "$dir/log")"
    [ -z "$1" ] || grep -qF -- "$1" "$dir/log" || fail "install said: $(cat "$dir/log")"
}
finds "ldconfig could not run: as root" 1 ""
finds "no program looks for libslew.so in $dir/here/lib: as root, echo" 0 ""
finds "" 0 "	libslew.so.0.1 => $dir/here/lib/libslew.so.0.1"
built uninstall PREFIX="$dir/here" LDCONFIG="$dir/ldconfig"
[ ! -e "$dir/here" ] || fail "left: $(find "$dir/here")"

built install DESTDIR="$to" PREFIX=/opt/slew
grep -q "where it is used: ldconfig" "$dir/log" || fail "install said: $(cat "$dir/log")"
mv "$to" "$dir/moved" # an installed copy stands anywhere
at=$dir/moved/opt/slew
[ "$("$at/bin/slew" --version)" = "slew $(sed -n \
    's/.*SLEW_VERSION "\(.*\)"/\1/p' firmware/library/version.h)" ] ||
    fail "--version"
for example in dolly modbus; do
    (cd "$at/share/doc/slew/examples" && "$at/bin/slew" check "$example") \
        >"$dir/out" 2>&1 || fail "check $example: $(cat "$dir/out")"
done

# The library, as others link it.
export PKG_CONFIG_PATH="$at/lib/pkgconfig" PKG_CONFIG_SYSROOT_DIR="$dir/moved"
cp -r "$at/share/doc/slew/examples/c" "$dir/c"
MAKEFLAGS='' make -s -C "$dir/c" CC="${CC:-gcc}" CFLAGS="-std=c11 -Wall -Wextra \
    -Werror ${SAN:+-fsanitize=$SAN}" >"$dir/out" 2>&1 ||
    fail "examples/c: $(cat "$dir/out")"
said() # said PROGRAM TEXT: one of its lines
{
    LD_LIBRARY_PATH=$at/lib "$dir/c/$1" >"$dir/out" || fail "$1: status $?"
    grep -qxF -- "$2" "$dir/out" || fail "$1 said: $(cat "$dir/out")"
}
said keyed " 1.00 s   250.000 mm   141.667 mm/s"
said keyed " 3.00 s   100.000 mm     0.000 mm/s"
said fastest "axis 0: 0.895000 s, 7 phases, ends at 300"
said fastest "axis 1: 0.895000 s, 5 phases, ends at -20"
said chase " 865.600 ms  at 100 with    0.000 /s"
said drive "can0 603#4000100000000000"
grep -q "^node 3: offline, " "$dir/out" || fail "drive said: $(tail -1 "$dir/out")"

# Every function that the library offers, by C++ and by its headers alone.
# Parts of fixed.h are none that anybody includes.
cxx=${CXX:-c++}
(cd "$at/include/slew" && find . -name '*.h' ! -name 'fixed_*') | sed 's|^\./||' |
    sort >"$dir/public"
{
    sed 's/.*/#include "&"/' "$dir/public"
    echo '#include <cstdio>'
    echo 'int main() { const void *const offered[] = {'
    sed -n 's|^    \(.*\);$|    reinterpret_cast<const void *>(\&\1),|p' \
        firmware/library/slew.map | grep -v '&\*'
    echo '}; motion_otg_move m{}; motion_otg_plan p; motion_otg_make(&m, &p, nullptr);'
    echo 'std::printf("%d\\n", (int)(sizeof offered / sizeof *offered)); }'
} >"$dir/c/all.cpp"
(cd "$dir/c" && "$cxx" -std=c++17 -Wall -Wextra -Werror ${SAN:+-fsanitize=$SAN} all.cpp \
    $(pkg-config --cflags --libs slew) -o all) >"$dir/out" 2>&1 ||
    fail "C++: $(head -20 "$dir/out")"
said all "$(grep -c '^    [a-z]' firmware/library/slew.map)"
for header in $(cat "$dir/public"); do
    echo "#include \"$header\"" | "$cxx" -std=c++17 -Wall -Wextra -Werror \
        -I"$at/include/slew" -fsyntax-only -x c++ - >"$dir/out" 2>&1 ||
        fail "$header in C++: $(head -5 "$dir/out")"
done

# Nothing is linked but what the public headers declare.
MAKEFLAGS='' make -s symbols CC="${CC:-gcc}" VARIANT="${VARIANT:-}" SAN="${SAN:-}" \
    TO="$dir/map" >"$dir/log" 2>&1 || fail "make symbols: $(cat "$dir/log")"
diff firmware/library/slew.map "$dir/map" ||
    fail "slew.map is not what the headers say: make symbols"

# The man page and the completion, beside the help.
"$slew" --help | awk '/^  [a-z]/ { print $1 }' >"$dir/commands"
sed -n 's/^\.It Cm //p' "$at/share/man/man1/slew.1" >"$dir/man"
diff "$dir/commands" "$dir/man" || fail "slew.1 has other commands"
cat >"$dir/complete" <<'COMPLETE'
. "$1"
COMP_WORDS=("$2" ru) COMP_CWORD=1; _slew; echo "${COMPREPLY[@]}"
COMP_WORDS=("$2" run --over) COMP_CWORD=2; _slew; echo "${COMPREPLY[@]}"
COMPLETE
[ "$(bash "$dir/complete" "$at/share/bash-completion/completions/slew" \
    "$at/bin/slew" | tr '\n' ' ')" = "run --override " ] || fail "completion"

mv "$dir/moved" "$to"
built uninstall DESTDIR="$to" PREFIX=/opt/slew
[ ! -e "$to" ] || fail "left: $(find "$to")"
