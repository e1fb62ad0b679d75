# tests/peers/device.sh - to be sourced: our simulated servos, $rtu is their
# terminal, $tcp their port; they end with the script.
dir=$(mktemp -d)
"$SLEW" sim tests/peers/rig.yaml >"$dir/out" 2>&1 &
device=$!
trap 'kill $device 2>/dev/null; rm -rf "$dir"' EXIT
for i in $(seq 300); do
    grep -q "interrupt" "$dir/out" && break
    sleep 0.1
done
rtu=$(sed -n 's/^rtu on terminal \([^:]*\): .*/\1/p' "$dir/out")
tcp=$(sed -n 's/^tcp on 127.0.0.1 port \([0-9]*\): .*/\1/p' "$dir/out")
[ -c "$rtu" ] && [ -n "$tcp" ] || { cat "$dir/out"; exit 1; }
