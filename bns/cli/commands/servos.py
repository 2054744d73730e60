"""What `bns servos` was asked for."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable, Mapping

from bns.hardware.clock import RealClock
from bns.hardware.servo_setup import NO_SERVO, PROTOCOLS, Rate, ServoBus, adapter, rates
from bns.hardware.servos.snake_settings import snake_settings


def served(options: argparse.Namespace) -> int:
    """Carry out one of them; 0 if all is fine, else 2."""
    bus = ServoBus(options.port, RealClock(), lambda text: print(f"bns: {text}", file=sys.stderr))
    try:
        return _PARTS[options.part](bus, options)
    finally:
        bus.close()


def scan(bus: ServoBus, options: argparse.Namespace) -> int:
    """Print who answers."""
    found = []
    for servo in bus.scan(_rates(options, options.all_bauds)):
        found.append(servo)
        print(servo, flush=True)
    if bus.untried:
        print(f"not tried: {', '.join(map(str, bus.untried))} baud; this adapter cannot be set to them", flush=True)
    more = "" if options.all_bauds else " (1 Mbaud and new ones; --all-bauds tries others)"
    print(f"{len(found)} ids answer{more}" if found else f"no servo answers{more}; is the supply on, is the cable connected?")
    if found and not any(servo.model for servo in found):
        print(f"no answer is one of a servo: {NO_SERVO}")
    return 0 if found and all(servo.model > 0 for servo in found) else 2


def set_id(bus: ServoBus, options: argparse.Namespace) -> int:
    """Number a servo."""
    print(bus.set_id(options.id, options.old, _rates(options)))
    return 0


def check(bus: ServoBus, options: argparse.Namespace) -> int:
    """Print the findings of the adapter and of each servo."""
    there = list(bus.scan(_rates(options)))
    bad = sum(not servo.model for servo in there) + (not there)
    for servo in there:
        if not servo.model:
            print(f"BAD  {servo}")
            continue
        if options.mend and servo.mute:
            servo = bus.unmuted(servo)  # noqa: PLW2901
            print(f"bns: servo {servo.number}: status_return written", file=sys.stderr)
        if options.mend and (changed := bus.mend(servo)):
            print(f"bns: servo {servo.number}: {', '.join(changed)} written", file=sys.stderr)
        for finding in bus.check(servo):
            bad += not finding.fine
            print(finding)
    for finding in adapter(options.port):
        bad += not finding.fine
        print(finding)
    numbers, chain = {servo.number for servo in there}, set(snake_settings({}).ids)
    who = f"{len(there)} answer: {_ranges(numbers)}"
    if len(numbers) > 1 and numbers < chain:
        print(f"not there: {_ranges(chain - numbers)} (the shipped rig's snake has {_ranges(chain)})")
    print("no servo answers" if not there else f"{bad} to be fixed; {who}" if bad else f"all fine; {who}")
    return 2 if bad else 0


def _ranges(numbers: Iterable[int]) -> str:
    """Ids in words, those in a row together: 1 to 4, 6."""
    runs: list[list[int]] = []
    for number in sorted(set(numbers)):
        if runs and number == runs[-1][1] + 1:
            runs[-1][1] = number
        else:
            runs.append([number, number])
    return "ids " + ", ".join(str(first) if first == last else f"{first} to {last}" for first, last in runs)


def _rates(options: argparse.Namespace, every: bool = False) -> list[Rate]:
    return rates(PROTOCOLS if options.protocol is None else (options.protocol,), every)


_PARTS: Mapping[str, Callable[[ServoBus, argparse.Namespace], int]] = {"scan": scan, "set-id": set_id, "check": check}
