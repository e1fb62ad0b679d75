#!/bin/sh
# python-canopen, python-can and can-utils against ours: this machine's kernel
# may have no CAN, so they meet in another one.  Reads no clock.  Takes long.
exec tests/vm/boot.sh "SLEW=$SLEW PEERS=$PEERS tests/peers/canopen.sh"
