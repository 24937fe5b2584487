"""XXH3 of 64 bits with seed 0, from its published specification."""

MASK = (1 << 64) - 1
SECRET = bytes.fromhex(
    "b8fe6c3923a44bbe7c01812cf721ad1cded46de9839097db7240a4a4b7b3671f"
    "cb79e64eccc0e578825ad07dccff7221b8084674f743248ee03590e6813a264c"
    "3c2852bb91c300cb88d0658b1b532ea371644897a20df94e3819ef46a9deacd8"
    "a8fa763fe39c343ff9dcbbc7c70b4f1d8a51e04bcdb45931c89f7ec9d9787364"
    "eac5ac8334d3ebc3c581a0fffa1363eb170ddd51b7f0da49d316552629d4689e"
    "2b16be587d47a1fc8ff8b8d17ad031ce45cb3a8f95160428afd7fbcabb4b407e"
)
PRIMES_32 = 0x9E3779B1, 0x85EBCA77, 0xC2B2AE3D
PRIMES_64 = (
    0x9E3779B185EBCA87,
    0xC2B2AE3D27D4EB4F,
    0x165667B19E3779F9,
    0x85EBCA77C2B2AE63,
    0x27D4EB2F165667C5,
)


def word(data, at, size=8):
    return int.from_bytes(data[at : at + size], "little")


def swapped(x):
    return int.from_bytes(x.to_bytes(8, "little"), "big")


def rotated(x, bits):
    return (x << bits | x >> (64 - bits)) & MASK


def fold(x, y):
    product = x * y
    return product & MASK ^ product >> 64


def avalanche(x):
    x = ((x & MASK) ^ (x & MASK) >> 37) * 0x165667919E3779F9 & MASK
    return x ^ x >> 32


def old_avalanche(x):
    x = (x ^ x >> 33) * PRIMES_64[1] & MASK
    x = (x ^ x >> 29) * PRIMES_64[2] & MASK
    return x ^ x >> 32


def mix(data, at, secret):
    return fold(word(data, at) ^ word(SECRET, secret), word(data, at + 8) ^ word(SECRET, secret + 8))


def up_to_16(data):
    n = len(data)
    if n > 8:
        low = word(data, 0) ^ word(SECRET, 24) ^ word(SECRET, 32)
        high = word(data, n - 8) ^ word(SECRET, 40) ^ word(SECRET, 48)
        return avalanche(n + swapped(low) + high + fold(low, high))
    if n > 3:
        x = word(data, n - 4, 4) + (word(data, 0, 4) << 32) ^ word(SECRET, 8) ^ word(SECRET, 16)
        x = (x ^ rotated(x, 49) ^ rotated(x, 24)) * 0x9FB21C651E98DF25 & MASK
        x = (x ^ (x >> 35) + n) * 0x9FB21C651E98DF25 & MASK
        return x ^ x >> 28
    if n > 0:
        x = data[0] << 16 | data[n >> 1] << 24 | data[n - 1] | n << 8
        return old_avalanche(x ^ word(SECRET, 0, 4) ^ word(SECRET, 4, 4))
    return old_avalanche(word(SECRET, 56) ^ word(SECRET, 64))


def up_to_240(data):
    n = len(data)
    total = n * PRIMES_64[0]
    if n <= 128:
        for i in range((n - 1) // 32 + 1):
            total += mix(data, 16 * i, 32 * i) + mix(data, n - 16 * (i + 1), 32 * i + 16)
        return avalanche(total)
    total = avalanche(total + sum(mix(data, 16 * i, 16 * i) for i in range(8)))
    total += sum(mix(data, 16 * i, 16 * (i - 8) + 3) for i in range(8, n // 16))
    return avalanche(total + mix(data, n - 16, 119))


def stripe(sums, data, at, secret):
    for i in range(8):
        value = word(data, at + 8 * i)
        keyed = value ^ word(SECRET, secret + 8 * i)
        sums[i ^ 1] = sums[i ^ 1] + value & MASK
        sums[i] = sums[i] + (keyed & 0xFFFFFFFF) * (keyed >> 32) & MASK


def longer(data):
    n = len(data)
    p, q = PRIMES_32, PRIMES_64
    sums = [p[2], q[0], q[1], q[2], q[3], p[1], q[4], p[0]]
    for i in range((n - 1) // 64):
        stripe(sums, data, 64 * i, 8 * (i % 16))
        if i % 16 == 15:
            for j in range(8):
                mixed = sums[j] ^ sums[j] >> 47 ^ word(SECRET, 128 + 8 * j)
                sums[j] = mixed * p[0] & MASK
    stripe(sums, data, n - 64, 121)
    total = n * q[0]
    for i in range(0, 8, 2):
        secret = 11 + 8 * i
        total += fold(sums[i] ^ word(SECRET, secret), sums[i + 1] ^ word(SECRET, secret + 8))
    return avalanche(total)


def xxh3(data):
    n = len(data)
    return up_to_16(data) if n <= 16 else up_to_240(data) if n <= 240 else longer(data)
