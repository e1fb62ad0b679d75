#!/bin/sh
# firmware/studio/wasm/sources.sh DIRECTORY - libyaml's and cJSON's sources, as
# Debian has them, into DIRECTORY/libyaml and DIRECTORY/cjson: Debian has no
# binaries of these for wasm32.  No more than apt is asked; its lists stand in
# DIRECTORY too, so that nothing of the system changes.
set -eu
mkdir -p "$1/lists/partial" "$1/cache"
cd "$1"
[ -e done ] && exit 0

# The sources of what the system has its packages from: Debian's alone, as the
# others rarely have any.
cat /etc/apt/sources.list 2>/dev/null |
    sed -n '/debian/s/^deb /deb-src /p' >debian.list || :
awk 'BEGIN { RS = ""; ORS = "\n\n" } /debian/' \
    /etc/apt/sources.list.d/*.sources 2>/dev/null |
    sed 's/^Types:.*/Types: deb-src/' >debian.sources || :
apt()
{
    apt-get -qq -o Dir::Etc::SourceList=/dev/null \
        -o Dir::Etc::SourceParts="$PWD" -o Dir::State::Lists="$PWD/lists" \
        -o Dir::Cache="$PWD/cache" -o APT::Sandbox::User=root "$@" </dev/null
}
apt update
apt source --download-only libyaml cjson >/dev/null
for name in libyaml cjson; do
    rm -rf $name
    mkdir $name
    tar -xf $name*.orig.tar.* -C $name --strip-components=1
    # What Debian mends, so that both programs read the same.
    rm -rf patches
    mkdir patches
    tar -xf $name*.debian.tar.* -C patches
    if [ -e patches/debian/patches/series ]; then
        sed '/^ *#/d;/^ *$/d' patches/debian/patches/series |
            while read -r patch _; do
                patch -d $name -p1 -s <"patches/debian/patches/$patch"
            done
    fi
done
rm -rf lists cache patches debian.list debian.sources
touch done
