"""The emulated line: what it sends is there when it says so, and nobody waits for what has been read already."""

import os
import threading
import time

import pytest

from bns.hardware.emulators.devices.terminal import PseudoTerminal, put_through

from .outlive import Echo


@pytest.fixture
def line(tmp_path):
    with PseudoTerminal(Echo(), tmp_path, "line") as opened:
        yield opened


def test_what_was_sent_is_there(line):
    near = os.open(line.path, os.O_RDONLY | os.O_NOCTTY | os.O_NONBLOCK)
    for _ in range(50):
        line.send(b"0123456789")
        assert os.read(near, 100) == b"0123456789"
    os.close(near)


def test_a_reader_that_takes_it_meanwhile_holds_nobody_up(line):
    near, got = os.open(line.path, os.O_RDONLY | os.O_NOCTTY), []

    def read():
        while sum(map(len, got)) < 20 * 1000:
            got.append(os.read(near, 7))

    reader = threading.Thread(target=read)
    reader.start()
    began_s = time.monotonic()
    for _ in range(20):
        line.send(b"x" * 1000)
    reader.join(60)
    assert time.monotonic() - began_s < 15  # a second each would be more
    os.close(near)


def test_a_line_can_be_cut_while_bytes_are_on_their_way(line, monkeypatch):
    under_way, go_on = threading.Event(), threading.Event()

    def slow(*way):
        under_way.set()
        go_on.wait(60)
        put_through(*way)

    monkeypatch.setattr("bns.hardware.emulators.devices.terminal.put_through", slow)
    sending = threading.Thread(target=line.send, args=(b"x",))
    sending.start()
    under_way.wait(60)
    cutting = threading.Thread(target=line.cut)
    cutting.start()
    cutting.join(60)
    assert not cutting.is_alive()
    go_on.set()
    sending.join(60)
