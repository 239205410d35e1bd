#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Compares what pmc showed of our data sets with what the program itself, ptp4l and the set-up say."""
import json
import os
import socket
import subprocess
import sys

folder, interface = sys.argv[1:3]
status = json.load(open(f"{folder}/status.json"))
failures = []


def fields(whose, name):
    """pmc's "name value" lines; the head line under ''."""
    lines = open(f"{folder}/{whose}.{name}").read().splitlines()
    answers = [line for line in lines if "RESPONSE MANAGEMENT" in line]
    check(len(answers) == 1, f"{whose} {name}: {len(answers)} answers: {lines}")
    found = {"": answers[0] if answers else ""}
    for line in lines:
        if line.startswith("\t\t"):
            key, _, value = line.strip().partition(" ")
            found[key] = value.strip()
    return found


def check(holds, text):
    if not holds:
        failures.append(text)


def equal(name, found, wanted):
    for key, value in wanted.items():
        check(found.get(key) == value, f"{name}: {key} is {found.get(key)}, expected {value}")


ours = lambda name: fields("ours", name)
default = ours("DEFAULT_DATA_SET")
identity = default["clockIdentity"]
their_identity = fields("theirs", "DEFAULT_DATA_SET")["clockIdentity"]
equal("DEFAULT", default, {"twoStepFlag": "1", "slaveOnly": "1", "numberPorts": "1", "priority1": "128",
                           "clockClass": "255", "clockAccuracy": "0xfe", "offsetScaledLogVariance": "0xffff",
                           "priority2": "128", "domainNumber": "0"})
check(identity.replace(".", "")[6:10] == "fffe", f"identity {identity} is not made of the interface's address")
for name in ("DEFAULT_DATA_SET", "CURRENT_DATA_SET", "PARENT_DATA_SET", "TIME_PROPERTIES_DATA_SET", "DOMAIN",
             "TIME_STATUS_NP", "USER_DESCRIPTION"):
    check(f"{identity}-0 seq" in ours(name)[""], f"{name} does not come from the clock: {ours(name)['']}")
for name in ("NULL_MANAGEMENT", "CLOCK_DESCRIPTION", "PORT_DATA_SET", "PORT_DATA_SET_NP", "PORT_PROPERTIES_NP",
             "PORT_STATS_NP"):
    check(f"{identity}-1 seq" in ours(name)[""], f"{name} does not come from the port: {ours(name)['']}")

equal("PARENT", ours("PARENT_DATA_SET"),
      {"parentPortIdentity": f"{their_identity}-1", "parentStats": "0",
       "observedParentOffsetScaledLogVariance": "0xffff", "observedParentClockPhaseChangeRate": "0x7fffffff",
       "grandmasterPriority1": "77", "gm.ClockClass": "52", "gm.ClockAccuracy": "0x21",
       "gm.OffsetScaledLogVariance": "0xffff", "grandmasterPriority2": "128", "grandmasterIdentity": their_identity})
check(status["transmitter"] == f"{their_identity}-1" and status["grandmaster"] == their_identity, "status: transmitter")

# Time properties are the transmitter's own, field by field as ptp4l shows them.
equal("TIME_PROPERTIES", ours("TIME_PROPERTIES_DATA_SET"),
      {key: value for key, value in fields("theirs", "TIME_PROPERTIES_DATA_SET").items() if key})

equal("PORT", ours("PORT_DATA_SET"),
      {"portIdentity": f"{identity}-1", "portState": "SLAVE", "peerMeanPathDelay": "0", "announceReceiptTimeout": "3",
       "logSyncInterval": "0", "logMinDelayReqInterval": "-3", "logAnnounceInterval": "1", "delayMechanism": "1"})
check(status["port_state"] == "SLAVE" and status["locked"] is True, "status: not locked")
equal("PORT_PROPERTIES", ours("PORT_PROPERTIES_NP"),
      {"portIdentity": f"{identity}-1", "portState": "SLAVE", "timestamping": "SOFTWARE", "interface": interface})
equal("DOMAIN", ours("DOMAIN"), {"domainNumber": "0"})
equal("CLOCK_DESCRIPTION", ours("CLOCK_DESCRIPTION"),
      {"clockType": "0x8000", "physicalLayerProtocol": "IEEE 802.3",
       "physicalAddress": ":".join(identity.replace(".", "").replace("fffe", "")[i:i + 2] for i in range(0, 12, 2)),
       "profileId": "00:1b:19:00:01:00"})

# Offsets: software stamps over veth, so microseconds; the clock started 1 ms away.
current, time_status = ours("CURRENT_DATA_SET"), ours("TIME_STATUS_NP")
equal("CURRENT", current, {"stepsRemoved": "1"})
for name, value in (("offsetFromMaster", float(current["offsetFromMaster"])),
                    ("master_offset", float(time_status["master_offset"])), ("status", status["offset_ns"])):
    check(abs(value) < 200e3, f"{name} is {value} ns")
delay = float(current["meanPathDelay"])
check(0 < delay < 500e3 and abs(delay - status["path_delay_ns"]) < 0.5 * delay,
      f"meanPathDelay {delay} ns, status {status['path_delay_ns']} ns")
equal("TIME_STATUS", time_status, {"gmPresent": "true", "gmIdentity": their_identity})
# The steered clock follows the transmitter's, which is this machine's.
theirs_now = float(os.stat(f"{folder}/ours.TIME_STATUS_NP").st_mtime)
check(abs(int(time_status["ingress_time"]) * 1e-9 - theirs_now) < 2, f"ingress_time {time_status['ingress_time']}")

stats, messages = ours("PORT_STATS_NP"), status["messages"]
for name, counter in (("rx_Sync", "sync_received"), ("rx_Follow_Up", "follow_up_received"),
                      ("rx_Announce", "announce_received"), ("rx_Delay_Resp", "delay_resp_received"),
                      ("tx_Delay_Req", "delay_req_sent")):
    shown, counted = int(stats[name]), messages[counter]
    check(shown > 3 and shown <= counted <= shown + 30, f"{name} is {shown}, status {counter} {counted}")
check(int(stats["tx_Sync"]) == 0, "a receiver sends no Sync")

# Every answer once more, by hand, for tshark; and what is no request.
client = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
client.bind(f"{folder}/hand.uds")
client.settimeout(1)
for rubbish in (b"", b"ftcs", b"\x0d\x02", os.urandom(64), b"\x0d\x12\xff\xff" + bytes(60)):
    client.sendto(rubbish, f"{folder}/ftcs.uds")
header = bytes.fromhex("0d020036" + "00" * 16 + "00" * 8 + "1234" + "0007" + "047f" + "ff" * 10 + "00000000" + "00010002")
answers = []
for identifier in (0x0000, 0x0001, 0x0002, 0x2000, 0x2001, 0x2002, 0x2003, 0x2004, 0x2007, 0xC000, 0xC002, 0xC004,
                   0xC005, 0x3333):
    client.sendto(header + identifier.to_bytes(2, "big"), f"{folder}/ftcs.uds")
    answers.append(client.recv(2000))
with open(f"{folder}/dump", "w") as dump:
    for answer in answers:
        dump.write("000000 " + " ".join(f"{octet:02x}" for octet in answer) + "\n")
subprocess.run(["text2pcap", "-q", "-u", "320,320", f"{folder}/dump", f"{folder}/answers.pcap"], check=True,
               stderr=subprocess.DEVNULL)


def tshark(*what):
    return subprocess.run(["tshark", "-r", f"{folder}/answers.pcap", *what], check=True, capture_output=True,
                          text=True).stdout.splitlines()


decoded = len(tshark("-Y", "ptp.v2.versionptp == 2"))
# linuxptp's own identifiers are unknown to Wireshark, which is no fault of the message.
malformed = len(tshark("-Y", "_ws.malformed"))
check(decoded == len(answers), f"tshark decodes {decoded} of {len(answers)} answers")
check(malformed == 0, f"tshark calls {malformed} answers malformed")
names = tshark("-T", "fields", "-e", "ptp.v2.mm.managementId")
check(len([name for name in names if name]) >= 13, f"tshark reads management ids {names}")

client.sendto(b"ftcs status", f"{folder}/ftcs.uds")
counted = json.loads(client.recv(65536))["management"]
check(counted["malformed"] >= 5, f"malformed requests are counted: {counted}")
check(counted["answered"] >= 26 and counted["refused"] >= 2, f"requests are counted: {counted}")

for failure in failures:
    print("FAILED:", failure)
print(f"{len(answers)} answers, {decoded} decoded by tshark, {malformed} malformed; management {counted}")
sys.exit(bool(failures))
