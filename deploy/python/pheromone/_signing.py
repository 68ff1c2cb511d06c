"""Signed frames, section 18 of the protocol: AES-128-CMAC, and a robot's end of a session."""

from __future__ import annotations

import fcntl
import hmac
import os
from collections import defaultdict
from pathlib import Path

from .wire import EVERYBODY, HELLO, HELLO_ANSWER

KEY_BYTES = 16
_TAG, _SERVER_NONCE = 4, 8
_GREETING = 2 + _SERVER_NONCE + KEY_BYTES + 4 + _TAG  # bytes of its DATA
_NOT_SIGNED = 0xFFFFFFFF  # the group's counter on a link that takes unsigned frames as well
_CLIENT, _SERVER, _TO_ALL, _HELLO, _GREETS, _SESSION_KEY, _GROUP_MASK = range(1, 8)


class NonceUsedUp(ValueError):
    """The robot has asked for 65536 sessions with one nonce; hello() with the next one goes on."""


def _double(byte: int) -> int:
    """In the field of AES."""
    return byte << 1 ^ (0x11B if byte & 0x80 else 0)


def _sbox() -> bytes:
    """By the powers of 3 and, at the same time, of its inverse."""
    box = [0x63] * 256
    power = inverse = 1
    for _ in range(255):
        power ^= _double(power)
        for shift in (1, 2, 4):
            inverse ^= inverse << shift & 0xFF
        inverse ^= 0x09 if inverse & 0x80 else 0
        turned = inverse * 0x101
        box[power] = 0x63 ^ (turned ^ turned >> 4 ^ turned >> 5 ^ turned >> 6 ^ turned >> 7) & 0xFF
    return bytes(box)


_SBOX = _sbox()
_SHIFTED = [(5 * at) % 16 for at in range(16)]  # where ShiftRows takes each byte from
_TWICE = bytes(map(_double, range(256)))


def _xor(a: bytes, b: bytes) -> bytes:
    return (int.from_bytes(a, "big") ^ int.from_bytes(b, "big")).to_bytes(len(a), "big")


class Mac:
    """CMAC with one key: SP 800-38B, FIPS 197."""

    def __init__(self, key: bytes) -> None:
        words = [key[at:at + 4] for at in range(0, KEY_BYTES, 4)]
        constant = 1
        for i in range(4, 44):
            word = words[-1]
            if i % 4 == 0:
                word = (word[1:] + word[:1]).translate(_SBOX)
                word = bytes((word[0] ^ constant,)) + word[1:]
                constant = _TWICE[constant]
            words.append(_xor(words[i - 4], word))
        self._keys = [b"".join(words[i:i + 4]) for i in range(0, 44, 4)]
        self._whole = self._subkey(self._encrypt(bytes(16)))
        self._padded = self._subkey(self._whole)

    def __call__(self, data: bytes) -> bytes:
        """16 bytes."""
        end = max(0, len(data) - 1) // 16 * 16
        mac = bytes(16)
        for at in range(0, end, 16):
            mac = self._encrypt(_xor(mac, data[at:at + 16]))
        last = data[end:]
        subkey = self._whole
        if len(last) < 16:
            last, subkey = (last + b"\x80").ljust(16, b"\0"), self._padded
        return self._encrypt(_xor(_xor(mac, last), subkey))

    def _encrypt(self, block: bytes) -> bytes:
        state = _xor(block, self._keys[0])
        for key in self._keys[1:-1]:
            s = state.translate(_SBOX)
            mixed = bytearray()
            for at in range(0, 16, 4):
                column = [s[_SHIFTED[at + row]] for row in range(4)]
                both = column[0] ^ column[1] ^ column[2] ^ column[3]
                mixed += bytes(column[row] ^ both ^ _TWICE[column[row] ^ column[(row + 1) % 4]]
                               for row in range(4))
            state = _xor(mixed, key)
        s = state.translate(_SBOX)
        return _xor(bytes(s[at] for at in _SHIFTED), self._keys[-1])

    @staticmethod
    def _subkey(block: bytes) -> bytes:
        value = int.from_bytes(block, "big") << 1
        return (value & (1 << 128) - 1 ^ (0x87 if value >> 128 else 0)).to_bytes(16, "big")


def _covered(use: int, counter: int, body: bytes) -> bytes:
    return bytes((use,)) + counter.to_bytes(4, "little") + body


class Signer:
    """A robot's session. Bodies are ID, OPCODE and DATA."""

    def __init__(self, key: bytes, client_id: int) -> None:
        if len(key) != KEY_BYTES:
            raise ValueError(f"a key has {KEY_BYTES} bytes, not {len(key)}")
        self._key = Mac(key)
        self._id = client_id
        self._numbers: defaultdict[bytes, int] = defaultdict(int)  # the next HELLO's, by nonce
        self._asked: tuple[bytes, int] | None = None  # the HELLO that was not greeted yet
        self._session: Mac | None = None
        self._sent = self._heard = 0
        self._group: Mac | None = None
        self._group_key = b""
        self._group_heard = 0

    @property
    def awaits_greeting(self) -> bool:
        return self._asked is not None

    def ask(self, hello: bytes) -> bytes:
        """HELLO as it asks for a session: the server greets. Raises NonceUsedUp."""
        nonce = hello[2:4]
        number = self._numbers[nonce]
        if number > 0xFFFF:
            raise NonceUsedUp("65536 sessions were asked for with this nonce, expected another one")
        self._numbers[nonce] = number + 1
        self._asked = nonce, number
        tag = self._key(_covered(_HELLO, number, hello))[:_TAG]
        return hello + number.to_bytes(2, "little") + tag

    def sign(self, body: bytes) -> bytes:
        """With what is added; each frame that is sent is signed anew. ValueError: there is no
        session yet."""
        if self._session is None or self._sent >= _NOT_SIGNED - 1:
            raise ValueError("with a key, hello() comes first")
        self._sent += 1
        tag = self._session(_covered(_CLIENT, self._sent, body))[:_TAG]
        return body + bytes((self._sent & 0xFF,)) + tag

    def verify(self, body: bytes) -> bytes | None:
        """Without what is added; None if it is to be ignored."""
        if body[0] == EVERYBODY:
            return self._verify_to_all(body)
        if body[0] != self._id or len(body) < 2 + _TAG + 1:
            return None
        if body[1] == HELLO_ANSWER and len(body) == 2 + _GREETING:
            self._accept_greeting(body)
            return None
        covered, low, tag = body[:-_TAG - 1], body[-_TAG - 1], body[-_TAG:]
        counter = self._heard + 1 + (low - self._heard - 1 & 0xFF)
        if self._session is None or not _fits(self._session, _SERVER, counter, covered, tag):
            return None
        self._heard = counter
        return covered

    def _verify_to_all(self, body: bytes) -> bytes | None:
        if self._group is None or len(body) < 2 + 2 + _TAG:
            return body if self._session is not None and self._group is None else None
        covered, low, tag = body[:-_TAG - 2], body[-_TAG - 2:-_TAG], body[-_TAG:]
        last = self._group_heard
        counter = last + 1 + (int.from_bytes(low, "little") - last - 1 & 0xFFFF)
        if not _fits(self._group, _TO_ALL, counter, covered, tag):
            return None
        self._group_heard = counter
        return covered

    def _accept_greeting(self, body: bytes) -> None:
        """Begins the session; once, or counters would be used twice."""
        if self._asked is None:
            return
        nonce, number = self._asked
        told, tag = body[:-_TAG], body[-_TAG:]
        if body[2:4] != nonce or not _fits(self._key, _GREETS, number, told, tag):
            return
        both, group = told[2:4 + _SERVER_NONCE], told[4 + _SERVER_NONCE:-4]
        nonces = bytes((self._id, HELLO)) + both
        self._asked = None
        self._session = Mac(self._key(_covered(_SESSION_KEY, number, nonces)))
        self._sent = self._heard = 0
        mask = self._key(_covered(_GROUP_MASK, number, nonces))
        counter = int.from_bytes(told[-4:], "little")
        group_key = _xor(mask, group) if counter != _NOT_SIGNED else b""
        # A greeting that was held back must not set the counter back.
        self._group_heard = max(counter, self._group_heard if group_key == self._group_key else 0)
        self._group = Mac(group_key) if group_key else None
        self._group_key = group_key


def _fits(key: Mac, use: int, counter: int, covered: bytes, tag: bytes) -> bool:
    return counter <= 0xFFFFFFFF and hmac.compare_digest(
        key(_covered(use, counter, covered))[:_TAG], tag)


def next_boot(path: str | os.PathLike[str]) -> int:
    """The next number of a boot counter, 1 to 65535, for HELLO's nonce: one more than the file has,
    which begins at 0 if it is not there, and it is on the disk before it is used. One file per key,
    kept as long as the key: if it is lost, the robot needs another key, and so it does after
    65535 boots (OverflowError). ValueError: the file holds no number."""
    file = Path(path)
    folder = os.open(file.parent, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        fcntl.flock(folder, fcntl.LOCK_EX)
        count = int(file.read_text()) + 1 if file.exists() else 1
        if not 1 <= count <= 0xFFFF:
            raise OverflowError(f"{file}: 65535 boots are counted: the robot needs another key")
        # A power failure leaves the file of before or the new one.
        with open(file.with_name(file.name + ".new"), "w") as new:
            new.write(f"{count}\n")
            new.flush()
            os.fsync(new.fileno())
        os.replace(new.name, file)
        os.fsync(folder)
        return count
    finally:
        os.close(folder)
