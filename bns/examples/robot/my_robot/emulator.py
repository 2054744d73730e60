"""My robot at the other end of its link: messages, wheels with the physics of world.yaml, a watchdog; on the emulated clock."""

from __future__ import annotations

import socket
import threading
from dataclasses import replace

from bns.engine.philox import Key
from bns.hardware.emulators.body import SPEED_OVER_S, DifferentialBody
from bns.hardware.tracking.kinds import emulated
from bns.physics.model import load_model
from my_robot.protocol import FASTEST_MM_S, WATCHDOG_S, Message, decoded
from my_robot.robot import ROBOT

_TRIP_S = 0.01


class EmulatedRobot:
    """Answers datagrams in a thread until it is closed; `address` is where."""

    def __init__(self, body, clock, faults):
        self.body, self._clock, self._faults = body, clock, faults
        self._heard_s, self._ways_m, self._counted_s = clock.now_s(), [0.0, 0.0], clock.now_s()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.settimeout(0.1)
        self.address = "{}:{}".format(*self._socket.getsockname())
        self._lock, self._open = threading.Lock(), True
        clock.listeners.append(self._watchdog)
        self._thread = threading.Thread(target=self._serve, name="emulated my-robot", daemon=True)
        self._thread.start()

    def close(self):
        """Switch it off."""
        self._clock.listeners.remove(self._watchdog)
        self._open = False
        self._thread.join(timeout=5)
        self._socket.close()

    def _watchdog(self, now_s):
        """Time goes on; a robot that hears nothing stands still."""
        if now_s - self._heard_s > WATCHDOG_S and self._lock.acquire(blocking=False):
            try:
                self._count(now_s)
                self.body.order(0.0, 0.0, now_s)
            finally:
                self._lock.release()

    def _serve(self):
        while self._open:
            try:
                data, who = self._socket.recvfrom(256)
            except TimeoutError:
                continue
            question = decoded(data)
            lost = self._faults.strikes("lost-request", self._clock.now_s())
            if question is None or lost:
                self._clock.fell_silent()
                continue
            self._clock.sleep(_TRIP_S / 2)  # as long there as back
            with self._lock:
                answer = self._answer(question)
            self._clock.sleep(_TRIP_S / 2)
            if self._faults.strikes("lost-reply", self._clock.now_s()):
                self._clock.fell_silent()
            else:
                self._socket.sendto(answer.encoded(), who)

    def _answer(self, question):
        now_s = self._heard_s = self._clock.now_s()
        self._count(now_s)
        if question.word == "drive":
            left, right = (max(-FASTEST_MM_S, min(FASTEST_MM_S, round(v))) for v in (question.left, question.right))
            self.body.order(left / 1000.0, right / 1000.0, now_s)
            return Message(question.number, "ok", left, right)
        found = {
            "speed": [1000.0 * v for v in self.body.wheel_speeds_m_s(now_s)],
            "ways": [1000.0 * m for m in self._ways_m],
            "battery": [11100.0, 0.0],
        }.get(question.word, [0.0, 0.0])
        return Message(question.number, question.word, *found)

    def _count(self, now_s):
        """The encoders go on."""
        steps = max(1, round((now_s - self._counted_s) / 0.02))
        width_s = (now_s - self._counted_s) / steps
        for step in range(steps):
            speeds = self.body.wheel_speeds_m_s(self._counted_s + (step + 0.5) * width_s + SPEED_OVER_S / 2)
            self._ways_m = [m + v * width_s for m, v in zip(self._ways_m, speeds, strict=True)]
        self._counted_s = now_s


class EmulatedRig:
    """Implements `bns.hardware.platform.Emulation`."""

    def __init__(self, rig, folder, clock, plan, seed):
        self._clock = clock
        start = tuple(float(v) for v in ROBOT.start_pose()[0])
        self.body = DifferentialBody(load_model(ROBOT.world_model), Key.of_run(seed, 0, ROBOT.name, "emulated"), start)
        self.robot = EmulatedRobot(self.body, clock, plan.of(ROBOT.name))
        tracker, self._watcher = emulated(rig.tracker, folder, self.body.seen, clock, plan.of("tracker"), seed)
        self.rig = replace(rig, port=self.robot.address, tracker=tracker)

    def put_down(self, pose):
        """Place the robot."""
        self.body.put_down(tuple(float(v) for v in pose), self._clock.now_s())

    def unstable_between(self, begin_s, end_s):
        """Never: it stands on two wheels."""
        return False

    def close(self):
        """Take it away."""
        self.robot.close()
        self._watcher.close()
