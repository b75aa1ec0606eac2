// SHA-256 (FIPS 180-4), to identify the input files of a recording.
#ifndef SELDINGER_BASE_SHA256_H
#define SELDINGER_BASE_SHA256_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct Sha256 {
    uint32_t state[8];
    uint64_t length;         // bytes so far
    unsigned char block[64];
} Sha256;

void sha256_begin(Sha256 *sha);
void sha256_add(Sha256 *sha, const void *data, size_t length);
void sha256_end(Sha256 *sha, char hex[65]);
bool sha256_of_file(const char *path, char hex[65]);

#endif
