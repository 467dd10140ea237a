"""Words, bits and codes of IEEE Std C37.118.2-2011; each says its table."""

from enum import IntEnum, IntFlag

SYNC_BYTE = 0xAA
"""First byte of every frame (Table 2, SYNC)."""

VERSIONS = (1, 2)
"""Low four bits of SYNC (Table 2): 1 for frames known since 2005, 2 for those added in 2011."""

TIME_BASE = 1_000_000
"""Ticks a second of FRACSEC in the frames that tieline makes: microseconds (Table 9)."""

ABSENT = -0x8000
"""Value of a 16-bit word for which there is no measurement (6.3)."""

IDCODES = range(1, 0xFFFF)
"""Allowed stream numbers; 0 and 65535 are reserved (Table 2, IDCODE)."""


class FrameType(IntEnum):
    """Bits 6-4 of SYNC (Table 2)."""

    DATA = 0
    HEADER = 1
    CONFIG_1 = 2
    CONFIG_2 = 3
    COMMAND = 4
    CONFIG_3 = 5


class Command(IntEnum):
    """CMD word of a command frame (Table 15)."""

    TURN_OFF = 1
    TURN_ON = 2
    SEND_HEADER = 3
    SEND_CONFIG_1 = 4
    SEND_CONFIG_2 = 5
    SEND_CONFIG_3 = 6
    EXTENDED = 8


class FormatBit(IntFlag):
    """FORMAT word of a configuration (Table 9); a clear bit means 16-bit integer or rectangular."""

    POLAR = 0x0001
    FLOAT_PHASORS = 0x0002
    FLOAT_ANALOGS = 0x0004
    FLOAT_FREQ = 0x0008


class StatBit(IntFlag):
    """STAT word of a data frame (Table 6); time quality and trigger reason fill the low bits."""

    DATA_ERROR = 0xC000
    UNSYNCHRONISED = 0x2000
    SORTED_BY_ARRIVAL = 0x1000
    TRIGGER = 0x0800
    CONFIG_CHANGE = 0x0400
    MODIFIED = 0x0200


class DataError(IntEnum):
    """Bits 15-14 of STAT (Table 6): anything but GOOD means that the values must not be used."""

    GOOD = 0
    PMU_ERROR_NO_INFORMATION = 1
    TEST_MODE_OR_ABSENT = 2
    PMU_ERROR = 3


class TimeQualityBit(IntFlag):
    """First byte of FRACSEC (Table 3); CODE is 0 for a locked clock and 0xF for a failed one."""

    LEAP_SECOND_DELETED = 0x40
    LEAP_SECOND_OCCURRED = 0x20
    LEAP_SECOND_PENDING = 0x10
    CODE = 0x0F
