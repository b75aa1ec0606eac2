// A digest of 256 bits for content that nobody forges: keys of caches, checksums of their files. It reads memory at about its full speed, SHA-256 (sha256.h) at a
// fortieth of that.
#ifndef SELDINGER_BASE_CONTENT_DIGEST_H
#define SELDINGER_BASE_CONTENT_DIGEST_H

#include <stddef.h>
#include <stdint.h>

typedef struct ContentDigest {
    uint64_t lane[4];
} ContentDigest;

ContentDigest content_digest_begin(void);
// Adds bytes and their number, so that the borders between parts count. The result depends on the byte order of the machine.
void content_digest_add(ContentDigest *digest, const void *bytes, size_t length);
void content_digest_hex(const ContentDigest *digest, char hex[65]);

#endif
