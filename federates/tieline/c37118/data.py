"""Data frames (6.3): the measurements of one instant, laid out as their configuration says."""

import cmath
import math
from dataclasses import dataclass

from tieline.c37118.config import ConfigFrame, PhasorChannel, PmuConfig
from tieline.c37118.constants import ABSENT, DataError, FormatBit, FrameType
from tieline.c37118.prefix import Prefix, unwrap, wrap
from tieline.c37118.words import WordReader, pack_words
from tieline.errors import FrameError

_ANGLE_BITS_PER_RAD = 10_000
_MILLIHERTZ = 1000
_ROCOF_BITS = 100


@dataclass(frozen=True)
class PmuData:
    """Fields 6 to 11 of a data frame (Tables 5 and 6); NaN where there is no measurement.

    Attributes:
        stat: STAT word; see `StatBit`.
        phasors: V or A, as RMS values with their angle at the time tag.
        f_hz: frequency. As 16 bits it is coded as the deviation from nominal in mHz.
        rocof_hz_s: rate of change of frequency. As 16 bits it is coded in Hz/s times 100.
        analogs: values in their user's unit, not scaled.
        digitals: words of 16 states.
    """

    stat: int
    phasors: tuple[complex, ...]
    f_hz: float
    rocof_hz_s: float
    analogs: tuple[float, ...] = ()
    digitals: tuple[int, ...] = ()

    @property
    def error(self) -> DataError:
        """What STAT says about the values."""
        return DataError(self.stat >> 14)

    def to_bytes(self, config: PmuConfig) -> bytes:
        """Return the words that `config` asks for.

        Raises:
            FrameError: the number of channels differs, or a value does not fit its word.
        """
        given = (len(self.phasors), len(self.analogs), len(self.digitals))
        asked = (len(config.phasors), len(config.analogs), len(config.digitals))
        if given != asked:
            raise FrameError(
                f"'{config.station}' has {asked} phasors, analogs and digitals (got {given})"
            )
        phasors = zip(self.phasors, config.phasors, strict=True)
        analog_code = "f" if FormatBit.FLOAT_ANALOGS in config.format else "h"
        analogs = self.analogs if analog_code == "f" else [_whole(value) for value in self.analogs]
        return b"".join(
            (
                pack_words("H", [self.stat], "STAT"),
                *(_phasor_to_bytes(phasor, channel, config.format) for phasor, channel in phasors),
                self._frequency_to_bytes(config),
                pack_words(analog_code, analogs, "ANALOG"),
                pack_words("H", self.digitals, "DIGITAL"),
            )
        )

    @classmethod
    def take(cls, words: WordReader, config: PmuConfig) -> "PmuData":
        """Return the values whose words come next, laid out as `config` says.

        Raises:
            FrameError: the words end before the last value.
        """
        stat = words.integer("H")
        phasors = tuple(_take_phasor(words, channel, config.format) for channel in config.phasors)
        if FormatBit.FLOAT_FREQ in config.format:
            f_hz, rocof_hz_s = words.numbers("f", 2)
        else:
            freq, dfreq = (_number(word) for word in words.integers("h", 2))
            f_hz, rocof_hz_s = config.f0_hz + freq / _MILLIHERTZ, dfreq / _ROCOF_BITS
        analog_code = "f" if FormatBit.FLOAT_ANALOGS in config.format else "h"
        analogs = tuple(float(value) for value in words.numbers(analog_code, len(config.analogs)))
        digitals = words.integers("H", len(config.digitals))
        return cls(stat, phasors, f_hz, rocof_hz_s, analogs, digitals)

    def _frequency_to_bytes(self, config: PmuConfig) -> bytes:
        if FormatBit.FLOAT_FREQ in config.format:
            return pack_words("f", (self.f_hz, self.rocof_hz_s), "FREQ and DFREQ")
        freq = _word((self.f_hz - config.f0_hz) * _MILLIHERTZ)
        return pack_words("h", (freq, _word(self.rocof_hz_s * _ROCOF_BITS)), "FREQ and DFREQ")


@dataclass(frozen=True)
class DataFrame:
    """A data frame: prefix, and the values of each PMU of the stream."""

    prefix: Prefix
    pmus: tuple[PmuData, ...]

    def to_bytes(self, config: ConfigFrame) -> bytes:
        """Return the frame, laid out as `config` says.

        Raises:
            FrameError: the configuration is another stream's, or a value does not fit its word.
        """
        _check_stream(self.prefix.idcode, config)
        if len(self.pmus) != len(config.pmus):
            raise FrameError(
                f"stream {self.prefix.idcode} has {len(config.pmus)} PMUs (got {len(self.pmus)})"
            )
        pairs = zip(self.pmus, config.pmus, strict=True)
        body = b"".join(data.to_bytes(pmu) for data, pmu in pairs)
        return wrap(FrameType.DATA, self.prefix, body)

    @classmethod
    def from_bytes(cls, data: bytes, config: ConfigFrame) -> "DataFrame":
        """Return the frame that the bytes hold.

        Raises:
            FrameError: they are no sound data frame, or the configuration is another stream's.
        """
        prefix, body = unwrap(FrameType.DATA, data)
        _check_stream(prefix.idcode, config)
        words = WordReader(body)
        pmus = tuple(PmuData.take(words, pmu) for pmu in config.pmus)
        words.finish()
        return cls(prefix, pmus)


def _check_stream(idcode: int, config: ConfigFrame) -> None:
    if idcode != config.prefix.idcode:
        raise FrameError(
            f"IDCODE {idcode} is unknown: the configuration describes stream {config.prefix.idcode}"
        )


def _phasor_to_bytes(phasor: complex, channel: PhasorChannel, form: FormatBit) -> bytes:
    what = f"phasor '{channel.name}'"
    is_polar = FormatBit.POLAR in form
    if FormatBit.FLOAT_PHASORS in form:
        pair = cmath.polar(phasor) if is_polar else (phasor.real, phasor.imag)
        return pack_words("f", pair, what)
    if cmath.isnan(phasor):
        return pack_words("h", (ABSENT, ABSENT), what)
    if not channel.scale:
        raise FrameError(f"{what} in 16 bits needs a scale above 0")
    scaled = phasor / channel.units_per_bit
    if not is_polar:
        return pack_words("h", (_word(scaled.real), _word(scaled.imag)), what)
    magnitude, angle = abs(scaled), cmath.phase(phasor)
    return pack_words("H", [round(magnitude)], what) + pack_words(
        "h", [round(angle * _ANGLE_BITS_PER_RAD)], what
    )


def _take_phasor(words: WordReader, channel: PhasorChannel, form: FormatBit) -> complex:
    is_polar = FormatBit.POLAR in form
    if FormatBit.FLOAT_PHASORS in form:
        first, second = words.numbers("f", 2)
        if not is_polar:
            return complex(first, second)
        # An infinite angle points nowhere: no measurement.
        is_one = math.isfinite(first) and math.isfinite(second)
        return cmath.rect(first, second) if is_one else complex(math.nan, math.nan)
    if not is_polar:
        real, imaginary = (_number(word) for word in words.integers("h", 2))
        return complex(real * channel.units_per_bit, imaginary * channel.units_per_bit)
    magnitude = words.integer("H")
    angle = _number(words.integer("h")) / _ANGLE_BITS_PER_RAD
    return cmath.rect(magnitude * channel.units_per_bit, angle)


def _word(value: float) -> int:
    """Return `value` as the nearest integer, or the word that says that there is none."""
    return ABSENT if math.isnan(value) else _whole(value)


def _whole(value: float) -> int:
    if not math.isfinite(value):
        raise FrameError(f"{value} does not fit a 16-bit word")
    return round(value)


def _number(word: int) -> float:
    return math.nan if word == ABSENT else float(word)
