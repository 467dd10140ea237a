"""The check word finds what a line does to a frame."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tieline.c37118.crc import crc_of, crc_of_rows


def crc_bit_by_bit(data: bytes) -> int:
    """Return the CRC by division of polynomials, one bit at a time."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1) ^ 0x11021 if crc & 0x8000 else crc << 1
    return crc


def test_the_check_value_of_the_catalogue_is_met() -> None:
    """Otherwise no other receiver accepts our frames.

    0x29B1 is the check value of CRC-16/IBM-3740 (also called CRC-CCITT-FALSE) in the catalogue of
    parametrised CRC algorithms by G. Cook.
    """
    assert crc_of(b"123456789") == 0x29B1


def test_no_bytes_leave_the_starting_value() -> None:
    """Otherwise an empty body is checked by other rules than a full one."""
    assert crc_of(b"") == 0xFFFF


@given(st.binary(max_size=80))
def test_the_table_gives_the_remainder_of_the_division(data: bytes) -> None:
    """Otherwise the table has a wrong entry that rare bytes meet."""
    assert crc_of(data) == crc_bit_by_bit(data)


@given(st.lists(st.binary(min_size=32, max_size=32), max_size=20))
def test_rows_are_checked_one_by_one(rows: list[bytes]) -> None:
    """Otherwise the frames of different PMUs leak into each other's check words."""
    table = np.frombuffer(b"".join(rows), np.uint8).reshape(len(rows), 32)
    assert crc_of_rows(table).tolist() == [crc_of(row) for row in rows]
