"""Object code placed in memory without LLVM, whose library takes longer to load than many runs take.

Only what LLVM writes for x86-64 with its large code model: relocatable ELF files in which every reference to another
section or function is an absolute 64-bit address (System V ABI, AMD64 supplement, sections 4.3 and 4.4). Anything else
is refused, and LLVM's own loader takes over.
"""

from __future__ import annotations

import ctypes
import mmap
import struct
from collections.abc import Callable

import numpy as np

_HEADER = struct.Struct("<16sHHIQQQIHHHHHH")
_IDENTITY = b"\x7fELF\x02\x01\x01"  # 64 bits, little-endian, version 1
_RELOCATABLE, _X86_64 = 1, 62
_SECTION = np.dtype(
    [
        ("name", "<u4"), ("kind", "<u4"), ("flags", "<u8"), ("address", "<u8"), ("offset", "<u8"),
        ("size", "<u8"), ("link", "<u4"), ("info", "<u4"), ("alignment", "<u8"), ("entry", "<u8"),
    ]
)  # fmt: skip
_SYMBOL = np.dtype(
    [("name", "<u4"), ("info", "u1"), ("other", "u1"), ("section", "<u2"), ("value", "<u8"), ("size", "<u8")]
)
_RELOCATION = np.dtype([("offset", "<u8"), ("info", "<u8"), ("addend", "<i8")])
_PROGRAM, _SYMBOLS, _RELOCATIONS, _ZEROS, _UNWIND = 1, 2, 4, 8, 0x70000001
_INERT = (0, 3, 7)  # kinds of sections that are not loaded: none, names, notes
_WRITE, _ALLOCATE, _THREAD_LOCAL = 1, 2, 0x400
_UNDEFINED = 0
_UNNAMED = (3, 4)  # kinds of symbols: a section, a file
_ABSOLUTE_64 = 1
_READ, _EXECUTE = 1, 4  # of mprotect


class UnsupportedError(Exception):
    """The object code has something that only LLVM's loader handles."""


class Image:
    """Object code in memory, freed with this object.

    Machine code and constants are executable and cannot be written; variables can be written and not executed.

    Parameters
    ----------
    content : bytes
        A relocatable ELF file.
    outside : callable
        `outside(name)` returns the address of a symbol that is not defined in it, 0 if there is none.

    Attributes
    ----------
    addresses : dict of str to int
        Of the functions and variables that it defines.

    Raises
    ------
    UnsupportedError
    """

    def __init__(self, content: bytes, outside: Callable[[str], int]) -> None:
        self._content, self._sections = content, _sections(content)
        loaded = [
            index
            for index, section in enumerate(self._sections)
            if section["flags"] & _ALLOCATE and section["kind"] in (_PROGRAM, _ZEROS)
        ]
        variable = [index for index in loaded if self._sections[index]["flags"] & _WRITE]
        fixed = [index for index in loaded if index not in variable]
        self._bytes: dict[int, np.ndarray] = {}
        code = self._placed(fixed)
        self._placed(variable)
        self._link(outside)
        _make_executable(code)

    def _placed(self, indices: list[int]) -> mmap.mmap:
        """Copy sections into one new block of memory."""
        places, end = [], 0
        for index in indices:
            alignment = max(1, int(self._sections[index]["alignment"]))
            if alignment > mmap.PAGESIZE:
                raise UnsupportedError(f"a section is aligned to {alignment} bytes")
            places.append(-(-end // alignment) * alignment)
            end = places[-1] + int(self._sections[index]["size"])
        block = mmap.mmap(-1, max(1, end), flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
        memory = np.frombuffer(block, dtype=np.uint8)
        for index, place in zip(indices, places):
            section = self._sections[index]
            size = int(section["size"])
            self._bytes[index] = memory[place : place + size]
            if section["kind"] == _PROGRAM:
                self._bytes[index][:] = np.frombuffer(self._content, np.uint8, size, int(section["offset"]))
        return block

    def _link(self, outside: Callable[[str], int]) -> None:
        """Find the addresses of symbols, and write them where the code refers to them."""
        relocations = {
            int(section["info"]): self._entries(section, _RELOCATION)
            for section in self._sections
            if section["kind"] == _RELOCATIONS and int(section["info"]) in self._bytes
        }
        used = {int(symbol) for entries in relocations.values() for symbol in entries["info"] >> 32}
        (table,) = (section for section in self._sections if section["kind"] == _SYMBOLS)
        names = int(self._sections[table["link"]]["offset"])
        symbols = self._entries(table, _SYMBOL).tolist()
        values = np.zeros(len(symbols), dtype=np.uint64)
        self.addresses: dict[str, int] = {}
        for index, (name, info, _, section, value, _) in enumerate(symbols):
            if section in self._bytes:
                address = self._bytes[section].ctypes.data + value
                if info & 15 not in _UNNAMED:
                    self.addresses[self._text(names + name)] = address
            elif index in used:
                address = outside(self._text(names + name)) if section == _UNDEFINED else 0
                if not address:
                    raise UnsupportedError(f"the symbol {self._text(names + name)!r} is not found")
            else:
                continue
            values[index] = address
        for section, entries in relocations.items():
            _relocate(self._bytes[section], entries, values)

    def _entries(self, section: np.void, kind: np.dtype) -> np.ndarray:
        return np.frombuffer(
            self._content, kind, int(section["size"]) // kind.itemsize, int(section["offset"])
        )

    def _text(self, begin: int) -> str:
        return self._content[begin : self._content.index(b"\0", begin)].decode()


def _sections(content: bytes) -> np.ndarray:
    """Return the section headers of a file of the one kind that is understood here."""
    if len(content) < _HEADER.size or not content.startswith(_IDENTITY):
        raise UnsupportedError("not an ELF file of 64 bits")
    _, kind, machine, _, _, _, offset, _, _, _, _, size, count, _ = _HEADER.unpack_from(content)
    if (kind, machine, size) != (_RELOCATABLE, _X86_64, _SECTION.itemsize):
        raise UnsupportedError("not relocatable code for x86-64")
    sections = np.frombuffer(content, _SECTION, count, offset)
    understood = (_PROGRAM, _SYMBOLS, _RELOCATIONS, _ZEROS, _UNWIND, *_INERT)
    if any(kind not in understood for kind in sections["kind"]) or (sections["flags"] & _THREAD_LOCAL).any():
        raise UnsupportedError("a section of an unknown kind")
    return sections


def _relocate(memory: np.ndarray, entries: np.ndarray, values: np.ndarray) -> None:
    """Write the addresses that a section refers to into its bytes."""
    if (entries["info"] & 0xFFFFFFFF != _ABSOLUTE_64).any():
        raise UnsupportedError("a reference is not an absolute address of 64 bits")
    addresses = values[entries["info"] >> 32] + entries["addend"].view(np.uint64)
    places = entries["offset"][:, None] + np.arange(8, dtype=np.uint64)
    memory[places] = addresses.view(np.uint8).reshape(-1, 8)


def _make_executable(block: mmap.mmap) -> None:
    protect = ctypes.CDLL(None, use_errno=True).mprotect
    protect.argtypes = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int
    if protect(ctypes.addressof(ctypes.c_char.from_buffer(block)), len(block), _READ | _EXECUTE):
        raise UnsupportedError(f"memory cannot be made executable (error {ctypes.get_errno()})")
