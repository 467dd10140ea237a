"""Configuration frames CFG-2: what the words of a stream's data frames mean (6.4, Table 9)."""

from dataclasses import dataclass

from tieline.c37118.constants import TIME_BASE, FormatBit, FrameType
from tieline.c37118.prefix import Prefix, unwrap, wrap
from tieline.c37118.words import WordReader, pack_names, pack_words
from tieline.errors import FrameError

_BITS_PER_DIGITAL = 16
_LOW_24 = 0xFFFFFF


@dataclass(frozen=True)
class PhasorChannel:
    """CHNAM and PHUNIT of a phasor.

    Attributes:
        name: at most 16 ASCII characters.
        is_current: a current in A; otherwise a voltage in V.
        scale: 1e-5 V or A a bit of a 16-bit phasor, 24 bits; a phasor in floats does not use it.
    """

    name: str
    is_current: bool = False
    scale: int = 0

    @property
    def units_per_bit(self) -> float:
        """V or A a bit of a 16-bit phasor."""
        return self.scale / 100_000


@dataclass(frozen=True)
class AnalogChannel:
    """CHNAM and ANUNIT of an analog value, whose unit is its user's affair.

    Attributes:
        name: at most 16 ASCII characters.
        kind: 0 point on wave, 1 rms, 2 peak; 5 to 64 reserved, 65 to 255 the user's.
        scale: user-defined, signed 24 bits; not applied to the values.
    """

    name: str
    kind: int = 0
    scale: int = 1


@dataclass(frozen=True)
class DigitalWord:
    """CHNAM and DIGUNIT of 16 states: `normal` holds their normal values, `valid` is a mask."""

    names: tuple[str, ...]
    normal: int = 0
    valid: int = 0xFFFF


@dataclass(frozen=True)
class PmuConfig:
    """One PMU of a stream: its name, the format of its words and its channels.

    `f0_hz` is the nominal frequency, 50 or 60; `change_count` counts changes of the configuration.
    """

    station: str
    idcode: int
    format: FormatBit
    phasors: tuple[PhasorChannel, ...] = ()
    analogs: tuple[AnalogChannel, ...] = ()
    digitals: tuple[DigitalWord, ...] = ()
    f0_hz: int = 60
    change_count: int = 0

    def to_bytes(self) -> bytes:
        """Return fields 8 to 19 of Table 9.

        Raises:
            FrameError: a value does not fit its word.
        """
        self._check()
        counts = (len(self.phasors), len(self.analogs), len(self.digitals))
        states = [name for word in self.digitals for name in word.names]
        channels = [phasor.name for phasor in self.phasors]
        phasor_units = [int(channel.is_current) << 24 | channel.scale for channel in self.phasors]
        analog_units = [channel.kind << 24 | channel.scale & _LOW_24 for channel in self.analogs]
        masks = [mask for word in self.digitals for mask in (word.normal, word.valid)]
        return b"".join(
            (
                pack_names([self.station]),
                pack_words("H", (self.idcode, self.format, *counts), "IDCODE, FORMAT and counts"),
                pack_names([*channels, *(analog.name for analog in self.analogs), *states]),
                pack_words("I", phasor_units, "PHUNIT"),
                pack_words("I", analog_units, "ANUNIT"),
                pack_words("H", masks, "DIGUNIT"),
                pack_words("H", (self.f0_hz == 50, self.change_count), "FNOM and CFGCNT"),
            )
        )

    @classmethod
    def take(cls, words: WordReader) -> "PmuConfig":
        """Return the PMU whose fields 8 to 19 of Table 9 come next.

        Raises:
            FrameError: the words end before the last field.
        """
        (station,) = words.names(1)
        idcode, form, phasors, analogs, digitals = words.integers("H", 5)
        names = words.names(phasors + analogs + _BITS_PER_DIGITAL * digitals)
        states = names[phasors + analogs :]
        units = words.integers("I", phasors)
        analog_units = words.integers("I", analogs)
        masks = words.integers("H", 2 * digitals)
        fnom, change_count = words.integers("H", 2)
        return cls(
            station,
            idcode,
            FormatBit(form & 0xF),
            tuple(_phasor(name, unit) for name, unit in zip(names, units, strict=False)),
            tuple(
                AnalogChannel(name, unit >> 24, _signed_24(unit & _LOW_24))
                for name, unit in zip(names[phasors:], analog_units, strict=False)
            ),
            tuple(
                DigitalWord(states[16 * i : 16 * i + 16], masks[2 * i], masks[2 * i + 1])
                for i in range(digitals)
            ),
            50 if fnom & 1 else 60,
            change_count,
        )

    def _check(self) -> None:
        if self.f0_hz not in (50, 60):
            raise FrameError(
                f"nominal frequency of '{self.station}' is 50 or 60 (got {self.f0_hz})"
            )
        for phasor in self.phasors:
            if not 0 <= phasor.scale <= _LOW_24:
                raise FrameError(
                    f"scale of phasor '{phasor.name}' has 24 bits (got {phasor.scale})"
                )
        for analog in self.analogs:
            if not -(1 << 23) <= analog.scale < 1 << 23:
                raise FrameError(
                    f"scale of analog '{analog.name}' has 24 bits (got {analog.scale})"
                )
        for word in self.digitals:
            if len(word.names) != _BITS_PER_DIGITAL:
                raise FrameError(f"a digital word has 16 names (got {len(word.names)})")


@dataclass(frozen=True)
class ConfigFrame:
    """A CFG-2 frame.

    Attributes:
        prefix: whose stream, and when.
        pmus: the PMUs of the stream, in the order of their data.
        data_rate: frames a second, or minus the seconds a frame.
        time_base: ticks a second of FRACSEC.
    """

    prefix: Prefix
    pmus: tuple[PmuConfig, ...]
    data_rate: int
    time_base: int = TIME_BASE

    def to_bytes(self) -> bytes:
        """Return the frame.

        Raises:
            FrameError: a value does not fit its word.
        """
        if not 0 < self.time_base <= _LOW_24:
            raise FrameError(f"TIME_BASE must be 1 to {_LOW_24} (got {self.time_base})")
        head = pack_words("I", [self.time_base], "TIME_BASE")
        head += pack_words("H", [len(self.pmus)], "NUM_PMU")
        body = b"".join(pmu.to_bytes() for pmu in self.pmus)
        rate = pack_words("h", [self.data_rate], "DATA_RATE")
        return wrap(FrameType.CONFIG_2, self.prefix, head + body + rate)

    @classmethod
    def from_bytes(cls, data: bytes) -> "ConfigFrame":
        """Return the frame that the bytes hold.

        Raises:
            FrameError: they are no sound CFG-2 frame.
        """
        prefix, body = unwrap(FrameType.CONFIG_2, data)
        words = WordReader(body)
        time_base = words.integer("I") & _LOW_24
        pmus = tuple(PmuConfig.take(words) for _ in range(words.integer("H")))
        data_rate = words.integer("h")
        words.finish()
        return cls(prefix, pmus, data_rate, time_base)


def _phasor(name: str, unit: int) -> PhasorChannel:
    return PhasorChannel(name, bool(unit >> 24), unit & _LOW_24)


def _signed_24(value: int) -> int:
    return value - (1 << 24) if value & 0x800000 else value
