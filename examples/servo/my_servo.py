# SPDX-License-Identifier: MIT
"""A servo of your own in Python: plain frequency tracking, paper eq. (18).

    ftcs compare --servo ./my_servo.py --servo adaptive
"""
from ctypes import POINTER, CFUNCTYPE, Structure, c_char_p, c_double, c_int32, c_int64, c_uint32, c_void_p
from itertools import count
from math import isnan


class Time(Structure):
    _fields_ = [("ns", c_int64), ("fraction_ns", c_double)]

    def since(self, then):
        return (self.ns - then[0]) + (self.fraction_ns - then[1])


class Observation(Structure):
    _fields_ = [("direction", c_int32), ("reserved", c_int32), ("reference", Time), ("local", Time),
                ("free_running", Time), ("now_local", Time), ("now_free_running", Time),
                ("path_delay_ns", c_double), ("offset_ns", c_double)]


class Command(Structure):
    _fields_ = [("correction_rate_ppb", c_double), ("correction_time_ns", c_double),
                ("tracking_rate_ppb", c_double), ("step_ns", c_double)]


class Functions(Structure):
    _fields_ = [("abi", c_uint32), ("name", c_char_p), ("create", CFUNCTYPE(c_void_p, c_void_p)),
                ("destroy", CFUNCTYPE(None, c_void_p)), ("reset", CFUNCTYPE(None, c_void_p)),
                ("update", CFUNCTYPE(c_int32, c_void_p, POINTER(Observation), POINTER(Command))),
                ("believe", c_void_p)]


servos = {}  # instance -> the last message: reference, free running
numbers = count(1)


def create(setup):
    instance = next(numbers)
    servos[instance] = None
    return instance


def update(instance, seen, command):
    seen, command = seen[0], command[0]
    if isnan(seen.offset_ns):  # backward, or no path delay yet
        return 0
    last, servos[instance] = servos[instance], [(t.ns, t.fraction_ns) for t in (seen.reference, seen.free_running)]
    if last is None:
        return 0
    interval = seen.reference.since(last[0])
    ratio = interval / seen.free_running.since(last[1])
    command.tracking_rate_ppb = (ratio - 1.0) * 1e9
    command.correction_rate_ppb = (ratio * (1.0 - seen.offset_ns / interval) - 1.0) * 1e9
    command.correction_time_ns = interval
    return 1


def ftcs_servo_entry(abi, address):
    global table  # its callbacks live as long as it does
    if abi != 1:
        return 1
    kinds = dict(Functions._fields_)
    table = Functions.from_address(address)
    table.__init__(
        1, b"my-servo-python", kinds["create"](create), kinds["destroy"](servos.pop),
        kinds["reset"](lambda instance: servos.update({instance: None})), kinds["update"](update))
    return 0
