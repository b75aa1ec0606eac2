// FNV-1a in words of 64 bits and four lanes, which a processor works on at once. Multiplication only carries upwards, so the upper bits return to the lower ones
// after each word; each part ends by mixing the lanes, so that a change anywhere reaches all of them.
#include "base/content_digest.h"

#include <stdio.h>
#include <string.h>

static const uint64_t prime = UINT64_C(0x100000001b3);

static uint64_t fold(uint64_t lane, uint64_t word)
{
    lane = (lane ^ word) * prime;
    return lane ^ lane >> 29;
}

ContentDigest content_digest_begin(void)
{
    const uint64_t basis = UINT64_C(0xcbf29ce484222325);
    return (ContentDigest){{basis, basis + 1, basis + 2, basis + 3}};
}

static void mix_lanes(ContentDigest *digest)
{
    for (int round = 0; round < 2; round++)
        for (int i = 0; i < 4; i++)
            digest->lane[i] = fold(digest->lane[i], digest->lane[(i + 3) % 4]);
}

void content_digest_add(ContentDigest *digest, const void *bytes, size_t length)
{
    enum { STRIDE = 4 * sizeof(uint64_t) };
    const unsigned char *at = bytes;
    uint64_t word[4], a = digest->lane[0], b = digest->lane[1], c = digest->lane[2], d = digest->lane[3];
    size_t left = length;
    for (; left >= STRIDE; left -= STRIDE, at += STRIDE) {
        memcpy(word, at, STRIDE);
        a = fold(a, word[0]);
        b = fold(b, word[1]);
        c = fold(c, word[2]);
        d = fold(d, word[3]);
    }
    memset(word, 0, sizeof word);
    if (left > 0)
        memcpy(word, at, left);
    *digest = (ContentDigest){{fold(a, word[0]), fold(b, word[1]), fold(c, word[2]), fold(fold(d, word[3]), (uint64_t)length)}};
    mix_lanes(digest);
}

void content_digest_hex(const ContentDigest *digest, char hex[65])
{
    for (int i = 0; i < 4; i++)
        snprintf(hex + 16 * i, 17, "%016llx", (unsigned long long)digest->lane[i]);
}
