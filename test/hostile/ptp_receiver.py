# SPDX-License-Identifier: MIT
"""Forged PTP messages against a locked time receiver; see ptp_receiver.sh, which makes the network and calls this.

One row an attack: samples a second while it lasts, largest true error in microseconds while it lasts and after it, lines of log and
Delay_Req a second. An attack passes if samples go on, the error stays within its limit, and neither log nor requests flood."""
import ctypes, os, random, signal, socket, struct, subprocess, sys, time

FTCS, SECONDS, FOLDER, OURS, OUR_IF, THEIRS, THEIR_IF = sys.argv[1], float(sys.argv[2]), *sys.argv[3:8]
TRUE, VICTIM, ROGUE = (bytes.fromhex("020000fffe00000%d" % i) for i in (1, 2, 3))
SYNC, DELAY_REQ, FOLLOW_UP, DELAY_RESP, ANNOUNCE = 0, 1, 8, 9, 11


def message(kind, body, sequence, source=TRUE, flags=0, log=0, tlv=b"", sdo=0):
    control = {SYNC: 0, DELAY_REQ: 1, FOLLOW_UP: 2, DELAY_RESP: 3}.get(kind, 5)
    length = 34 + len(body) + len(tlv)
    head = struct.pack("!BBHBBHq4s8sHHBb", sdo << 4 | kind, 0x12, length, 0, 0, flags, 0, bytes(4), source, 1, sequence & 0xFFFF, control, log)
    return head + body + tlv


def stamp(ns):
    return struct.pack("!HII", ns // 10**9 >> 32, ns // 10**9 & 0xFFFFFFFF, ns % 10**9)


def announce(sequence, source=TRUE, priority=128, utc=37, flags=0, log=0):
    body = bytes(10) + struct.pack("!hBBBBHB", utc, 0, priority, 248, 0xFE, 0xFFFF, 128) + source + struct.pack("!HB", 0, 0xA0)
    return message(ANNOUNCE, body, sequence, source, flags, log)


class Wire:
    """The transmitter's side: what it sends and hears goes by here, and forged frames leave with its address."""

    def __init__(self):
        home = os.open("/proc/self/ns/net", os.O_RDONLY)
        there = os.open("/run/netns/" + THEIRS, os.O_RDONLY)
        libc = ctypes.CDLL(None, use_errno=True)
        assert libc.setns(there, 0x40000000) == 0, os.strerror(ctypes.get_errno())
        self.out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("10.77.0.2"))
        self.out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 0)
        self.heard = socket.socket(socket.AF_PACKET, socket.SOCK_DGRAM, socket.htons(3))
        self.heard.bind((THEIR_IF, 3))
        self.heard.setblocking(False)
        assert libc.setns(home, 0x40000000) == 0
        self.sync_id, self.requests, self.sequence, self.kept = 0, 0, 40000, []

    def send(self, data, to="224.0.1.129"):
        self.out.sendto(data, (to, 319 if data[0] & 15 < 8 else 320))

    def next(self):
        self.sequence += 1
        return self.sequence

    def listen(self):
        while True:
            try:
                packet = self.heard.recv(2048)[28:]
            except BlockingIOError:
                return
            if len(packet) < 44:
                continue
            kind, source, sequence = packet[0] & 15, packet[20:28], struct.unpack("!H", packet[30:32])[0]
            if kind == SYNC and source == TRUE and sequence < 40000:
                self.sync_id = sequence
            if kind in (SYNC, FOLLOW_UP) and source == TRUE:
                self.kept = [*self.kept[-200:], (time.monotonic(), packet)]
            self.requests += kind == DELAY_REQ and source == VICTIM


# Each: frames a second, and what one of them is.
def seq_lockout(wire, i):
    wire.send(message(SYNC, stamp(time.time_ns()), wire.sync_id + 12))


def delay_resp_log7(wire, i):
    wire.send(message(DELAY_RESP, stamp(time.time_ns()) + VICTIM + b"\0\1", i, log=7))


def follow_up_information(wire, i):
    tlv = struct.pack("!HH3s3siH", 3, 28, b"\0\x80\xc2", b"\0\0\1", 0, i) + bytes(12) + bytes(4)
    wire.send(message(FOLLOW_UP, stamp(time.time_ns()), wire.next(), tlv=tlv))


def rogue_announces_twice(wire, i):
    if i < 2:
        wire.send(announce(i, ROGUE, priority=0, log=7))


def utc_and_timescale(wire, i):
    wire.send(announce(i, utc=(-32768, 32767, 0, 37)[i % 4], flags=(0x0C, 0x0D, 0x0E, 0x04)[i % 4]))


def unicast_syncs(wire, i):
    wire.send(message(SYNC, stamp(time.time_ns() + 10**7), wire.sync_id + 1), "10.77.0.1")


def jumps(wire, i):
    wire.send(message(SYNC, stamp(time.time_ns() + (i % 2) * 3600 * 10**9), wire.next()))


def odd_identities(wire, i):
    wire.send(announce(i, (bytes(8), b"\xff" * 8)[i % 2], priority=0))


def rogue(wire, i, ahead_ns):
    """A better transmitter by its own word: five of eight frames are its Syncs, and its Announces."""
    now = time.time_ns() + ahead_ns
    if i % 4 == 0:
        wire.send(announce(i, ROGUE, priority=0, log=0))
    else:
        wire.send(message(SYNC, stamp(now), i, ROGUE, log=-3))


def rogue_10s(wire, i):
    rogue(wire, i, 10**10)


START = time.time_ns()


def rogue_1970(wire, i):
    rogue(wire, i, -START)


def syncs_an_hour_ahead(wire, i):
    wire.send(message(SYNC, stamp(time.time_ns() + 3600 * 10**9), wire.sync_id + 1 + i % 3, log=-3))


def replay_3s(wire, i):
    """What the transmitter sent three seconds ago, whole."""
    while wire.kept and wire.kept[0][0] < time.monotonic() - 3:
        wire.send(wire.kept.pop(0)[1])


def early_follow_ups(wire, i):
    wire.send(message(FOLLOW_UP, stamp(time.time_ns() + 300_000), wire.sync_id + 1, flags=0, log=-3))


def corrections(wire, i):
    sync = bytearray(message(SYNC, stamp(time.time_ns()), wire.sync_id + 1, log=-3))
    sync[8:16] = struct.pack("!q", (-1) ** i * 999_000_000 << 16)
    wire.send(bytes(sync))


MIXED = [rogue_10s, syncs_an_hour_ahead, replay_3s, early_follow_ups, corrections, delay_resp_log7, seq_lockout, utc_and_timescale, odd_identities]


def soak(wire, i):
    """Half of each minute, all of these in turn and garbage. The transmitter sends 128 Syncs a second."""
    if time.monotonic() % 60 < 30:
        return
    kind = i % (len(MIXED) + 1)
    if kind == len(MIXED):
        wire.send(os.urandom(random.randrange(1, 200)))
    else:
        MIXED[kind](wire, i // (len(MIXED) + 1))


def size_of(process):
    """Resident KiB, open files."""
    status = open(f"/proc/{process.pid}/status").read()
    return int(status.split("VmRSS:")[1].split()[0]), len(os.listdir(f"/proc/{process.pid}/fd"))


# name: frames a second, what, samples a second at least, microseconds at most, while it lasts
ATTACKS = {
    "seq_lockout": (2, seq_lockout, 1, 300), "delay_resp_log7": (2, delay_resp_log7, 6, 300),
    "follow_up_information": (10, follow_up_information, 6, 300), "rogue_announces_twice": (8, rogue_announces_twice, 0, 300),
    "utc_and_timescale": (5, utc_and_timescale, 6, 300), "unicast_syncs": (8, unicast_syncs, 6, 300),
    "rogue_10s": (10, rogue_10s, 0, 100), "rogue_1970": (10, rogue_1970, 0, 100), "syncs_an_hour_ahead": (10, syncs_an_hour_ahead, 0, 100),
    "replay_3s": (10, replay_3s, 1, 100), "early_follow_ups": (8, early_follow_ups, 1, 450), "corrections": (10, corrections, 0, 100),
    "jumps": (250, jumps, 0, None), "odd_identities": (10, odd_identities, 6, 300),
}
RECOVERY = 20  # Syncs
LONG = {"soak": (20, soak, 1, 100)}  # by name alone


def run(name, wire):
    rate, attack, least, limit = {**ATTACKS, **LONG}[name]
    path = f"{FOLDER}/chrony.sock"
    feed = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    feed.bind(path)
    feed.setblocking(False)
    log_path = f"{FOLDER}/{name}.log"
    inside = ["ip", "netns", "exec"]
    common = ["-S", "--logAnnounceInterval", "0", "--uds_address", "none", "--tx_timestamp_timeout", "50"]
    transmitter = subprocess.Popen(
        [*inside, THEIRS, FTCS, "ptp", "-i", THEIR_IF, "--role", "time-transmitter", "--logSyncInterval", "-7" if name in LONG else "-3", "--clockIdentity",
         "020000.fffe.000001", *common], stdout=subprocess.DEVNULL)
    with open(log_path, "w") as log:
        victim = subprocess.Popen(
            [*inside, OURS, FTCS, "ptp", "-i", OUR_IF, "-s", "--clockIdentity", "020000.fffe.000002", "--logMinDelayReqInterval", "-3",
             "--summary_interval", "2", "--allow-epoch", "--chrony-sock", path, *common], stdout=log, stderr=log)
    samples = []

    def pass_time(until, act=lambda: None):
        while time.monotonic() < until:
            act()
            wire.listen()
            while True:
                try:
                    data = feed.recv(256)
                except BlockingIOError:
                    break
                samples.append((time.monotonic(), struct.unpack("d", data[16:24])[0] * 1e6))
            time.sleep(0.002)

    pass_time(time.monotonic() + 7)
    begin, lines, wire.requests, sent = time.monotonic(), sum(1 for _ in open(log_path)), 0, 0
    if name in LONG:  # the first half minute is part of the start
        pass_time(begin + min(30, SECONDS / 4))
        begin = time.monotonic()
    size = size_of(victim)

    def act():
        nonlocal sent
        while sent <= (time.monotonic() - begin) * rate:
            attack(wire, sent)
            sent += 1

    pass_time(begin + SECONDS, act)
    end, requests, lines = time.monotonic(), wire.requests, sum(1 for _ in open(log_path)) - lines
    pass_time(end + 10)
    alive = victim.poll() is None
    grown = [now - before for now, before in zip(size_of(victim), size)] if alive else [0, 0]
    for process in (victim, transmitter):
        process.send_signal(signal.SIGINT)
    ended = victim.wait(timeout=5)
    transmitter.wait(timeout=5)
    feed.close()
    os.unlink(path)
    during = [abs(error) for at, error in samples if begin <= at < end]
    after = [abs(error) for at, error in samples if at >= end + 7]
    before = [abs(error) for at, error in samples if at < begin]
    worst = max(during, default=0.0)
    # Samples are fed while the clock is locked: the first one with a small error ends the recovery.
    sync_s = 2.0 ** (-7 if name in LONG else -3)
    back = next((at - end for at, error in samples if at >= end and abs(error) <= 100), 99) / sync_s
    good = (alive and ended == 0 and len(before) > 5 and len(during) >= least * SECONDS and (limit is None or worst <= limit)
            and len(after) > 8 and max(after) <= 300 and lines <= 10 * SECONDS + 10 and requests <= 20 * SECONDS
            and back <= RECOVERY and grown[0] <= 1024 and grown[1] <= 0)
    print(f"{'ok    ' if good else 'FAILED'} {name:22} samples/s {len(during) / SECONDS:5.1f}  worst us {worst:9.1f}  after {max(after, default=-1):7.1f}"
          f"  lines/s {lines / SECONDS:5.1f}  Delay_Req/s {requests / SECONDS:5.1f}  exit {ended}  samples before {len(before)}, after {len(after)}"
          f"  grown {grown[0]} KiB, {grown[1]} files  back after {back:.0f} Syncs", flush=True)
    if not good:
        print(open(log_path).read()[-4000:])
    return good


bench = Wire()
good = [run(name, bench) for name in (sys.argv[8:] or ATTACKS)]
sys.exit(0 if all(good) else 1)
