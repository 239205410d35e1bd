# SPDX-License-Identifier: MIT
# Sourced by what takes packages of Debian's that are unpacked beside the system.

# Where they come from: $FTCS_DEBIAN_MIRROR, or else what the system's own apt takes its release from. Prints nothing where there is none.
debian_mirror() {
  if [ -n "${FTCS_DEBIAN_MIRROR:-}" ]; then
    echo "$FTCS_DEBIAN_MIRROR"
    return
  fi
  local codename
  codename=$(sed -n 's/^VERSION_CODENAME=//p' /etc/os-release 2> /dev/null)
  # Only says what an update would ask for: it needs no rights, no network and no earlier update.
  [ -z "$codename" ] || apt-get update --print-uris 2> /dev/null | sed -n "s#^'\(.*\)/dists/$codename/main/.*#\1#p" | head -n 1
}

no_mirror="no mirror is known: neither \$FTCS_DEBIAN_MIRROR nor apt's own configuration names one"
