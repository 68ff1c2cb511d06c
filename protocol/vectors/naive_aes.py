"""AES-128 (FIPS 197) and CMAC (RFC 4493), for signed_vectors.py: as plainly as it goes, and slowly.
Nothing is shared with ../aes.h; the examples of both documents are checked when this is loaded.
"""

import naive_protocol


def times(a, b):
    """The product in GF(256), modulo x^8 + x^4 + x^3 + x + 1."""
    return naive_protocol.times(a, b, 0x11B)


def substitute(byte):
    """The S-box: the inverse, found by trying all, then the affine map."""
    inverse = next((it for it in range(256) if times(byte, it) == 1), 0)
    bits = [inverse >> bit & 1 for bit in range(8)]
    return sum((bits[i] ^ bits[(i + 4) % 8] ^ bits[(i + 5) % 8] ^ bits[(i + 6) % 8] ^
                bits[(i + 7) % 8] ^ (0x63 >> i & 1)) << i for i in range(8))


SBOX = [substitute(byte) for byte in range(256)]


def combined(a, b):
    return bytes(x ^ y for x, y in zip(a, b, strict=True))


def round_keys(key):
    words = [key[at:at + 4] for at in range(0, 16, 4)]
    constant = 1
    for i in range(4, 44):
        word = words[-1]
        if i % 4 == 0:
            word = bytes(SBOX[byte] for byte in word[1:] + word[:1])
            word = combined(word, bytes([constant, 0, 0, 0]))
            constant = times(constant, 2)
        words.append(combined(words[-4], word))
    return [b"".join(words[i:i + 4]) for i in range(0, 44, 4)]


def mixed(column):
    return bytes(times(2, column[i]) ^ times(3, column[(i + 1) % 4]) ^ column[(i + 2) % 4] ^
                 column[(i + 3) % 4] for i in range(4))


def aes(key, block):
    first, *others = round_keys(key)
    state = combined(block, first)
    for number, round_key in enumerate(others, start=1):
        state = bytes(SBOX[state[4 * ((at // 4 + at % 4) % 4) + at % 4]] for at in range(16))
        if number < 10:
            state = b"".join(mixed(state[at:at + 4]) for at in range(0, 16, 4))
        state = combined(state, round_key)
    return state


def doubled(block):
    value = int.from_bytes(block, "big") << 1
    return (value & (1 << 128) - 1 ^ (0x87 if value >> 128 else 0)).to_bytes(16, "big")


def cmac(key, data):
    subkey = doubled(aes(key, bytes(16)))
    blocks = [data[at:at + 16] for at in range(0, len(data), 16)] or [b""]
    if len(blocks[-1]) < 16:
        subkey = doubled(subkey)
        blocks[-1] = (blocks[-1] + b"\x80").ljust(16, b"\0")
    blocks[-1] = combined(blocks[-1], subkey)
    mac = bytes(16)
    for block in blocks:
        mac = aes(key, combined(mac, block))
    return mac


def check():
    """FIPS 197, appendix B and C.1; RFC 4493, section 4."""
    key = "2b7e151628aed2a6abf7158809cf4f3c"
    text = "6bc1bee22e409f96e93d7e117393172aae2d8a571e03ac9c9eb76fac45af8e5130c81c46a35ce411"
    for function, of, data, expected in (
            (aes, key, "3243f6a8885a308d313198a2e0370734", "3925841d02dc09fbdc118597196a0b32"),
            (aes, bytes(range(16)).hex(), "00112233445566778899aabbccddeeff",
             "69c4e0d86a7b0430d8cdb78070b4c55a"),
            (cmac, key, "", "bb1d6929e95937287fa37d129b756746"),
            (cmac, key, text[:32], "070a16b46b4d4144f79bdd9dd04a287c"),
            (cmac, key, text, "dfa66747de9ae63030ca32611497c827")):
        found = function(bytes.fromhex(of), bytes.fromhex(data))
        if found.hex() != expected:
            raise AssertionError(f"{function.__name__} of {data}: {found.hex()}")


check()
