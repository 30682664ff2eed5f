"""Compiled kernels for pictures, beside pygame and beside what they should be."""

import numpy as np
import pytest

from railenv.kernels.loader import load_pictures

RED = np.uint32(0x0000FF)


def bytes_of(pixels):
    """Return red, green and blue of pixels, shape (height, width, 3)."""
    return np.ascontiguousarray(pixels).view(np.uint8).reshape(*pixels.shape, 4)[..., :3]


def random_pixels(*shape):
    return np.random.default_rng(0).integers(0, 2**32, shape, dtype=np.uint32)


def white(*shape):
    return np.full(shape, 0xFFFFFFFF, dtype=np.uint32)


def share_of_red(pixels):
    """Return how much of each pixel of a white picture a red line covers."""
    return 1.0 - bytes_of(pixels)[..., 1] / 255.0


def test_half_the_size_is_what_pygame_makes():
    pygame = pytest.importorskip("pygame")
    large = random_pixels(40, 60)
    page = np.zeros((30, 50), dtype=np.uint32)
    load_pictures().halve(large, page[5:25, 7:37])
    surface = pygame.image.frombuffer(large, (60, 40), "RGBX")
    wanted = pygame.surfarray.array3d(pygame.transform.smoothscale(surface, (30, 20)))
    np.testing.assert_array_equal(bytes_of(page[5:25, 7:37]), wanted.transpose(1, 0, 2))
    page[5:25, 7:37] = 0
    assert not page.any()  # nothing else was written


def test_packed_pixels_are_their_first_three_bytes():
    pixels = random_pixels(24)
    packed = np.zeros(18, dtype=np.uint32)
    load_pictures().pack(pixels, packed)
    np.testing.assert_array_equal(packed.view(np.uint8), bytes_of(pixels).ravel())


@pytest.mark.parametrize("pieces", [1, 7, 200])
def test_a_line_is_as_thick_in_one_piece_as_in_many(pieces):
    pixels = white(20, 60)
    x = np.linspace(10.0, 50.0, pieces + 1)
    load_pictures().stroke(pixels, x, np.full_like(x, 9.25), 1.0, RED)
    covered = share_of_red(pixels)[:, 20:40]
    wanted = np.zeros(20)
    wanted[[8, 9, 10]] = 0.25, 1.0, 0.75
    np.testing.assert_allclose(covered, wanted[:, None] * np.ones(20), atol=0.003)


def test_a_line_crosses_steeply_without_gaps():
    pixels = white(60, 20)
    load_pictures().stroke(pixels, np.array([9.0, 10.0, 11.0]), np.array([5.0, 55.0, 5.0]), 1.0, RED)
    covered = share_of_red(pixels)
    assert (covered[6:55].max(axis=1) > 0.95).all()
    assert (covered[:4] == 0.0).all()
    assert (covered[58:] == 0.0).all()


def test_what_lies_outside_the_picture_is_left_out():
    whole, part = white(40, 60), white(20, 30)
    x, y = np.array([-20.0, 10.0, 80.0]), np.array([-9.0, 12.0, 90.0])
    load_pictures().stroke(whole, x, y, 1.0, RED)
    load_pictures().stroke(part, x, y, 1.0, RED)
    np.testing.assert_array_equal(part, whole[:20, :30])
    assert (part != 0xFFFFFFFF).any()
    for shift in (-500.0, 500.0):
        outside = white(20, 30)
        load_pictures().stroke(outside, x + shift, y, 1.0, RED)
        assert (outside == 0xFFFFFFFF).all()
