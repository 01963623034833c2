"""Checks of the elements of a DICOM file (PS3.5 §7) before GDCM reads it: GDCM allocates any length unchecked."""

from __future__ import annotations

import io
import math
import struct
import zlib

from .checks import check_memory

UNDEFINED = 0xFFFFFFFF
_ITEM, _ITEM_END, _SEQUENCE_END = (0xFFFE, 0xE000), (0xFFFE, 0xE00D), (0xFFFE, 0xE0DD)
_TRANSFER_SYNTAX, _MEDIA_CLASS, _PIXELS = (0x0002, 0x0010), (0x0002, 0x0002), (0x7FE0, 0x0010)
# Attributes that determine the number of bytes of the pixels.
_SIZES = {(0x0028, 0x0002): "samples", (0x0028, 0x0010): "rows", (0x0028, 0x0011): "columns", (0x0028, 0x0100): "bits"}
_FRAMES = (0x0028, 0x0008)
_LONG = (b"OB", b"OD", b"OF", b"OL", b"OV", b"OW", b"SQ", b"SV", b"UC", b"UN", b"UR", b"UT", b"UV")
_SHORT = (
    b"AE",
    b"AS",
    b"AT",
    b"CS",
    b"DA",
    b"DS",
    b"DT",
    b"FD",
    b"FL",
    b"IS",
    b"LO",
    b"LT",
    b"PN",
    b"SH",
    b"SL",
    b"SS",
    b"ST",
    b"TM",
    b"UI",
    b"UL",
    b"US",
)
_IMPLICIT, _BIG, _DEFLATED = "1.2.840.10008.1.2", "1.2.840.10008.1.2.2", "1.2.840.10008.1.2.1.99"
DIRECTORY_CLASS = "1.2.840.10008.1.3.10"
# The largest depth of nested sequences.
DEPTH_LIMIT = 32


def begins_as_dicom(path):
    """Whether a file has the preamble of DICOM files, or ends inside it."""
    with open(path, "rb") as file:
        beginning = file.read(132)
    return beginning[128:] == b"DICM" or (len(beginning) < 132 and not beginning[:128].strip(b"\0"))


def check_elements(path):
    """Check that all elements of a file end within it, and that it has pixels.

    Returns the UID of its kind (Media Storage SOP Class), or an empty text.
    """
    with open(path, "rb") as file:
        content = file.read()
    start = 132 if content[128:132] == b"DICM" else 0
    meta = _Walker(content, "<", explicit=True)
    position = meta.walk(start, len(content), only_group=0x0002) if start else 0
    syntax = meta.text(_TRANSFER_SYNTAX)
    if syntax == _DEFLATED:
        content, position = _inflated(content[position:]), 0
    explicit = content[position + 4 : position + 6].isalpha() if not start else syntax != _IMPLICIT
    walker = _Walker(content, ">" if syntax == _BIG else "<", explicit)
    walker.walk(position, len(content))
    walker.check_pixels()
    return meta.text(_MEDIA_CLASS)


def _inflated(content):
    inflate = zlib.decompressobj(wbits=-zlib.MAX_WBITS)
    result = io.BytesIO()
    for begin in range(0, len(content), 1 << 16):
        result.write(inflate.decompress(content[begin : begin + (1 << 16)]))
        check_memory(result.tell(), "inflated elements")
    if not inflate.eof:
        raise ValueError("expected deflated elements to their end: the file is truncated")
    return result.getvalue()


class _Walker:
    """Visits the elements of a data set, and keeps those that describe its pixels."""

    def __init__(self, content, order, explicit):
        self._content, self._explicit = content, explicit
        self._tag = struct.Struct(order + "HH")
        self._short, self._long = struct.Struct(order + "H"), struct.Struct(order + "I")
        self._found = {}

    def walk(self, position, end, *, only_group=None, depth=0, until=None):
        """Visit elements up to `end`, or up to the tag `until`; returns the position behind them."""
        while position < end:
            tag = self._unpack(self._tag, position, end)
            if only_group is not None and tag[0] != only_group:
                return position
            if tag == until:
                return position + 8
            kind, length, begin = self._header(tag, position, end)
            if length == UNDEFINED:
                if kind not in (b"SQ", b"UN", b"OB", b"OW", b""):
                    raise ValueError(f"expected a length of element {_text(tag)}")
                position = self._items(begin, end, depth, fragments=tag == _PIXELS, implicit=kind == b"UN")
                length = None
            else:
                if length > end - begin:
                    raise ValueError(
                        f"expected {length} bytes of element {_text(tag)}, got {end - begin}: the file is truncated or "
                        "damaged"
                    )
                position = begin + length
                if kind == b"SQ":
                    self._items(begin, position, depth, bounded=True)
            if depth == 0 and (tag in (_PIXELS, _FRAMES) or tag in _SIZES or tag[0] == 0x0002):
                self._found[tag] = (begin, length)
        if until is not None:
            raise ValueError(f"expected {_text(until)} at the end of items: the file is truncated or damaged")
        return position

    def _header(self, tag, position, end):
        """Kind (VR) of an element, and the length and first byte of its value."""
        if self._explicit and tag[0] != 0xFFFE:
            kind = self._content[position + 4 : position + 6]
            if kind in _LONG:
                return kind, self._unpack(self._long, position + 8, end)[0], position + 12
            if kind not in _SHORT:
                raise ValueError(f"expected the type of element {_text(tag)}: the file is damaged")
            return kind, self._unpack(self._short, position + 6, end)[0], position + 8
        return b"", self._unpack(self._long, position + 4, end)[0], position + 8

    def _items(self, position, end, depth, *, fragments=False, implicit=False, bounded=False):
        """Visit the items of a sequence, or the fragments of compressed pixels."""
        if depth >= DEPTH_LIMIT:
            raise ValueError(f"expected nested sequences of a depth of at most {DEPTH_LIMIT}")
        explicit, self._explicit = self._explicit, self._explicit and not implicit
        while position < end:
            tag = self._unpack(self._tag, position, end)
            length = self._unpack(self._long, position + 4, end)[0]
            begin = position + 8
            if tag == _SEQUENCE_END:
                self._explicit = explicit
                return begin
            if tag != _ITEM or (length != UNDEFINED and length > end - begin):
                raise ValueError(f"expected an item within the file, got {_text(tag)} of {length} bytes")
            if fragments:
                if length == UNDEFINED:
                    raise ValueError("expected fragments of pixels of a length")
                position = begin + length
            elif length == UNDEFINED:
                position = self.walk(begin, end, depth=depth + 1, until=_ITEM_END)
            else:
                position = self.walk(begin, begin + length, depth=depth + 1)
        if not bounded:
            raise ValueError("expected an end of items: the file is truncated or damaged")
        self._explicit = explicit
        return position

    def _unpack(self, form, position, end):
        if position + form.size > end:
            raise ValueError("expected whole elements: the file is truncated")
        return form.unpack_from(self._content, position)

    def text(self, tag):
        """The text of an element that was found."""
        begin, length = self._found.get(tag, (0, 0))
        return self._content[begin : begin + (length or 0)].decode("latin-1").strip("\0 ")

    def check_pixels(self):
        """Check that uncompressed pixels have the number of bytes that the attributes give."""
        begin, length = self._found.get(_PIXELS, (0, None))
        if length is None:
            return
        sizes = {"samples": 1}
        for tag, name in _SIZES.items():
            at, size = self._found.get(tag, (0, 0))
            if size == 2:
                sizes[name] = self._short.unpack_from(self._content, at)[0]
        frames = self.text(_FRAMES) or "1"
        if len(sizes) < len(_SIZES) or not frames.strip().isdigit():
            raise ValueError("expected rows, columns, bits allocated and a number of frames")
        expected = math.prod(sizes.values()) * int(frames) // 8
        if length < expected:
            raise ValueError(f"expected {expected} bytes of pixels, got {length}: the file is truncated or damaged")


def _text(tag):
    return f"({tag[0]:04X},{tag[1]:04X})"
