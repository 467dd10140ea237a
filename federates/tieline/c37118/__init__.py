"""Synchrophasor frames of IEEE Std C37.118.2-2011: bytes against frozen dataclasses."""

from tieline.c37118.command import CommandFrame, HeaderFrame
from tieline.c37118.config import (
    AnalogChannel,
    ConfigFrame,
    DigitalWord,
    PhasorChannel,
    PmuConfig,
)
from tieline.c37118.constants import (
    TIME_BASE,
    Command,
    DataError,
    FormatBit,
    FrameType,
    StatBit,
    TimeQualityBit,
)
from tieline.c37118.data import DataFrame, PmuData
from tieline.c37118.prefix import Prefix

__all__ = [
    "TIME_BASE",
    "AnalogChannel",
    "Command",
    "CommandFrame",
    "ConfigFrame",
    "DataError",
    "DataFrame",
    "DigitalWord",
    "FormatBit",
    "FrameType",
    "HeaderFrame",
    "PhasorChannel",
    "PmuConfig",
    "PmuData",
    "Prefix",
    "StatBit",
    "TimeQualityBit",
]
