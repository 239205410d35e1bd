#!/bin/sh
# SPDX-License-Identifier: MIT
# own_network.sh COMMAND...: in a network of its own, of which only loopback is up: the ports of a test are then nobody else's, neither
# those of the test beside it nor those that the kernel gives to whoever connects. Without the right to make one (root has it) it
# runs in the host's network; the tests take ports of their process there, all below those that the kernel gives.
if command -v ip > /dev/null && unshare --net ip link set lo up 2> /dev/null; then
  # shellcheck disable=SC2016
  exec unshare --net sh -c 'ip link set lo up && exec "$@"' sh "$@"
fi
exec "$@"
