"""My robot over UDP: speeds that are acknowledged, a stop that is confirmed by the wheels, and a rig that is not there."""

from __future__ import annotations

import math
import select
import socket
from pathlib import Path

from bns.errors import HardwareError
from bns.hardware.safety import StopsAtTheEnd
from bns.hardware.stop import Stop
from bns.hardware.tracking.kinds import open_tracker
from bns.hardware.wheels.wheel_drive import RobotLostError
from bns.hardware.wheels.wheeled import WheeledPlatform, Wheels
from my_robot.emulator import EmulatedRig
from my_robot.protocol import FASTEST_MM_S, Message, decoded

RIG = Path(__file__).with_name("rig.yaml")
WHEELS = Wheels(units_per_m_s=1000.0, units_per_s=1000.0, wheelbase_m=0.24, heartbeat_looks=2)
ATTEMPTS, REPLY_S, STILL_M_S, FLAT_V = 4, 0.15, 0.005, 9.5


class MyDriver:
    """Implements `bns.hardware.wheels.wheeled.WheelDriver`."""

    def __init__(self, address, clock, journal, reply_s=REPLY_S):
        host, _, port = address.rpartition(":")
        if not port.isdecimal():
            raise HardwareError(f"the port of my robot's rig is {address!r}; write its address, as 192.168.4.1:4210.")
        self._clock, self._journal, self._reply_s = clock, journal, reply_s
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.connect((host, int(port)))
        self._number, self.retries = 0, 0

    def close(self):
        """Give the link free."""
        self._socket.close()

    def set_speed_m_s(self, left, right):
        """Set speeds; what the robot says that it has set. It goes on with them only while it hears from us."""
        wanted = [max(-FASTEST_MM_S, min(FASTEST_MM_S, 1000.0 * v)) for v in (left, right)]
        answer = self._ask("drive", *wanted)
        return answer.left / 1000.0, answer.right / 1000.0

    def speed_m_s(self):
        """What the wheels do."""
        answer = self._ask("speed")
        return answer.left / 1000.0, answer.right / 1000.0

    def encoders_m(self):
        """How far the wheels have come."""
        answer = self._ask("ways")
        return answer.left / 1000.0, answer.right / 1000.0

    def battery_v(self):
        """Voltage."""
        return self._ask("battery").left / 1000.0

    def stop(self, patience_s=5.0):
        """Stop until two readings in a row say that the wheels stand still; never raises."""
        began_s, acknowledged_s, still, problem = self._clock.now_s(), None, 0, ""
        while still < 2 and self._clock.now_s() - began_s <= patience_s:
            try:
                self._ask("drive", 0.0, 0.0)
                acknowledged_s = acknowledged_s or self._clock.now_s() - began_s
                still, problem = (still + 1 if max(map(abs, self.speed_m_s())) < STILL_M_S else 0), "the wheels still turn"
            except RobotLostError as error:
                problem = str(error)
            self._clock.sleep(0.02)
        stop = Stop(still == 2, self._clock.now_s() - began_s, acknowledged_s, "" if still == 2 else problem)
        self._journal.note("stop", confirmed=stop.confirmed, seconds=stop.seconds, problem=stop.problem)
        return stop

    def _ask(self, word, left=0.0, right=0.0):
        """The robot's answer; RobotLostError when none comes, however often it is asked."""
        for attempt in range(ATTEMPTS):
            self.retries += attempt > 0
            self._number += 1
            question = Message(self._number, word, left, right)
            self._journal.note("sent", data=question.encoded().decode())
            answer = self._once(question)
            if answer is not None:
                self._journal.note("received", data=answer.encoded().decode())
                return answer
        raise RobotLostError(f"no answer to {word!r} at {self._reply_s:g} s each; asked {ATTEMPTS} times")

    def _once(self, question):
        in_vain = self._clock.in_vain(self._reply_s)
        try:
            self._socket.send(question.encoded())
            while True:
                while select.select([self._socket], [], [], 0.005)[0]:
                    answer = decoded(self._socket.recv(256))
                    if answer is not None and answer.number == question.number:
                        return answer
                if in_vain():
                    break
        except OSError:  # the network says that nobody is there
            pass
        self._clock.waited(self._reply_s)
        return None


def open_platform(rig, clock, journal, stopping):
    """Reach the robot, and make sure before anything else that it stands still, is charged and is seen."""
    reply_s = rig.driver.get("reply_s", REPLY_S)
    if set(rig.driver) - {"reply_s"} or not isinstance(reply_s, int | float) or not 0 < reply_s < math.inf:
        raise HardwareError(f"the driver of my robot's rig is {dict(rig.driver)}; it may say reply_s, a number of seconds.")
    driver = MyDriver(rig.port, clock, journal, reply_s)
    try:
        with StopsAtTheEnd(driver.stop):
            _check_battery(driver.battery_v())
        tracker = open_tracker(rig.tracker, clock)
    except RobotLostError as error:
        driver.close()
        raise HardwareError(f"my robot does not answer at {rig.port}: {error}. Is it on, is its network yours?") from error
    except BaseException:
        driver.close()
        raise
    return WheeledPlatform(driver, tracker, WHEELS, rig, clock, journal, stopping)


def _check_battery(volts):
    if volts < FLAT_V:
        raise HardwareError(f"the battery is at {volts:.1f} V; charge it to {FLAT_V:g} V or more first.")


def emulate(rig, folder, clock, plan, seed):
    """An emulated robot on this computer's network, under an emulated tracker."""
    return EmulatedRig(rig, folder, clock, plan, seed)
