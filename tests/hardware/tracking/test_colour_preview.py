"""Hues found in pictures that Pillow drew, with colours that the standard library knows the hues of."""

import colorsys
import io
import re

import cv2
import numpy as np
import pytest
from PIL import Image, ImageDraw

from bns.cli.main import main
from bns.errors import HardwareError
from bns.hardware.emulators.watchers import emulated_lens
from bns.hardware.tracking.camera import Frame
from bns.hardware.tracking.colour import ColourDetector, Markers
from bns.hardware.tracking.colour_preview import blobs, drawn, markers_of_any_colour, report, tuned

ORANGE, TEAL = 14, 95
"""Hues as OpenCV counts them: neither is in the ranges that the tracker begins with."""
MARKERS = Markers(diameter_m=0.06, height_m=0.05)
PLACES = {"yellow": (-0.31, 0.12), "green": (0.28, -0.2)}
LENS = emulated_lens(0.6, 3.0, 0.02)
FINER = 4


def rgb(hue, saturation=0.85, value=0.9):
    return tuple(round(255 * share) for share in colorsys.hsv_to_rgb(hue / 180, saturation, value))


def filmed(hues=(ORANGE, TEAL), quality=80):
    """A brownish floor with a red stripe, a blue box, and two discs; through JPEG."""
    width, height = LENS.size
    image = Image.new("RGB", (FINER * width, FINER * height), (128, 122, 112))
    draw = ImageDraw.Draw(image)
    draw.rectangle([FINER * v for v in (40, 30, 300, 44)], fill=rgb(176))
    draw.rectangle([FINER * v for v in (560, 300, 640, 380)], fill=rgb(115))
    around = np.linspace(0.0, 2 * np.pi, 60)
    for (x_m, y_m), hue in zip(PLACES.values(), hues, strict=True):
        radius_m = MARKERS.diameter_m / 2
        edge = np.column_stack([x_m + radius_m * np.cos(around), y_m + radius_m * np.sin(around), np.full(60, MARKERS.height_m)])
        draw.polygon([tuple(FINER * (point + 0.5)) for point in LENS.px(edge)], fill=rgb(hue))
    stored = io.BytesIO()
    image.resize((width, height), Image.Resampling.BOX).save(stored, "JPEG", quality=quality)
    return cv2.imdecode(np.frombuffer(stored.getvalue(), np.uint8), cv2.IMREAD_COLOR)


def test_markers_of_other_colours_are_seen_with_the_hues_that_are_found():
    picture, before = filmed(), ColourDetector(LENS, MARKERS)
    assert before.find(Frame(0.0, picture)) is None
    found = markers_of_any_colour(picture, before)
    assert len(found) == 2  # neither the stripe nor the box
    fits = tuned(found, MARKERS)
    assert fits.yellow[0] <= ORANGE <= fits.yellow[1] <= ORANGE + 10
    assert fits.green[0] <= TEAL <= fits.green[1] <= TEAL + 10
    seen = ColourDetector(LENS, fits).find(Frame(0.0, picture))
    for name, place in PLACES.items():
        np.testing.assert_allclose(seen.points[name], place, atol=0.003)


@pytest.mark.parametrize(("hues", "swapped"), [((30, 62), False), ((62, 30), True)])
def test_which_is_which_is_told_by_the_ranges_there_are(hues, swapped):
    fits = tuned(markers_of_any_colour(filmed(hues), ColourDetector(LENS, MARKERS)), MARKERS)
    seen = ColourDetector(LENS, fits).find(Frame(0.0, filmed(hues)))
    place = PLACES["green" if swapped else "yellow"]
    np.testing.assert_allclose(seen.points["yellow"], place, atol=0.003)


def test_colours_too_close_and_markers_that_are_missing_are_named():
    detector = ColourDetector(LENS, MARKERS)
    with pytest.raises(HardwareError, match="marker colours are too close"):
        tuned(markers_of_any_colour(filmed((28, 34)), detector), MARKERS)
    one = markers_of_any_colour(filmed(), detector)[:1]
    with pytest.raises(HardwareError, match="1 round blobs of a marker's size are in the picture, and two are needed"):
        tuned(one, MARKERS)
    assert "0 round blobs" in report(np.full_like(filmed(), 90), detector, MARKERS)


def test_the_report_says_what_each_range_holds():
    markers = Markers(0.06, 0.05, yellow=(ORANGE - 6, ORANGE + 6), green=(105, 125))
    said = report(filmed(), ColourDetector(LENS, markers), markers)
    assert "yellow, hues 8 to 20: 1 of 1 blobs is a marker" in said
    assert re.search(r"green, hues 105 to 125: 0 of 1 blobs is a marker\n  no marker at pixel \(600, 340\): \d", said)
    assert re.search(r"for the rig's tracker:\n  yellow: \[\d+, \d+\]\n  green: \[\d+, \d+\]$", said)


def test_the_drawing_shows_markers_and_what_is_within_the_ranges():
    markers = Markers(0.06, 0.05, yellow=(ORANGE - 6, ORANGE + 6), green=(TEAL - 6, TEAL + 6))
    detector, picture = ColourDetector(LENS, markers), filmed()
    shown = drawn(picture, detector)
    width, height = LENS.size
    assert shown.shape == (height + 60, 2 * width, 3)
    (blob,) = blobs(picture, detector, markers.yellow)
    x, y = (round(float(v)) for v in blob.outline.reshape(-1, 2).mean(axis=0))
    assert (shown[y, width + x] == picture[y, x]).all()
    assert shown[340, width + 600].max() < picture[340, 600].max() / 3  # the box is in no range
    assert (shown[:height, :width] != picture).any()


def test_the_command_writes_a_picture_and_tries_other_hues(tmp_path, capsys):
    file = tmp_path / "seen.png"
    asked = ["calibrate", "--colours", str(file), "--robot", "snake", "--emulated"]
    assert main(asked) == 0
    said = capsys.readouterr().out
    assert "yellow, hues 20 to 38: 1 of 1 blobs is a marker" in said
    assert cv2.imread(str(file)).shape == (492, 1536, 3)
    assert main([*asked, "--yellow", "100", "120"]) == 0
    assert "yellow, hues 100 to 120: 0 of 0 blobs is a marker" in capsys.readouterr().out
    assert main(["calibrate", "--colours", str(file), "--emulated"]) == 2
    assert "the tracker of the rig is wii; colours are looked at by kind: colour" in capsys.readouterr().err
    assert main([*asked[:1], "--colours", str(tmp_path / "seen.jpg"), "--emulated"]) == 2
