"""An address at which a camera should be, and which accepts a connection and sends nothing."""

import socket

import pytest

from bns.errors import HardwareError
from bns.hardware.tracking import camera


def test_a_stream_that_sends_nothing_is_given_up_and_named(clock, monkeypatch):
    monkeypatch.setattr(camera, "_STREAM_MS", 300)  # as it is, it is 10 s
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"http://127.0.0.1:{server.getsockname()[1]}/video"
        with pytest.raises(HardwareError, match=f"the address {address} gives no stream: nothing answers there within 0.3 s"):
            camera.StreamCamera(address, clock)
