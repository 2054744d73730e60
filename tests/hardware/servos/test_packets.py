"""Packets of both protocols: the makers' SDK and the examples of their manual judge our bytes."""

import numpy as np
import pytest
from dynamixel_sdk import COMM_SUCCESS, COMM_TX_FAIL, GroupSyncWrite, PacketHandler
from hypothesis import given
from hypothesis import strategies as st

from bns.hardware.clock import EmulatedClock
from bns.hardware.emulators.devices.bus import Bus
from bns.hardware.emulators.devices.servo import Servo
from bns.hardware.emulators.faults import Faults
from bns.hardware.servos.packets import PING, READ, STATUS, SYNC_WRITE, WIRES, WRITE, Packet
from bns.hardware.servos.x430_table import XM430_W210

TWO = WIRES[2]
SET_UP = {"baud_rate": 3}


class Ear:
    """A port of the SDK's that hears what is written, and reads what was given to it."""

    is_using = False

    def __init__(self, answer=b""):
        self.written, self._answer = b"", answer

    def clearPort(self):  # noqa: N802  # the SDK's name
        pass

    def writePort(self, packet):  # noqa: N802  # the SDK's name
        self.written += bytes(packet)
        return len(packet)

    def readPort(self, length):  # noqa: N802  # the SDK's name
        found, self._answer = self._answer[:length], self._answer[length:]
        return found

    def setPacketTimeout(self, length):  # noqa: N802  # the SDK's name
        pass

    def isPacketTimeout(self):  # noqa: N802  # the SDK's name
        return not self._answer


def written(call):
    ear = Ear()
    call(ear)
    return ear.written


def by_sdk(protocol):
    """What the SDK writes for instructions, and the same in our bytes."""
    sdk, wire = PacketHandler(float(protocol)), WIRES[protocol]

    def word(value):
        return value.to_bytes(wire.word, "little")

    def together(port):
        group = GroupSyncWrite(port, sdk, 116 // protocol, 4)
        for number, goal in ((1, 150), (2, 170)):
            group.addParam(number, list(goal.to_bytes(4, "little")))
        group.txPacket()

    both = b"\x01\x96\0\0\0\x02\xaa\0\0\0"
    return {
        "ping": (written(lambda p: sdk.ping(p, 7)), wire.instruction(7, PING)),
        "read": (written(lambda p: sdk.readTx(p, 9, 132, 4)), wire.instruction(9, READ, word(132) + word(4))),
        "write": (
            written(lambda p: sdk.write2ByteTxOnly(p, 254, 30, 513)),
            wire.instruction(254, WRITE, word(30) + b"\x01\x02"),
        ),
        "sync": (written(together), wire.instruction(254, SYNC_WRITE, word(116 // protocol) + word(4) + both)),
    }


@pytest.mark.parametrize("protocol", [1, 2])
@pytest.mark.parametrize("which", ["ping", "read", "write", "sync"])
def test_our_packets_are_the_sdk_s(protocol, which):
    theirs, ours = by_sdk(protocol)[which]
    assert ours == theirs
    assert WIRES[protocol].taken(b"\x00\x12" + theirs + b"rest")[1] == b"rest"


@given(st.binary(max_size=40) | st.lists(st.sampled_from([b"\xff", b"\xfd", b"\0"]), max_size=40).map(b"".join))
def test_stuffing_is_the_sdk_s_and_is_taken_out_again(data):
    """`addStuffing` returns the stuffed packet; the SDK's own `txPacket` overlooks that, so what it sends is never stuffed."""
    sdk, plain = PacketHandler(2.0), bytes([STATUS]) + data
    length = len(plain) + 2
    packet = [0xFF, 0xFF, 0xFD, 0, 5, length & 255, length >> 8, *plain, 0, 0]
    stuffed = sdk.addStuffing(packet)
    stuffed = stuffed[: stuffed[5] + 256 * stuffed[6] + 7]
    crc = sdk.updateCRC(0, stuffed, len(stuffed) - 2)
    ours = TWO.instruction(5, STATUS, data)
    assert ours == bytes(stuffed[:-2]) + crc.to_bytes(2, "little")
    assert TWO.taken(ours) == (Packet(5, STATUS, data), b"")


@given(st.binary(min_size=1, max_size=30), st.integers(0, 252), st.integers(0, 255))
def test_the_sdk_reads_what_a_servo_answers(data, number, error):
    found, result, bits = PacketHandler(2.0).readTxRx(Ear(TWO.status(number, error, data)), number, 0, len(data))
    assert (bytes(found), result, bits) == (data, COMM_SUCCESS, error)


@given(st.binary(min_size=1, max_size=12), st.data())
def test_the_sdk_notices_every_byte_that_is_another_one(data, drawn):
    answer = bytearray(TWO.status(3, 0, data))
    place = drawn.draw(st.integers(4, len(answer) - 1))
    answer[place] ^= drawn.draw(st.integers(1, 255))
    _, result, _ = PacketHandler(2.0).readTxRx(Ear(bytes(answer)), 3, 0, len(data))
    assert result not in {COMM_SUCCESS, COMM_TX_FAIL}


def xm430(clock, number, **registers):
    return Servo(number, clock, Faults(), None, XM430_W210, **SET_UP, **registers)


@pytest.mark.parametrize(
    ("sent", "back"),
    [  # the e-manual, Protocol 2.0: ID 1 and 2 are XM430-W210 with firmware 38; 1 is at 166, 2 at 2079
        ("FF FF FD 00 01 03 00 01 19 4E", "FF FF FD 00 01 07 00 55 00 06 04 26 65 5D"),
        (
            "FF FF FD 00 FE 03 00 01 31 42",
            "FF FF FD 00 01 07 00 55 00 06 04 26 65 5D FF FF FD 00 02 07 00 55 00 06 04 26 6F 6D",
        ),
        ("FF FF FD 00 01 07 00 02 84 00 04 00 1D 15", "FF FF FD 00 01 08 00 55 00 A6 00 00 00 8C C0"),
        ("FF FF FD 00 01 09 00 03 74 00 00 02 00 00 CA 89", "FF FF FD 00 01 04 00 55 00 A1 0C"),
        ("FF FF FD 00 01 09 00 04 68 00 C8 00 00 00 AE 8E", "FF FF FD 00 01 04 00 55 00 A1 0C"),
        ("FF FF FD 00 01 03 00 08 2F 4E", "FF FF FD 00 01 04 00 55 00 A1 0C"),
        ("FF FF FD 00 FE 11 00 83 74 00 04 00 01 96 00 00 00 02 AA 00 00 00 82 87", ""),
        ("FF FF 01 02 01 FB", ""),  # protocol 1
        ("FF FF FD 00 03 03 00 01", ""),  # nobody's, and not whole
    ],
)
def test_packets_of_the_manual(sent, back):
    clock = EmulatedClock(np.inf)
    servos = [xm430(clock, 1, firmware=38, present_position=166), xm430(clock, 2, firmware=38, present_position=2079)]
    assert Bus(servos, clock).receive(bytes.fromhex(sent)).hex(" ").upper() == back
    if "83 74" in sent:
        assert [servo.get("goal_position") for servo in servos] == [150, 170]


def asked(servo, clock, kind, parameters, good=True):
    packet = bytearray(TWO.instruction(1, kind, bytes(parameters)))
    packet[-1] ^= not good
    found, _ = TWO.taken(Bus([servo], clock).receive(bytes(packet)))
    return found.parameters[0]


def test_what_is_refused_is_refused_as_the_manual_says():
    clock = EmulatedClock(np.inf)
    servo = xm430(clock, 1)
    goal, limit = [116, 0], [48, 0]
    assert asked(servo, clock, 0x77, []) == 2
    assert asked(servo, clock, PING, [], good=False) == 3
    assert asked(servo, clock, WRITE, [*goal, 0, 32, 0, 0]) == 4  # beyond what there is
    assert asked(servo, clock, WRITE, [*goal, 0, 2]) == 5
    assert asked(servo, clock, WRITE, [*limit, 0, 1, 0, 0]) == 0
    assert asked(servo, clock, WRITE, [*goal, 0, 2, 0, 0]) == 6  # beyond the limit just set
    assert asked(servo, clock, WRITE, [132, 0, 0, 2, 0, 0]) == 7  # read only
    assert asked(servo, clock, READ, [66, 0, 1, 0]) == 7  # nothing there
    assert asked(servo, clock, WRITE, [64, 0, 1]) == 0
    assert asked(servo, clock, WRITE, [*limit, 0, 2, 0, 0]) == 7  # locked while the torque is on


def test_a_header_that_leads_nowhere_is_passed_over_wherever_it_ends():
    wire = WIRES[1]
    whole, short = wire.instruction(3, WRITE, b"\x20"), b"\xff\xff\x03\x00"
    for cut in range(len(whole)):
        assert wire.taken(whole[:cut])[0] is None
    assert wire.taken(whole) == (Packet(3, WRITE, b"\x20"), b"")
    assert wire.taken(short) == (None, b"\x00")
    assert wire.taken(short + whole) == (Packet(3, WRITE, b"\x20"), b"")


@pytest.mark.parametrize("protocol", [1, 2])
@pytest.mark.parametrize("stray", range(9))
def test_a_packet_that_comes_in_two_pieces_behind_stray_bytes_is_put_together(protocol, stray):
    wire = WIRES[protocol]
    whole = wire.instruction(3, WRITE, b"\x20\x01")
    for cut in range(len(whole)):
        packet, kept = wire.taken(bytes(stray) + whole[:cut])
        assert packet is None
        assert wire.taken(kept + whole[cut:] + b"next") == (Packet(3, WRITE, b"\x20\x01"), b"next")


@pytest.mark.timeout(20)  # that it is found twice in the same place would be looked for without end
@pytest.mark.parametrize("before", [0, 1, 5])
def test_who_begins_to_listen_inside_a_packet_passes_over_the_stuffed_headers_in_it(before):
    """Of a packet whose beginning was missed; what follows is whole."""
    missed = TWO.instruction(2, WRITE, b"\xff\xff\xfd" * 2)[8 - before :]
    assert missed[before:].startswith(b"\xff\xff\xfd\xfd\xff\xff\xfd\xfd")
    assert TWO.taken(missed) == (None, missed[-3:])
    assert TWO.taken(missed + TWO.instruction(3, WRITE, b"\x20") + b"x") == (Packet(3, WRITE, b"\x20"), b"x")


@pytest.mark.parametrize("protocol", [1, 2])
def test_an_answer_is_whole_only_behind_its_header_and_with_all_of_its_bytes(protocol):
    wire = WIRES[protocol]
    answer = wire.status(3, 0, bytes(range(8)))
    assert wire.seems_whole(answer)
    for cut in range(6 if protocol == 1 else 11, len(answer)):
        assert not wire.seems_whole(answer[:cut]), cut
    for at in (0, 1):
        assert not wire.seems_whole(answer[:at] + b"\x00" + answer[at + 1 :])


def test_an_answer_of_more_bytes_than_one_byte_can_count_is_whole_with_all_of_them():
    """Protocol 2.0: the low byte of the length first; 256 data bytes are 260 with instruction, error and CRC."""
    answer = TWO.status(3, 0, bytes(256))
    assert answer[5:7] == b"\x04\x01"
    assert TWO.seems_whole(answer)
    assert not TWO.seems_whole(answer[:-1])
    assert not TWO.seems_whole(answer[: answer[5] + 7])


@pytest.mark.parametrize("off", [-1, 1])
def test_a_checksum_that_is_lower_or_higher_is_noticed(off):
    clean = WIRES[1].status(3, 0, b"\x05")
    packet, left = WIRES[1].taken(clean[:-1] + bytes([clean[-1] + off]))
    assert (packet.good, left) == (False, b"")
    assert WIRES[1].taken(clean)[0].good
