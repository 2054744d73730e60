"""A Mega 2560 in simavr with its real boot loader and the sketch built with the real Arduino core, in front of servos.

Nothing moves on by itself: the board runs only while somebody waits on its `clock`, whose time is that of its own oscillator. So
every time measured here is the board's, whatever else this computer does.
"""

import os
import select
import shutil
import struct
import subprocess
import tty
from pathlib import Path

from bns.hardware.emulators.devices.bus import Bus
from bns.hardware.emulators.devices.terminal import put_through

HERE = Path(__file__).parent
CORE = Path("/usr/share/arduino/hardware/arduino/avr")
BOOT_LOADER = CORE / "bootloaders" / "stk500v2" / "stk500boot_v2_mega2560.hex"
HZ = 16_000_000
_SLICE_S = 0.01
_WRITTEN_S = 0.25  # by the computer's clock; a question takes so long at most from one end of the terminal to the other
_USED = ("wiring.c", "wiring_digital.c", "hooks.c", "main.cpp", "Print.cpp", "abi.cpp", "new.cpp")
_USED_SERIAL = ("HardwareSerial.cpp", "HardwareSerial0.cpp", "HardwareSerial1.cpp")
# As `platform.txt` of the core has them for a Mega 2560, without link-time optimisation; warnings are errors in the sketch only.
_FLAGS = ["-mmcu=atmega2560", "-DF_CPU=16000000L", "-DARDUINO=10819", "-DARDUINO_AVR_MEGA2560", "-DARDUINO_ARCH_AVR"]
_FLAGS += ["-Os", "-g", "-ffunction-sections", "-fdata-sections"]
_CPP = ["-std=gnu++11", "-fno-exceptions", "-fno-threadsafe-statics"]
_PACKAGES = "gcc-avr, avr-libc, arduino-core-avr, libsimavr-dev, libelf-dev"


def lacking():
    """Why there can be no such board here; empty if there can."""
    tools = [name for name in ("avr-gcc", "avr-g++", "avr-objcopy", "gcc") if shutil.which(name) is None]
    files = [str(path) for path in (BOOT_LOADER, Path("/usr/include/simavr/sim_avr.h")) if not path.exists()]
    return f"needs {', '.join(tools + files)} (Debian: {_PACKAGES})" if tools or files else ""


def build(sketch, folder):
    """Compile the sketch, the boot loader's image and the simulator's frame; paths of all three."""
    includes = [f"-I{CORE / 'cores' / 'arduino'}", f"-I{CORE / 'variants' / 'mega'}"]
    objects = [str(folder / "sketch.o")]
    strict = ["-Wall", "-Wextra", "-Werror", "-x", "c++"]
    _call("avr-g++", *_FLAGS, *_CPP, *includes, *strict, "-c", str(sketch), "-o", objects[0])
    for name in _USED + _USED_SERIAL:
        source, objects = CORE / "cores" / "arduino" / name, [*objects, str(folder / f"{name}.o")]
        compiler = ["avr-gcc", *_FLAGS] if source.suffix == ".c" else ["avr-g++", *_FLAGS, *_CPP]
        _call(*compiler, *includes, "-w", "-c", str(source), "-o", objects[-1])
    program, boot, board = folder / "sketch.elf", folder / "boot.bin", folder / "board"
    _call("avr-gcc", "-mmcu=atmega2560", "-Os", "-Wl,--gc-sections", *objects, "-o", str(program), "-lm")
    _call("avr-objcopy", "-I", "ihex", "-O", "binary", str(BOOT_LOADER), str(boot))
    strict = ["-std=gnu11", "-O2", "-Wall", "-Wextra", "-Werror", "-I/usr/include/simavr"]
    _call("gcc", *strict, str(HERE / "board.c"), "-o", str(board), "-lsimavr", "-lelf")
    return board, program, boot


def _call(*command):
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


class Board:
    """`path` is its serial port; opening a pseudo-terminal resets nothing, so `reset` is called instead.

    `bus.heard(now_s, byte)` tells what comes back, and how many seconds after the byte. `faults` of the half-duplex bus, one
    byte a kind, as in `board.c`; `answered`: status packets that servos have sent.
    """

    def __init__(self, built, bus):
        self.bus, self.cycle, self.faults, self.answered = bus, 0, 0, 0
        self._process = subprocess.Popen(
            [str(path) for path in built], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        )
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)

    @property
    def now_s(self):
        return self.cycle / HZ

    def run(self, seconds):
        """Let it run so long, or until it has said something."""
        try:
            data = os.read(self._master, 4096)
            self._ask(b"H" + struct.pack("<H", len(data)) + data)
        except BlockingIOError:
            pass
        self._ask(b"R" + struct.pack("<Q", round(seconds * HZ)))
        while (kind := self._process.stdout.read(1)) == b"B":
            self._on_the_bus(*struct.unpack("<QB", self._process.stdout.read(9)))
        assert kind == b"D", f"the simulator ended with {self._process.wait()}"
        self.cycle, self.faults, count = struct.unpack("<QIH", self._process.stdout.read(14))
        put_through(self._master, self._slave, self._process.stdout.read(count))

    def await_question(self):
        """Until what was written is at the board's end: the kernel takes its time for that, the board's time does not wait."""
        select.select([self._master], [], [], _WRITTEN_S)

    def run_until(self, seconds):
        """Let it run so long, whatever it says."""
        end = self.cycle + round(seconds * HZ)
        while self.cycle < end:
            self.run((end - self.cycle) / HZ)

    def stray(self, byte):
        """A byte gets onto the bus when the board next turns it round."""
        self._ask(b"S" + bytes([byte]))

    def reset(self):
        """As through DTR."""
        self._ask(b"X")

    def close(self):
        self._process.stdin.close()
        self._process.wait(timeout=10)
        self._process.stdout.close()
        os.close(self._master)
        os.close(self._slave)

    def _ask(self, question):
        self._process.stdin.write(question)
        self._process.stdin.flush()

    def _on_the_bus(self, cycle, byte):
        later_s, answer = self.bus.heard(cycle / HZ, byte)
        self.answered += bool(answer)
        self._ask(struct.pack("<IH", max(round(later_s * HZ), 0), len(answer)) + answer)


class EmulatedBus(Bus):
    """The emulated servos of this repository, on the board's time."""

    def heard(self, now_s, byte):
        self._clock.sleep(now_s - self._clock.now_s())
        before_s = self._clock.now_s()
        answer = self.receive(bytes([byte]))
        return self._clock.now_s() - before_s - len(answer) * 10e-6, answer


class BoardClock:
    """The board's time, for the driver; the board runs while the driver waits."""

    longest_write_s = 20.0

    def __init__(self, board):
        self._board = board

    def now_s(self):
        return self._board.now_s

    def sleep(self, seconds):
        self._board.run_until(seconds)

    def waited(self, seconds):
        pass

    def arrived(self):
        pass

    def in_vain(self, seconds):
        end_s, asked = self.now_s() + seconds, False

        def passed():
            nonlocal asked
            if not asked:
                self._board.await_question()
            asked = True
            self._board.run(_SLICE_S)
            return self.now_s() > end_s

        return passed
