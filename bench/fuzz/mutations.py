"""Changes that follow the structure of a format: a number becomes another kind of number, a key is lost, a cell is doubled."""

from __future__ import annotations

import re
import struct
import warnings
import zipfile
import zlib
from collections.abc import Callable
from io import BytesIO
from random import Random

NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
WORD = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
STRING = re.compile(r'"[^"\n]*"')

NUMBERS = (
    "0", "-0.0", "1", "-1", "2", "0.5", "1e-9", "1e-308", "5e-324", "1e9", "1e18", "1e300", "1.8e308", "nan", "inf", "-inf",
    "9007199254740993", "18446744073709551616", "-9223372036854775809", "9" * 400, "0x10", "1_000", "1,5", "", '"text"', "true", "[]",
    "{}", "null", "1979-05-27", "٣", "1e", "--1",
)  # fmt: skip
STRINGS = (
    "", " ", "../../etc/passwd", "/dev/zero", "/", ".", "..", "a" * 5000, "\u0000", "é", "\u202e", "%s%n", "<script>x</script>", "$HOME",
    "con", "a\\u0000b", "\\ud800", "\\n", "{0}", "$x^{", "\ufeff", "-o", "--help", "model.toml", "nan", "1",
)  # fmt: skip
BYTES = (b"\x00", b"\xff", b"\xef\xbb\xbf", b"\r", b"\n", b"\r\n", b"\x1a", b"\x80", b"\xed\xa0\x80", b";", b",", b'"', b"[", b"{", b"#")


def _one(random: Random, text: str, what: re.Pattern[str], by: Callable[[str], str]) -> str:
    """Replace one occurrence."""
    found = list(what.finditer(text))
    if not found:
        return text
    at = random.choice(found)
    return text[: at.start()] + by(at.group()) + text[at.end() :]


def number(random: Random, data: bytes) -> bytes:
    """Put another number, or what is none, in the place of a number."""
    return _one(random, data.decode("utf-8", "replace"), NUMBER, lambda _: random.choice(NUMBERS)).encode("utf-8", "replace")


def scale(random: Random, data: bytes) -> bytes:
    """Multiply a number by a power of ten or turn its sign."""
    factor = random.choice((-1.0, 1e-12, 1e-6, 1e-3, 0.1, 0.5, 2.0, 10.0, 1e3, 1e6, 1e12))
    return _one(random, data.decode("utf-8", "replace"), NUMBER, lambda old: repr(float(old) * factor)).encode()


def string(random: Random, data: bytes) -> bytes:
    """Put another string in the place of a string."""
    by = random.choice(STRINGS)
    return _one(random, data.decode("utf-8", "replace"), STRING, lambda _: f'"{by}"').encode("utf-8", "surrogatepass")


def word(random: Random, data: bytes) -> bytes:
    """Misspell, exchange or lose a word: a key, a kind, a column."""
    text = data.decode("utf-8", "replace")
    words = WORD.findall(text) or ["a"]
    by = random.choice((lambda w: w[:-1], lambda w: w + "x", lambda w: w.upper(), lambda _: random.choice(words), lambda _: ""))
    return _one(random, text, WORD, by).encode("utf-8", "replace")


def line(random: Random, data: bytes) -> bytes:
    """Lose, double, exchange or join lines."""
    lines = data.split(b"\n")
    at, other = random.randrange(len(lines)), random.randrange(len(lines))
    what = random.randrange(5)
    if what == 0:
        del lines[at]
    elif what == 1:
        lines.insert(other, lines[at])
    elif what == 2:
        lines[at], lines[other] = lines[other], lines[at]
    elif what == 3:
        lines[at : at + 2] = [b"".join(lines[at : at + 2])]
    else:
        lines[at:at] = [lines[at]] * 300
    return b"\n".join(lines)


def cell(random: Random, data: bytes) -> bytes:
    """Change, lose or double a cell or a whole column of a table."""
    rows = [row.split(b",") for row in data.split(b"\n")]
    column, what = random.randrange(max(1, len(rows[0]))), random.randrange(5)
    by = random.choice((*NUMBERS, *STRINGS)).encode("utf-8", "replace")
    if what < 2:
        row = random.choice(rows)
        row[random.randrange(len(row))] = by
    else:
        for row in rows[random.choice((0, 1)) :]:
            if column < len(row):
                row[column : column + 1] = ([], [row[column]] * 2, [by])[what - 2]
    return b"\n".join(b",".join(row) for row in rows)


def cut(random: Random, data: bytes) -> bytes:
    """Lose the end, the start or a part."""
    a, b = sorted(random.randrange(len(data) + 1) for _ in range(2))
    return random.choice((data[:a], data[a:], data[:a] + data[b:]))


def repeat(random: Random, data: bytes) -> bytes:
    """Double a part, or put it elsewhere."""
    a, b, c = sorted(random.randrange(len(data) + 1) for _ in range(3))
    return random.choice((data[:b] + data[a:], data[:a] + data[b:c] + data[a:b] + data[c:]))


def flip(random: Random, data: bytes) -> bytes:
    """Change some bits or bytes."""
    changed = bytearray(data)
    for _ in range(random.choice((1, 1, 1, 2, 8))):
        if changed:
            at = random.randrange(len(changed))
            changed[at] = random.choice((changed[at] ^ (1 << random.randrange(8)), random.randrange(256), 0, 255))
    return bytes(changed)


def insert(random: Random, data: bytes) -> bytes:
    """Put bytes in that mean something somewhere."""
    at = random.randrange(len(data) + 1)
    return data[:at] + random.choice(BYTES) * random.choice((1, 1, 1, 3, 1000)) + data[at:]


def integer(random: Random, data: bytes) -> bytes:
    """Put an extreme count or size in the place of two, four or eight bytes."""
    form = random.choice(("<h", "<i", "<q", ">i", "<f", "<d"))
    values = (float("nan"), 1e30, -1.0) if form[1] in "fd" else (0, -1, 1, 2 ** (8 * struct.calcsize(form) - 1) - 1)
    by = struct.pack(form, random.choice(values))
    at = random.randrange(max(1, len(data) - len(by) + 1))
    return data[:at] + by + data[at + len(by) :]


def encoding(random: Random, data: bytes) -> bytes:
    """Write the text in another encoding, or with other line ends."""
    text = data.decode("utf-8", "replace")
    name = random.choice(("utf-16", "utf-32", "utf-8-sig", "cp037", "latin-1"))
    return random.choice((text.encode(name, "replace"), data.replace(b"\n", b"\r"), data.replace(b"\n", b"\r\n")))


def member(random: Random, data: bytes) -> bytes:
    """Change the name or the content of a file in an archive, lose it, double it; or change its description."""
    try:
        with zipfile.ZipFile(BytesIO(data)) as source:
            entries = [(info.filename, source.read(info)) for info in source.infolist()]
    except (zipfile.BadZipFile, zlib.error, OSError, ValueError, RuntimeError, NotImplementedError, EOFError):
        return flip(random, data)
    if not entries:
        return data
    at = random.randrange(len(entries))
    name, content = entries[at]
    what = random.randrange(5)
    if what == 0:
        entries[at] = (random.choice((*STRINGS[2:], "../" + name, "/" + name, name.upper())), content)
    elif what == 1:
        del entries[at]
    elif what == 2:
        entries.append((name, content))
    else:
        entries[at] = (name, random.choice(TEXT if name.endswith((".xml", ".json", ".txt")) else BINARY)(random, content))
    target = BytesIO()
    with warnings.catch_warnings(), zipfile.ZipFile(target, "w") as archive:
        warnings.simplefilter("ignore")  # two files of one name are meant
        for name, content in entries:
            archive.writestr(zipfile.ZipInfo(name or "x"), content, random.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)))
    return target.getvalue()


Mutator = Callable[[Random, bytes], bytes]
BINARY: tuple[Mutator, ...] = (flip, flip, integer, cut, repeat, insert)
TEXT: tuple[Mutator, ...] = (number, number, scale, string, word, line, line, cut, repeat, flip, insert, encoding)
TABLE: tuple[Mutator, ...] = (cell, cell, cell, number, scale, word, line, line, cut, repeat, flip, insert, encoding)
ARCHIVE: tuple[Mutator, ...] = (member, member, member, flip, cut)

_BY_SUFFIX = {
    **dict.fromkeys((".csv", ".mot", ".sto", ".trc", ".tsv"), TABLE),
    **dict.fromkeys((".toml", ".json", ".urdf", ".xml", ".osim"), TEXT),
    **dict.fromkeys((".fmu", ".xlsx"), ARCHIVE),
}


def mutate(random: Random, suffix: str, data: bytes) -> bytes:
    """Make one to three changes that fit a file of this suffix."""
    mutators = _BY_SUFFIX.get(suffix, BINARY)
    for _ in range(random.choice((1, 1, 1, 2, 3))):
        data = random.choice(mutators)(random, data)
    return data
