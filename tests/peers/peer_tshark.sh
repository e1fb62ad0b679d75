#!/bin/sh
# tests/peers/peer_tshark.sh - Wireshark's dissectors on our recordings, RTU and
# TCP: every frame is one of Modbus, every CRC is right, and they see the
# positions that our telemetry has.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT

fail()
{
    echo "  $*"
    exit 1
}

see() # see FILE ARGUMENT...
{
    file=$1
    shift
    tshark -r "$file" \
        -o 'uat:user_dlts:"User 0 (DLT=147)","mbrtu","0","","0",""' \
        -o mbrtu.crc_verification:TRUE "$@" 2>"$dir/err" ||
        fail "$(cat "$dir/err")"
}

count() # count FILE FILTER
{
    see "$1" -Y "$2" | wc -l
}

"$SLEW" run examples/modbus --modbus-log "$dir/rtu.pcap" >"$dir/out" 2>&1 ||
    fail "$(cat "$dir/out")"
all=$(see "$dir/rtu.pcap" | wc -l)
[ "$all" -gt 1000 ] || fail "only $all frames"
[ "$(count "$dir/rtu.pcap" 'modbus')" -eq "$all" ] || fail "not all are Modbus"
[ "$(count "$dir/rtu.pcap" 'mbrtu.crc16.status == 0 || _ws.malformed')" -eq 0 ] ||
    fail "wrong CRCs or malformed frames"
moves=$(count "$dir/rtu.pcap" 'modbus.func_code == 16')
# the last position read: -38 deg of 500000 counts per revolution is -52778,
# 0xFFFF and 0x31D6
last=$(see "$dir/rtu.pcap" -Y 'modbus.func_code == 3 && frame.len == 9' \
    -T fields -e modbus.regval_uint16 | tail -n 1)
[ "$last" = "65535,12758" ] || fail "the last position is $last"
echo "  RTU: $all frames, all with the right CRC, $moves of function 16," \
    "the last position is ours"

"$SLEW" run tests/peers/tcp.yaml tests/peers/lift.yaml \
    --modbus-log "$dir/tcp.pcap" >"$dir/out" 2>&1 || fail "$(cat "$dir/out")"
all=$(see "$dir/tcp.pcap" | wc -l)
[ "$all" -gt 1000 ] || fail "only $all frames on TCP"
[ "$(count "$dir/tcp.pcap" 'mbtcp && modbus')" -eq "$all" ] ||
    fail "not all are Modbus TCP"
[ "$(count "$dir/tcp.pcap" '_ws.malformed')" -eq 0 ] || fail "malformed frames"
asked=$(count "$dir/tcp.pcap" 'tcp.dstport == 502')
answered=$(count "$dir/tcp.pcap" 'modbus.response_time')
[ "$asked" -eq "$answered" ] || fail "$asked asked, $answered answered"
echo "  TCP: $all frames, every request paired with its answer"
